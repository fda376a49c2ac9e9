"""Single sensors, on the robot and in its cell, count as the sensors of rings do; a search covers
what they leave.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.definitions.errors import UserError
from place_rings.coverage.occlusion.occluders import beams
from place_rings.coverage.rings.mounted_sensor import MountedSensor
from place_rings.coverage.rings.mounting_errors import MountingErrors, draw_errors
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.robots.built_in import ROBOTS, UR10
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.coverage.solids.polyhedra import box
from place_rings.coverage.targets.named import Shell
from place_rings.coverage.voxels.octree import count
from place_rings.formats.loader import read_scene
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.obstacle import Obstacle
from place_rings.objectives.parameterization import decode
from place_rings.objectives.redundancy import redundancy
from place_rings.objectives.scene import Scene
from place_rings.objectives.soft_coverage import SoftCoverage
from place_rings.objectives.target_points import TargetPoints
from place_rings.objectives.target_voxels import target_voxels
from place_rings.objectives.tolerance import mounted_cones
from place_rings.objectives.verify import Verifier
from place_rings.objectives.verify_breakdown import by_part
from place_rings.placement.redesign.beam_search import BeamPlan, Stage
from place_rings.placement.search.exchange import share_of
from place_rings.placement.search.exchange_points import Fields
from place_rings.placement.search.schedule import Round
from place_rings.placement.space.design import Space
from place_rings.placement.space.starts import fresh

from ..strategies.rings import LINKS, setups
from ..strategies.scenes import CELLS, scenes, shells
from ..strategies.singles import in_singles, singles
from ..strategies.units import FACINGS, directions, ups
from ..support.searching import improve, search

MODELS = ("ignore", "shadow", "blind")
SQUARE = Sensor(math.radians(70), 1.2, None, math.radians(40), 4)


@pytest.mark.parametrize("rule", ["centre", "touch"])
@pytest.mark.parametrize("occlusion", MODELS)
@settings(max_examples=4)
@given(scene=scenes(shells(300, 1000), CELLS))
def test_single_sensors_in_the_places_of_a_rings_count_the_same(rule, occlusion, scene):
    voxel = scene.voxel(rule)
    wanted, rings = target_voxels(scene.solid, voxel, rule), Setup(scene.setup.rings)
    each = [
        count(
            beams(sensor_cones(scene.arm, setup, scene.q), scene.occluders, occlusion),
            voxel,
            rule,
            wanted,
        )
        for setup in (rings, in_singles(scene.arm, rings))
    ]
    assert each[0] == each[1]


@given(setups(), st.sampled_from(list(ROBOTS)))
def test_the_single_sensors_of_a_ring_have_its_beams(setup, name):
    robot = ROBOTS[name]
    squares = tuple(replace(r, sensor=SQUARE) for r in setup.rings[::2])
    setup, q = Setup((*setup.rings, *squares)), np.linspace(-1, 1, len(robot.chain))
    one, other = (sensor_cones(robot, s, q) for s in (setup, in_singles(robot, setup)))
    for key in ("apex", "axis", "half_angle", "range_m", "up", "size"):
        square = other.size > 0 if key == "up" else slice(None)
        np.testing.assert_allclose(
            getattr(one, key)[square], getattr(other, key)[square], rtol=0, atol=1e-12
        )


@given(singles(), FACINGS, st.integers(-180, 180))
def test_a_single_sensor_stands_where_its_frame_says(one, facing, roll):
    q = np.array([0.3, -1.0, 1.2, 0.4, -0.7, 0.2])
    lean = ups(facing, roll) + 0.4 * directions(facing)
    there = replace(
        one, direction=tuple((3 * directions(facing)).tolist()), up=tuple(lean.tolist())
    )
    assert np.allclose(there.T_link_sensor[:3, 2], directions(facing))
    assert np.allclose(there.T_link_sensor[:3, 1], ups(facing, roll))
    assert np.linalg.det(there.T_link_sensor) == pytest.approx(1)
    frame = UR10.frames[one.link]
    T = (np.eye(4) if frame < 0 else forward(UR10.chain, q)[frame]) @ there.T_link_sensor
    cones = sensor_cones(UR10, Setup((), (there,)), q)
    assert np.allclose(cones.apex[0], T[:3, 3])
    assert np.allclose(cones.axis[0], T[:3, 2])
    again = MountedSensor.from_frame(one.link, there.T_link_sensor, one.sensor)
    assert np.allclose(again.T_link_sensor, there.T_link_sensor, atol=1e-12)


CAMERA = MountedSensor("base", (0.4, 0.0, 1.8), (0, 0, -1), SQUARE, (0, 1, 0), "camera")
TARGET = Shell(0.5)


@pytest.mark.parametrize("occlusion", MODELS)
def test_a_sensor_of_the_cell_is_a_single_sensor_on_the_base(occlusion):
    rules, ring = Rules(mount="free"), Ring("forearm", 0.5, 8)
    cell = Scene(occlusion=occlusion, rules=rules, cell_sensors=(CAMERA,))
    bare = replace(cell, cell_sensors=())
    one = Verifier(cell, 0.03).verify(Setup((ring,)), TARGET)
    other = Verifier(bare, 0.03).verify(Setup((ring,), (CAMERA,)), TARGET)
    assert (one.zeta, one.poses) == (other.zeta, other.poses)
    alone = Verifier(bare, 0.03).verify(Setup((), (CAMERA,)), TARGET)
    assert alone.zeta > 0.1
    assert by_part(Verifier(cell, 0.03), Setup((ring,)), one) == {
        "rings": Verifier(bare, 0.03).verify(Setup((ring,)), TARGET).zeta,
        "sensors of the cell": alone.zeta,
    }
    on_robot = by_part(Verifier(bare, 0.03), Setup((ring,), (CAMERA,)), other)
    assert on_robot["single sensors"] == alone.zeta
    assert by_part(Verifier(bare, 0.03), Setup((ring,)), other) == {}


def test_what_stands_before_a_camera_hides_what_is_behind_it():
    """A plate below the camera leaves nothing to see under it."""
    plate = Obstacle("plate", box([0.4, 0, 1.6], [2, 2, 0.02], np.eye(3)))
    scene = Scene(cell_sensors=(CAMERA,), obstacles=(plate,), occlusion="ignore")
    assert Verifier(scene, 0.03).verify(Setup(), TARGET).zeta == 0


@pytest.mark.parametrize(
    ("wrong", "key"),
    [
        ({"direction": (0, 0, 0)}, "direction"),
        ({"position": (0, math.nan, 0)}, "position"),
        ({"sensor": SQUARE}, "up"),
        ({"up": (0, 0, -3.0)}, "up"),
    ],
)
def test_a_single_sensor_that_cannot_be_is_refused(wrong, key):
    with pytest.raises(ValueError, match=f"{key}.*: found"):
        MountedSensor(**({"link": "tool", "position": (0, 0, 0), "direction": (0, 0, 1)} | wrong))


@pytest.mark.parametrize("key", ["cell_sensors", "fixed_sensors"])
@pytest.mark.parametrize(
    ("wrong", "found"),
    [
        ("direction = [0, 0, 0]", r'direction: found "\[0.0, 0.0, 0.0\]"'),
        ("direction = [0, 0, 1]\nup = [0, 0, 2]", r'up: found "\[0.0, 0.0, 2.0\]"'),
        ("direction = [0, 0, 1]\nsensor = { fov_deg = 20, fov_up_deg = 20 }", "up: found nothing"),
    ],
)
def test_a_pose_that_cannot_be_names_its_file_and_key(tmp_path, key, wrong, found):
    keys = "" if "sensor" in wrong else "sensor = {}\n"
    keys = "link = 'tool'\n" * (key == "fixed_sensors") + (keys if key == "cell_sensors" else "")
    (tmp_path / "scene.toml").write_text(f"[[{key}]]\n{keys}position = [0, 0.1, 0]\n{wrong}\n")
    with pytest.raises(UserError, match=rf"scene.toml: {key}\[0\].{found}"):
        read_scene(tmp_path / "scene.toml")


def test_a_sensor_of_the_cell_is_on_the_base():
    with pytest.raises(ValueError, match=r'cell_sensors\[0\].link: found "tool"'):
        Scene(cell_sensors=(replace(CAMERA, link="tool"),))


SKIN = MountedSensor("forearm", (0.0, 0.08, 0.2), (0, 1, 0), Sensor(math.radians(60), 0.8))
LAMP = MountedSensor(
    "base", (0.5, 0, 1.5), (0, 0, -1), Sensor(0.7, 1.2, None, 0.5, 64), (0, 1, 0), "camera"
)
HELD = Ring("forearm", 0.5, 4)
SCENE = Scene(
    targets=(TARGET,),
    occlusion="ignore",
    rules=Rules(mount="free", fixed=(HELD,), fixed_sensors=(SKIN,)),
    cell_sensors=(LAMP,),
)
ERRORS = MountingErrors(0.01, 0.05)


@pytest.fixture(scope="module")
def soft():
    """Space of 20 sensors, points, and the soft coverage, which is compiled once."""
    points = TargetPoints(SCENE, 1024, 0)
    return Space(SCENE, sensors=20), points, SoftCoverage(SCENE, points.terms, points.points)


def test_the_exchange_the_soft_estimate_and_the_exact_count_agree(soft):
    """On points: 1024 have a standard error of 0.016."""
    space, points, coverage = soft
    fields, verifier = Fields(space, points), Verifier(SCENE, 0.04)
    for seed in range(3):
        c = fresh(space, np.random.default_rng(seed))
        arrays, where = space.arrays(c)
        share = coverage.share(arrays, decode(where, space.values(c)))
        assert share_of(space, fields, c) == pytest.approx(share, abs=2e-3)
        setup = space.setup(c)
        assert verifier.verify(setup, TARGET).zeta == pytest.approx(share, abs=0.05)
        assert setup.singles == (SKIN,)
        assert HELD in setup.rings
        assert sum(ring.count for ring in setup.rings) == 20
    bare = replace(SCENE, cell_sensors=())
    assert Verifier(bare, 0.04).verify(Setup(), TARGET).zeta == 0


def test_sensors_of_the_cell_neither_err_nor_fail():
    verifier = Verifier(SCENE, 0.04)
    setup = Setup((HELD,), (SKIN,))
    lost = redundancy(verifier, setup, TARGET)
    assert (len(lost.without_sensor), len(lost.without_ring)) == (5, 2)
    without = Verifier(replace(SCENE), 0.04).verify(Setup((HELD,)), TARGET).zeta
    assert lost.without_ring[1] == pytest.approx(without, abs=1e-12)
    drawn = draw_errors(2, 5, ERRORS, 3, 0)
    whole = mounted_cones(verifier, setup, drawn)(0)
    assert len({tuple(v for a in (c.apex[5], c.axis[5], c.up[5]) for v in a) for c in whole}) == 1
    assert len({tuple(c.axis[4]) for c in whole}) == 3


def test_a_search_covers_what_the_standing_sensors_leave():
    schedule = (Round(512, 2, 1, 4, 0.2),)
    found = search(Space(SCENE, sensors=12), seed=2, schedule=schedule, voxel=0.05)
    verifier = Verifier(SCENE, 0.05)
    assert found.setup.singles == (SKIN,)
    assert HELD in found.setup.rings
    assert sum(ring.count for ring in found.setup.rings) == 12
    assert (found.short, found.exact) == verifier.judge(found.setup)
    assert found.exact > verifier.verify(Setup((HELD,), (SKIN,)), TARGET).zeta


@pytest.mark.slow
def test_a_redesign_keeps_single_sensors():
    scene = replace(SCENE, rules=Rules(mount="free"))
    before = Setup((Ring("forearm", 0.5, 8), Ring("upper_arm", 0.2, 8)), (SKIN,))
    plan = BeamPlan(24, 256, 0.05, 3, (Stage(0.03, 8, 2),), 512, 1)
    found = improve(scene, before, changes=1, seed=1, plan=plan, voxel=0.05)
    verifier = Verifier(scene, 0.05)
    for answer in (found.mounted, *found.steps):
        assert answer.setup.singles == (SKIN,)
        assert (answer.short, answer.exact) == verifier.judge(answer.setup)
    assert found.steps


def test_links_of_single_sensors_are_known_to_every_robot():
    for robot in ROBOTS.values():
        assert {"base", "tcp", *LINKS, *robot.chain.joints} <= set(robot.frames)
        with pytest.raises(ValueError, match="'nose'"):
            robot.frame_of("nose")
