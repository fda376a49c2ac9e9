"""Files and domain objects are two views of one thing: there and back again is the identity."""

import dataclasses
import math
from collections.abc import Callable
from functools import partial

import numpy as np
import place_rings as pr
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.definitions.definition import adapter
from place_rings.coverage.electronics.electronics import Electronics
from place_rings.coverage.rings.mounted_sensor import MountedSensor
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.robots.built_in import ROBOTS, UR10
from place_rings.coverage.robots.kinematics import rotation_rpy, rpy_of
from place_rings.coverage.robots.robot_table import RobotTable
from place_rings.coverage.robots.separation_distance import Safety
from place_rings.coverage.robots.stop_times import StopTime
from place_rings.coverage.sensors.board_packing import Printing
from place_rings.coverage.sensors.boards import Board
from place_rings.coverage.sensors.effective_range import Use
from place_rings.coverage.sensors.sensor import Sensor, effective
from place_rings.coverage.targets.named import ReachAndToolSpheres, Shell
from place_rings.coverage.targets.posed_robot import Shape
from place_rings.formats.loader import read_proposal, read_robot, read_scene
from place_rings.formats.schema.proposal_models import ProposalFile
from place_rings.formats.schema.versions import RobotFile
from place_rings.formats.writing import to_toml
from place_rings.objectives.link_limits import LinkLimits
from place_rings.objectives.motion_limits import Motion
from place_rings.objectives.mount_rules import Limits, Rules
from place_rings.objectives.poses import Pose, Recorded
from place_rings.objectives.prices import Prices
from place_rings.objectives.scene import Scene
from pydantic import ValidationError

from ..support.scene_tables import scene_of_table, scene_table, scene_toml


def numbers(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers of few decimals, as files hold angles and places."""
    return st.integers(round(1e4 * low), round(1e4 * high)).map(lambda n: n / 1e4)


def angles(low: float, high: float) -> st.SearchStrategy[float]:
    """Angles, rad, of so many degrees."""
    return numbers(low, high).map(math.radians)


def pairs(values: st.SearchStrategy[float]) -> st.SearchStrategy[tuple[float, float]]:
    return st.tuples(values, values).map(lambda pair: (min(pair), max(pair)))


def drawn(kind: Callable[..., object], **fields: st.SearchStrategy) -> st.SearchStrategy[partial]:
    """What ``made`` makes a domain object of: their checks may not run while values are drawn."""
    return st.fixed_dictionaries(fields).map(lambda values: partial(kind, **values))


def made(value):
    """The domain objects of what was drawn."""
    match value:
        case partial():
            return value.func(**made(value.keywords))
        case dict():
            return {key: made(inner) for key, inner in value.items()}
        case tuple() | list():
            return type(value)(made(inner) for inner in value)
    return value


def catalogue_sensor(use: Use, board: Board | None) -> Sensor:
    sensor = effective(use).sensor
    return sensor if board is None else dataclasses.replace(sensor, board=board)


LENGTHS = numbers(0.01, 1)
SHARES = numbers(0, 1)
BOARDS = drawn(
    Board,
    width=numbers(0.02, 0.05),
    height=numbers(0.02, 0.05),
    thickness=numbers(0.001, 0.002),
    lens=st.tuples(numbers(-0.005, 0.005), numbers(-0.005, 0.005)),
    holes=st.lists(st.tuples(numbers(-0.008, 0.008), numbers(-0.008, 0.008)), max_size=2).map(
        tuple
    ),
    source=st.text("abc é\n\"'", max_size=9),
)
USES = (Use("vl53l5cx", "5klx"), Use("vl53l1x", "50kcps", 0.54, (0.3, 0.4)), Use("vl53l0x"))
SENSORS = st.one_of(
    drawn(Sensor, fov=angles(1, 170), range_m=LENGTHS, board=st.none() | BOARDS),
    drawn(
        Sensor,
        fov=angles(1, 170),
        range_m=LENGTHS,
        fov_up=angles(1, 170),
        zones=st.integers(1, 8),
        board=st.none() | BOARDS,
    ),
    drawn(Sensor, fov=angles(1, 180), range_m=LENGTHS, shape=st.just("dome")),
    drawn(Sensor, fov=angles(1, 360), range_m=LENGTHS, shape=st.just("fan"), thickness=LENGTHS),
    drawn(Sensor, fov=angles(1, 170), range_m=numbers(1, 2), near_m=numbers(0, 0.9)),
    drawn(catalogue_sensor, use=st.sampled_from(USES), board=st.none() | BOARDS),
)
RINGS = drawn(
    Ring,
    link=st.sampled_from(UR10.links),
    position=SHARES,
    count=st.integers(1, 50),
    tilt=angles(-89, 89),
    phase=angles(-360, 360),
    radius=LENGTHS,
    sensor=SENSORS,
)
SINGLES = drawn(
    MountedSensor,
    link=st.sampled_from(list(UR10.frames)),
    position=st.tuples(*[numbers(-1, 1)] * 3),
    direction=st.tuples(numbers(0.1, 1), numbers(-1, 1), numbers(-1, 1)),
    up=st.tuples(numbers(-0.05, 0), numbers(-1, 1), numbers(2, 3)),
    sensor=SENSORS,
    name=st.text("abc é", max_size=9),
)
IN_CELL = SINGLES.map(lambda one: partial(one.func, **{**one.keywords, "link": "base"}))
POSES = drawn(
    Pose,
    q=st.lists(angles(-180, 180), min_size=6, max_size=6).map(np.array),
    weight=LENGTHS,
    time_s=st.none() | SHARES,
    rate=st.none() | st.lists(angles(-90, 90), min_size=6, max_size=6).map(np.array),
)
_TERMS = {"weight": LENGTHS, "at_least_percent": numbers(0, 100)}
GOALS = drawn(Shell, radius=numbers(0.6, 2), **_TERMS) | drawn(ReachAndToolSpheres, **_TERMS)
LIMITS = drawn(
    Limits,
    position=pairs(SHARES),
    tilt=pairs(angles(-80, 80)),
    keep_out=st.lists(pairs(SHARES), max_size=2).map(tuple),
    sensor=st.none() | SENSORS,
    radius=st.none() | LENGTHS,
)
RULES = drawn(
    Rules,
    spacing=LENGTHS,
    from_joints=LENGTHS,
    sensors=st.tuples(st.integers(1, 5), st.integers(6, 9)),
    max_rings_per_link=st.integers(1, 9),
    shared_tilt=st.booleans(),
    fixed=st.lists(RINGS, max_size=2).map(tuple),
    fixed_sensors=st.lists(SINGLES, max_size=2).map(tuple),
    mount=st.sampled_from(["real", "free"]),
    standoff=numbers(0.1, 1),
    clearance=numbers(0, 0.1),
)
TERMS = {
    field.name: LENGTHS
    for field in dataclasses.fields(Safety)
    if field.name not in ("stopping", "stop_times")
}
STOPS = st.lists(
    drawn(
        StopTime,
        joint=st.sampled_from(UR10.chain.joints),
        **dict.fromkeys(("extension_percent", "load_percent"), numbers(0, 100)),
        **dict.fromkeys(("speed_percent", "stop_s", "stop_rad"), LENGTHS),
        stop_m=st.none() | LENGTHS,
        repeat=st.integers(1, 99),
    ),
    max_size=3,
    unique_by=lambda stop: stop.keywords["repeat"],
)
SAFETIES = st.one_of(
    drawn(Safety, **TERMS, stopping=st.none() | LENGTHS),
    drawn(Safety, **TERMS, stop_times=STOPS.map(tuple)),
)
MOTIONS = drawn(
    Motion,
    speed=angles(1, 60),
    acceleration=angles(1, 120),
    near=numbers(0.05, 1),
    own=numbers(0.02, 1),
    cell=numbers(0.02, 1),
    near_share=SHARES,
    failed_share=numbers(0, 0.5),
    frozen_frames=st.integers(2, 9),
    cell_complete=st.booleans(),
    rings_as_proposed=st.booleans(),
)
LINKS = drawn(
    LinkLimits,
    rate=numbers(100, 500),
    state_stale=numbers(0.05, 0.5),
    ring_silent=numbers(0.5, 1),
    ring_late=numbers(0.01, 0.5),
    sign_of_life=numbers(0.05, 0.5),
    watchdog=numbers(0.05, 0.5),
)
PRINTINGS = drawn(
    Printing,
    wall=numbers(0.003, 0.01),
    relief=numbers(0, 0.01),
    bolt=st.sampled_from(["M3", "M4", "M5"]),
    nut=st.sampled_from(["trap", "through"]),
    fastening=st.sampled_from(["nut", "insert"]),
    bed=st.none() | st.tuples(*[st.integers(20, 900).map(lambda n: n / 1000)] * 3),
    lettering=st.booleans(),
    ties=st.booleans(),
    overhang=SHARES,
)
SCENES = drawn(
    Scene,
    robot=st.sampled_from([UR10, dataclasses.replace(UR10, name="mine")]),
    poses=st.lists(POSES, min_size=1, max_size=2).map(tuple),
    targets=st.lists(GOALS, min_size=1, max_size=2).map(tuple),
    sensor=SENSORS,
    ring_radius=LENGTHS,
    base=st.just("base_link"),
    curve=drawn(Shape, blend=numbers(0.1, 1), points_per_bend=st.integers(2, 30)),
    mounts=st.dictionaries(st.sampled_from(UR10.links), LIMITS, max_size=2),
    rules=RULES,
    over_poses=st.sampled_from(["mean", "worst"]),
    recorded=st.none()
    | drawn(
        Recorded,
        file=st.just("a.csv"),
        rows=st.integers(0, 9),
        seconds=SHARES,
        within=angles(0, 9),
        speed_weight=SHARES,
    ),
    occlusion=st.sampled_from(["ignore", "shadow", "blind"]),
    cell_sensors=st.lists(IN_CELL, max_size=2).map(tuple),
    safety=SAFETIES,
    motion=MOTIONS,
    link=LINKS,
    printing=PRINTINGS,
    electronics=drawn(
        Electronics,
        rate_hz=st.none() | st.integers(10, 100),
        bus=st.sampled_from(["auto", "direct", "multiplexer", "own"]),
        controller=st.sampled_from(["esp32-s3-devkitc-1", "esp32-devkit", "pico"]),
    ),
    prices=st.none()
    | drawn(
        Prices,
        ring=numbers(0, 90),
        sensor=numbers(0, 90),
        currency=st.sampled_from(["", "EUR", "€"]),
        models=st.dictionaries(st.sampled_from(["vl53l1x", "vl53l5cx"]), numbers(0, 90)),
    ),
)


def plain(value: object) -> object:
    """A domain object as nested tuples that compare, arrays by their numbers."""
    if isinstance(value, np.ndarray):
        return value.dtype, value.tolist()
    if dataclasses.is_dataclass(value):
        return type(value), {
            f.name: plain(getattr(value, f.name)) for f in dataclasses.fields(value)
        }
    if isinstance(value, dict):
        return {key: plain(inner) for key, inner in value.items()}
    return [plain(inner) for inner in value] if isinstance(value, tuple | list) else value


@settings(max_examples=15)
@given(SCENES)
def test_a_scene_is_what_its_file_says(tmp_path_factory, scene):
    scene = made(scene)
    path = tmp_path_factory.mktemp("files") / "scene.toml"
    table = scene_table(scene)
    path.write_text(scene_toml(scene))
    again = read_scene(path)
    if scene.robot is not UR10:  # in-line: rounded as files are
        assert RobotTable.of(again.robot) == RobotTable.of(scene.robot)
        again = dataclasses.replace(again, robot=scene.robot)
    assert plain(again) == plain(scene)
    assert scene_table(again) == table


@settings(max_examples=15)
@given(st.lists(RINGS, max_size=3), st.lists(SINGLES, min_size=1, max_size=3), SENSORS)
def test_a_setup_is_what_its_proposal_says(tmp_path_factory, rings, singles, sensor):
    setup, sensor = Setup(tuple(made(rings)), tuple(made(singles))), made(sensor)
    path = tmp_path_factory.mktemp("files") / "proposal.toml"
    file = ProposalFile.of(setup, Scene.paper(sensor=sensor))
    path.write_text(to_toml(file))
    again, scene, read = read_proposal(path)
    assert (again, scene.sensor, read.stated()) == (setup, sensor, file.stated())


@given(SENSORS)
def test_a_sensor_is_what_its_table_says(sensor):
    sensor = made(sensor)
    of = adapter(Sensor)
    table = of.dump_python(sensor, mode="json")
    again = of.validate_python(table)
    assert again == sensor
    assert of.dump_python(again, mode="json") == table


@pytest.mark.parametrize("name", ROBOTS)
def test_a_robot_is_what_its_file_says(tmp_path, name):
    """Frames are rounded in files: what has been read once stays as it is."""
    path, file = tmp_path / "robot.toml", RobotTable.of(ROBOTS[name])
    path.write_text(to_toml(ROBOTS[name], file=RobotFile))
    robot = read_robot(path)
    assert RobotTable.of(robot) == file
    for a, b in ((robot.chain.origin, ROBOTS[name].chain.origin), (robot.home, ROBOTS[name].home)):
        if b is not None:
            np.testing.assert_allclose(a, b, atol=1e-11)
    assert robot.links == ROBOTS[name].links
    np.testing.assert_allclose(robot.limits, ROBOTS[name].limits, atol=1e-11)
    for of in (lambda r: r.mounts, lambda r: r.bodies):
        for a, b in zip(of(robot), of(ROBOTS[name]), strict=True):
            assert a.frame == b.frame
            x, y = (getattr(one, "capsule", one) for one in (a, b))
            np.testing.assert_allclose(x.start, y.start, atol=1e-11)


@given(st.tuples(angles(-180, 180), angles(-90, 90), angles(-180, 180)))
def test_urdf_angles_give_the_rotation_again(rpy):
    R = rotation_rpy(*rpy)
    np.testing.assert_allclose(rotation_rpy(*rpy_of(R)), R, atol=1e-8)


SINGLE = {"link": "tool", "position": [0.0, 0.0, 0.0], "direction": [0.0, 0.0, 1.0]}


@pytest.mark.parametrize("key", ["calibration", "trajectory", "fixed", "fixed_sensors"])
def test_what_only_a_file_states_is_no_argument(key):
    with pytest.raises(pr.InputError, match=f"^Scene: {key}: found an unknown argument"):
        Scene(**{key: []})


@pytest.mark.parametrize(
    ("key", "table"),
    [
        ("trajectory", {"trajectory": "motion.csv"}),
        ("trajectory", {"trajectory": "motion.csv", "poses": [{"q_deg": [0.0] * 6}]}),
        ("fixed", {"fixed": [{"link": "wing", "count": 4}]}),
        ("fixed_sensors", {"fixed_sensors": [{**SINGLE, "link": "wing"}]}),
        ("fixed_sensors", {"fixed_sensors": [SINGLE], "sensor": {"fov_up_deg": 20.0}}),
        ("calibration", {"robot": "ur5e", "calibration": {"joints": [{}], "tcp": {}}}),
        ("robot", {"robot": "nobody", "poses": [{"q_deg": [0.0]}], "occlusion": "blind"}),
    ],
)
def test_a_key_that_no_scene_agrees_with_is_named(key, table):
    with pytest.raises(ValidationError) as error:
        scene_of_table(table)
    assert error.value.errors()[0]["loc"][0] == key
