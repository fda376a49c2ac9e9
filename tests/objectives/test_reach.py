"""What no layout covers: no point that a drawn layout covers is beyond any sensor; closed forms."""

import math
from dataclasses import replace

import numpy as np
import place_rings as pr
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from place_rings.coverage.rings.mounted_sensor import MountedSensor
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.robots.built_in import ROBOTS
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.coverage.solids.polyhedra import box
from place_rings.coverage.targets.named import Shell
from place_rings.coverage.targets.own import Sphere
from place_rings.objectives.feasibility.clearance import MountClearance
from place_rings.objectives.feasibility.violations import faults
from place_rings.objectives.mount_rules import Limits, Rules
from place_rings.objectives.obstacle import Obstacle
from place_rings.objectives.occlusion import setup_sight
from place_rings.objectives.poses import Pose
from place_rings.objectives.reach import beyond, beyond_sensors
from place_rings.objectives.scene import Scene

from ..strategies.units import GENERATORS

SENSORS = [
    Sensor(math.radians(25), 0.6),
    Sensor(math.radians(45), 1.0, fov_up=math.radians(45), zones=8, near_m=0.05),
    Sensor(math.radians(150), 0.3, shape="dome"),
    Sensor(math.radians(270), 0.7, shape="fan", thickness=0.02),
]
TARGET = Shell(0.7)


def drawn_scene(rng, sensor, occlusion, real):
    robot = ROBOTS[str(rng.choice(["ur10", "ur5e", "panda"]))]
    q = robot.rest + rng.uniform(-0.6, 0.6, len(robot.rest))
    bodies = [
        box([0.3, 0.0, -0.05], [*rng.uniform(0.8, 2, 2), rng.uniform(0.005, 0.1)]),
        box(rng.uniform(-0.8, 0.8, 3), rng.uniform(0.02, 0.5, 3)),
    ]
    low = float(rng.uniform(-1.2, 1))
    tilt = low, low + float(rng.uniform(0, 0.5))
    limits = Limits(position=(0.1, 0.9), tilt=tilt, keep_out=((0.3, 0.6),))
    return Scene(
        robot=robot,
        poses=(Pose(q),),
        targets=(TARGET,),
        sensor=sensor,
        occlusion=occlusion,
        mounts=dict.fromkeys(robot.links, limits) if rng.random() < 0.5 else {},
        rules=Rules(mount="real" if real else "free"),
        obstacles=tuple(Obstacle(f"o{i}", b) for i, b in enumerate(bodies)),
    )


def drawn_rings(scene, rng, count):
    """Rings that the rules allow one by one, with the radii of a search."""
    clear, rings = MountClearance(scene) if scene.real else None, []
    for _ in range(40):
        link = str(rng.choice(scene.robot.links))
        limits = scene.limits_of(link)
        ring = Ring(
            link,
            float(rng.uniform(*limits.position)),
            int(rng.integers(3, 9)),
            float(rng.uniform(*limits.tilt)),
            float(rng.uniform(-3, 3)),
            clear.radius(link) if clear else scene.radius_of(link),
            scene.sensor_of(link),
        )
        if not faults(scene, [ring], clear):
            rings.append(ring)
        if len(rings) == count:
            break
    return tuple(rings)


@settings(max_examples=6, deadline=None)
@given(
    GENERATORS,
    st.sampled_from(SENSORS),
    st.sampled_from(["ignore", "shadow", "blind"]),
    st.sampled_from([True, False, False]),
)
def test_no_point_that_a_layout_covers_is_beyond_any_sensor(rng, sensor, occlusion, real):
    scene = drawn_scene(rng, sensor, occlusion, real)
    rings = drawn_rings(scene, rng, 6)
    assume(rings)
    points = scene.sample(TARGET, 0, 1500, 1)
    covered = setup_sight(scene, Setup(rings), scene.poses[0].q).holds(points)
    assert points[covered & beyond(scene, points, 0)].tolist() == []


def test_what_lies_under_a_wide_table_is_beyond_any_sensor():
    """Also under one of a millimetre, which no ball about an apex would stand for."""
    table = Obstacle("table", box([0, 0, -0.05], [9, 9, 0.001]))
    scene = Scene(targets=(TARGET,), obstacles=(table,))
    points = scene.sample(TARGET, 0, 2000, 0)
    under, left = points[:, 2] < -0.05, beyond(scene, points, 0)
    assert left[under].mean() > 0.98
    assert left[~under].mean() < beyond_sensors(replace(scene, obstacles=()), TARGET).share + 0.02


def test_the_share_of_a_ball_about_one_place_has_a_closed_form():
    """Rings of radius 0 at one place, in all directions that tilts allow."""
    half, low = math.radians(20), math.radians(-30)
    limits = Limits(position=(0.5, 0.5), tilt=(low, low), radius=1e-3)
    others = Limits(sensor=Sensor(2 * half, 0.01))
    scene = pr.Scene.paper(robot="ur10", sensor=Sensor(2 * half, 5.0))
    scene = replace(
        scene,
        mounts={link: limits if link == "forearm" else others for link in scene.robot.links},
    )
    rng = np.random.default_rng(0)
    mount = scene.robot.mount("forearm")
    T = forward(scene.robot.chain, scene.poses[0].q)[mount.frame]
    way = rng.normal(size=(4000, 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    middle = T[:3, :3] @ (mount.start + 0.5 * mount.length * mount.axis) + T[:3, 3]
    share = beyond(scene, middle + 2.0 * way, 0).mean()
    band = (math.sin(low + half) - math.sin(low - half)) / 2  # of a sphere
    assert share == pytest.approx(1 - band, abs=0.04)


def test_every_pose_counts_among_many():
    """Poses that alternate between two, of which one reaches the target; in both orders."""
    there, away = (Pose(np.radians([turn, -20, 20, -90, -90, 0])) for turn in (180, 0))
    ball = Sphere(0.2, (1.8, 0.0, 0.5), name="ball")

    def share(*poses):
        scene = Scene(poses=poses, targets=(ball,), occlusion="ignore", rules=Rules(mount="free"))
        return beyond_sensors(scene, ball)

    mean = (share(there).share + share(away).share) / 2
    assert 0.1 < mean < 0.9
    for poses in ((there, away), (away, there)):
        found = share(*poses * 16)
        assert 0 < abs(found.share - mean) + found.error < 0.5
        assert abs(found.share - mean) <= 1.5 * found.error


def test_what_is_counted_is_never_above_what_is_said_to_be_possible():
    """Also for sensors that the scene's rules know nothing of: other rings, and single ones."""
    short, long = Sensor(math.radians(20), 0.15), Sensor(math.radians(60), 1.5)
    ring = Ring("forearm", 0.5, 8, sensor=long)
    single = MountedSensor("base", (0.0, 0.0, 1.2), (1.0, 0.0, -0.3), long)
    scene = Scene(targets=(TARGET,), sensor=short, rules=Rules(mount="free"))
    for setup in (Setup((ring,)), Setup((), (single,))):
        record = pr.verify(setup, scene, voxel=0.04).records[0]
        most = 100 * (1 - record.beyond.share + record.beyond.error)
        assert 5 < 100 * record.zeta <= most + 100 * record.error
