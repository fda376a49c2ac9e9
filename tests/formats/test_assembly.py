"""Printed rings as a user mounts them: at no pose do parts overlap, or lie in a body."""

import io

import numpy as np
import pytest
import trimesh
from PIL import Image
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.rings.rounding import rounded
from place_rings.coverage.robots.built_in import ROBOTS
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.sensors.board_packing import Printing
from place_rings.coverage.sensors.effective_range import Use
from place_rings.coverage.sensors.sensor import effective
from place_rings.formats.printing.print_files import ring_files
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.placement.space.design import Space
from place_rings.placement.space.feasible_set import InfeasibleError
from place_rings.placement.space.starts import fresh
from place_rings.reporting.assembly_picture import assembly_picture, printed_parts

from ..support.assembly import Verdict, judge, shared

_NOTHING = 1.0  # mm³, rounding of facets

BEDS = (None, (0.22, 0.22, 0.25), (0.12, 0.12, 0.2))  # m


def drawn_proposal(rng: np.random.Generator, name: str, cover: bool = False, most: int = 24):
    """A scene of one to three poses with drawn bolts and bed, and rings anywhere that its rules
    allow, of 6 to ``most`` sensors; None if there is no room at these poses."""
    robot, sensor = ROBOTS[name], effective(Use(str(rng.choice(["vl53l4cd", "vl53l5cx"])))).sensor
    turns = [rng.normal(0, 0.3, len(robot.rest)) * i for i in range(rng.integers(1, 4))]
    poses = tuple(Pose(np.clip(robot.rest + turn, *robot.limits.T)) for turn in turns)
    printing = Printing(
        bolt=str(rng.choice(["M3", "M3", "M4", "M5"])),
        fastening="insert" if rng.uniform() < 0.5 else "nut",
        bed=BEDS[rng.integers(len(BEDS))],
        cover=cover,
    )
    scene = Scene(robot=robot, poses=poses, occlusion="shadow", sensor=sensor, printing=printing)
    try:
        space = Space(scene, sensors=int(rng.integers(6, most + 1)))
        candidate = fresh(space, rng)
    except InfeasibleError:
        return None
    return scene, rounded(space.setup(candidate), sensor)


def test_the_picture_of_an_assembled_robot_has_the_printed_parts_where_the_sensors_are():
    """Each sensor of a ring lies within the box around the ring's own printed halves."""
    sensor = effective(Use("vl53l4cd")).sensor
    scene = Scene(occlusion="shadow", rules=Rules(mount="real"), sensor=sensor)
    rings = [("upper_arm", 0.3, 3, 0.9), ("forearm", 0.5, 2, -0.4), ("tool", 0.0, 3, 0.0)]
    setup = Setup(
        tuple(
            Ring(link, at, n, tilt, 0.2, scene.radius_of(link), sensor)
            for link, at, n, tilt in rings
        )
    )
    result, data = ring_files(setup, scene, lambda *_: {})
    frames = forward(scene.robot.chain, scene.poses[0].q)
    parts = printed_parts(scene.robot, result, data, frames)
    assert [len(halves) for halves in parts] == [2, 2, 2]
    apex = sensor_cones(scene.robot, setup, scene.poses[0].q).apex
    of_ring = np.split(apex, np.cumsum([ring.count for ring in setup.rings])[:-1])
    for halves, own in zip(parts, of_ring, strict=True):
        boxes = np.array([half.bounding_box() for half in halves])
        low, high = boxes[:, :3].min(axis=0) - 0.002, boxes[:, 3:].max(axis=0) + 0.002
        assert np.all((low < own) & (own < high))
        others = [a for a in of_ring if a is not own]
        assert not np.any(np.all((low < np.vstack(others)) & (np.vstack(others) < high), axis=1))
    picture = np.asarray(
        Image.open(io.BytesIO(assembly_picture(scene, setup, result, data))).convert("RGB"), int
    )
    orange = (picture[..., 0] - picture[..., 2] > 60).any(axis=0)  # columns with printed parts
    assert orange[: len(orange) // 2].any()
    assert orange[len(orange) // 2 :].any()
    for edge in (picture[0], picture[-1], picture[:, 0], picture[:, -1]):
        assert np.all(edge == 255)  # nothing is cut off


@pytest.mark.parametrize(
    ("side", "x", "within"),
    [
        (20.0, 21.0, False),
        (20.0, 20.0, False),
        (20.0, 19.9995, False),
        (20.0, 19.998, True),
        (20.0, 19.0, True),
        (90.0, 0.0, True),
    ],
    ids=["apart", "touching", "touching but for rounding", "2 μm", "1 mm", "one within the other"],
)
def test_the_judge_finds_a_part_that_reaches_into_another(side, x, within):
    """A cube of ``side`` mm at the origin, and one of 20 mm at ``x``, both turned."""
    cubes = [trimesh.creation.box([edge] * 3) for edge in (side, 20.0)]
    data = {f"{i}.stl": cube.export(file_type="stl") for i, cube in enumerate(cubes)}
    turned = trimesh.transformations.rotation_matrix(0.5, [1.0, 2.0, 3.0])
    there = turned @ trimesh.transformations.translation_matrix([x / 1000, 0.0, 0.0])
    count = shared(data, [("0.stl", turned.tolist()), ("1.stl", there.tolist())])
    assert (count > 0) == within


@pytest.mark.parametrize("name", [pytest.param("ur10", marks=pytest.mark.slow), "panda"])
def test_printed_rings_overlap_nothing_when_they_are_mounted(name):
    rng = np.random.default_rng([ord(c) for c in name])
    draws = (drawn_proposal(rng, name, most=10) for _ in range(50))
    scene, setup = next(drawn for drawn in draws if drawn and len(drawn[1].rings) > 1)
    _, data = ring_files(setup, scene, lambda *_: {})
    verdict = judge(scene, setup, data, points=1000, near=10.0)
    assert verdict.beams > -1e-3
    if scene.printing.bed is not None:
        assert np.all(np.array(verdict.size) <= 1000 * np.array(scene.printing.bed) + 1e-3)
    holds(scene, verdict)


def holds(scene: Scene, verdict: Verdict) -> None:
    """The parts are closed, thick enough, and apart from each other and from the bodies."""
    assert verdict.watertight
    assert verdict.within == 0
    assert verdict.wall >= 1000 * scene.printing.least_wall - 1e-3
    assert verdict.overlap < _NOTHING, verdict.names
    assert min(verdict.rings, verdict.bodies) >= 1000 * scene.rules.clearance - 0.1  # facets
