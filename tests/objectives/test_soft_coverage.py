"""Soft coverage: in the sharp limit the criterion by counting, at any width the definition, slopes
that are central differences, and few points that stand for all.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import place_rings as pr
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.rings.mounting_errors import MountingErrors, misplaced_cones
from place_rings.coverage.rings.ring import Setup, named_setup, ring_values
from place_rings.coverage.rings.ring_kinematics import ring_arrays, sensor_cones
from place_rings.coverage.robots.built_in import ROBOTS
from place_rings.coverage.soft.estimator import SHARP
from place_rings.coverage.solids.polyhedra import hull
from place_rings.coverage.targets.named import ReachSphere, Shell
from place_rings.objectives import soft_coverage
from place_rings.objectives.criterion import Criterion
from place_rings.objectives.floors import TEMPERATURE, floors, worth
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.obstacle import Obstacle
from place_rings.objectives.occlusion import sight
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.objectives.soft_coverage import SoftCoverage
from place_rings.objectives.soft_terms import Sample

from ..strategies.rings import rings
from ..strategies.singles import FANS, KINDS, RANGES_MM, beam, dome, reporting, singles
from ..strategies.units import GENERATORS
from ..support.rails import carried

POINTS, SENSORS = 400, 40  # of each term; in the arrays, padding included
NEAR = 2e-5  # m: the slack of a sharp choice of sensors, and rounding to 32 bit
FREE = Rules(mount="free")
ERRORS = Criterion(errors=MountingErrors(0.01, 0.1), draws=2)


@cache
def scene_of(number: int, **fields) -> Scene:
    """A robot that holds a solid, at two poses of different weight, before an obstacle, with a
    sensor of the cell; the fields go before these."""
    rng = np.random.default_rng(number)
    tool = pr.Attached("tool", size=[0.1, 0.2, 0.06], centre=rng.uniform(-0.2, 0.2, 3).tolist())
    robot = (carried(ROBOTS["ur5e"]), ROBOTS["panda"], ROBOTS["ur10"])[number % 3]
    poses = rng.uniform(-1.5, 1.5, (2, len(robot.chain)))
    if robot.limits is not None:
        poses = np.clip(poses, *robot.limits.T)
    place = rng.uniform(-0.6, 0.6, 3) + 0.25 * np.array(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    )
    eye = pr.MountedSensor("base", (0.6, 0.1, 1.2), (0, 0, -1), pr.Sensor(0.7, 1.0, near_m=0.2))
    given = {
        "robot": robot.with_attached((tool,)) if fields.get("occlusion") != "ignore" else robot,
        "poses": (Pose(poses[0], 1.0), Pose(poses[1], 3.0)),
        "targets": (Shell(0.5, weight=2.0), ReachSphere()),
        "obstacles": (Obstacle("corner", hull(place)),),
        "cell_sensors": (eye,),
        "rules": FREE,
    }
    return Scene(**(given | fields))


@cache
def soft_of(scene: int, aim: Criterion, **fields) -> tuple[Scene, SoftCoverage]:
    """A scene and its soft coverage, compiled once; the points come with each call."""
    core = scene_of(scene, **fields)
    each = [(g, p) for g in range(len(core.targets)) for p in range(len(core.poses))]
    terms = each * aim.mountings
    return core, SoftCoverage(core, terms, [np.zeros((POINTS, 3))] * len(terms), aim)


# half angles, of pyramids at their corners, below 30 degrees: two of twelve sensors stand for all
NARROW = st.builds(
    beam,
    st.tuples(st.integers(10, 50), st.sampled_from([0, 20, 30])),
    RANGES_MM,
    st.sampled_from([0, 5, 50]),
) | st.builds(dome, st.integers(20, 56), RANGES_MM)


def setups(three, most: int) -> st.SearchStrategy[Setup]:
    """Three rings, of ``most`` sensors at most, and a single sensor: one shape for JAX."""

    def with_sensors(rings, sensors, single):
        each = [replace(r, sensor=s) for r, s in zip(rings, sensors, strict=True)]
        return Setup((replace(each[0], count=most), *each[1:]), (single,))

    some = st.lists(rings(most), min_size=3, max_size=3)
    return st.builds(with_sensors, some, three, singles(("forearm", "tcp")))


def arrays_of(scene: Scene, setup: Setup):
    """Arrays and values of a setup's rings, and the cell's sensors, padded."""
    groups, v = scene.with_cell(setup).groups, ring_values(scene.with_cell(setup).groups)
    arrays = ring_arrays(scene.robot, groups, SENSORS, KINDS)
    return arrays, np.stack([v.position, v.tilt, v.phase])


def terms_of(scene: Scene, setup: Setup, aim: Criterion):
    """The beams of each term: without occlusion, and their visible parts."""
    whole, drawn = scene.with_cell(setup), aim.drawn(len(setup.groups), setup.sensors)
    each = []
    for p in scene.poses:
        here = [sensor_cones(scene.robot, whole, p.q)]
        if drawn is not None:
            errors = drawn.beside(len(scene.cell_sensors))
            here = misplaced_cones(scene.robot, whole, p.q, errors)
        each.append([(cones, sight(scene, cones, p.q)) for cones in here])
    return [poses[d] for d in range(aim.mountings) for _ in scene.targets for poses in each]


def points_of(terms, rng) -> np.ndarray:
    """Points (T, N, 3) in and about the beams."""
    each = []
    for cones, _ in terms:
        unit = rng.random((POINTS, 3))
        points = np.concatenate([cones.within(k, unit) for k in range(len(cones))])
        points = points[rng.choice(len(points), POINTS, replace=False)]
        each.append(points + rng.normal(size=points.shape) * rng.choice([0.0, 0.1]))
    return np.stack(each)


def seen(terms, points, ring, most):
    """By which sensors points are seen (T, K, N): surely, where ``most`` of each ring count or
    nothing hides points from the nearest; and perhaps."""
    sure, perhaps = [], []
    for (cones, visible), here in zip(terms, points, strict=True):
        f, g = (np.stack([s.part(here, k) for k in range(len(cones))]) for s in (cones, visible))
        around = np.stack([(f[ring == i] <= NEAR).sum(axis=0) for i in ring])
        sure.append((g <= -NEAR) & ((around <= most) | (visible is cones)))
        perhaps.append(g <= NEAR)
    return np.stack(sure), np.stack(perhaps)


def counted(scene: Scene, setup: Setup, aim: Criterion, seen: np.ndarray) -> float:
    """The criterion by counting what sensors see, (T, K, N)."""
    ring = np.array(scene.with_cell(setup).ring_of_sensor)
    shape = (aim.mountings, len(scene.targets), len(scene.poses))

    def zetas(which):
        covered = seen[:, which].sum(axis=1) >= aim.seen
        return covered.mean(axis=1).reshape(shape).mean(axis=0)  # (G, P)

    def least(values):
        return -TEMPERATURE * np.log(np.mean(np.exp(-np.array(values) / TEMPERATURE)))

    every = np.ones(len(ring), bool)
    if aim.losing:
        number = ring if aim.losing == "ring" else np.arange(len(ring))
        mine = number[ring < len(setup.groups)]
        left = [zetas(number != i) @ scene.pose_weights for i in set(mine)]
        return least([worth(one, scene.goal_weights, floors(scene)) for one in left])
    goals = zetas(every) @ scene.pose_weights
    if scene.over_poses == "worst":
        penalty = worth(goals, scene.goal_weights, floors(scene)) - goals @ scene.goal_weights
        return least(scene.goal_weights @ zetas(every)) + penalty
    return float(worth(goals, scene.goal_weights, floors(scene)))


FLOORS = (Shell(0.5, weight=2.0, at_least_percent=30), ReachSphere(at_least_percent=60))
CASES = {
    "floors": (Criterion(), {"occlusion": "ignore", "obstacles": (), "targets": FLOORS}),
    "seen by two, an obstacle": (Criterion(seen=2), {"occlusion": "ignore"}),
    "a ring lost, shadows": (Criterion(losing="ring"), {"occlusion": "shadow", "obstacles": ()}),
    "a sensor lost, shadows": (Criterion(losing="sensor"), {"occlusion": "shadow"}),
    "worst pose, blind": (Criterion(), {"occlusion": "blind", "over_poses": "worst"}),
}
RETURNS = {"occlusion": "returns"}
# all report three targets, so that JAX compiles once
SEVERAL = st.builds(reporting, st.integers(10, 50), RANGES_MM, st.just(3), st.integers(1, 300))
THREE_SEVERAL = st.lists(SEVERAL, min_size=3, max_size=3)
# all sensors of their rings are evaluated
WIDE = st.lists(FANS | NARROW, min_size=2, max_size=2).flatmap(
    lambda two: FANS.map(lambda first: [first, *two])
)


def check_sharp(scene, soft, setup, aim, rng, blind=0.0):
    arrays, values = arrays_of(scene, setup)
    terms = terms_of(scene, setup, aim)
    points = points_of(terms, rng)
    found = soft.share(arrays, values, SHARP, Sample(points.astype(np.float32)))
    ring = np.array(scene.with_cell(setup).ring_of_sensor)
    low, high = (
        counted(scene, setup, aim, held) for held in seen(terms, points, ring, soft.near(arrays))
    )
    off = blind + 1e-5 * (1 + abs(low))
    assert low - off <= found <= high + off


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
@settings(max_examples=4)
@given(st.integers(0, 1), setups(st.lists(NARROW, min_size=3, max_size=3), 12), GENERATORS)
def test_a_sharp_value_is_the_criterion_by_counting(case, number, setup, rng):
    """Exactly, where nothing occludes, or no more sensors of a ring have a point in their beams
    than are evaluated. The distance of a first return is found to less than a millimetre."""
    aim, fields = CASES[case]
    scene, soft = soft_of(number, aim, **fields)
    check_sharp(scene, soft, setup, aim, rng, 0.001 if scene.occlusion == "blind" else 0.0)


@pytest.mark.slow
@settings(max_examples=4)
@given(st.integers(0, 1), setups(THREE_SEVERAL, 12), GENERATORS)
def test_a_sharp_value_counts_what_sensors_of_several_targets_report(number, setup, rng):
    scene, soft = soft_of(number, Criterion(), **RETURNS)
    check_sharp(scene, soft, setup, Criterion(), rng, 0.001)


@pytest.mark.slow
@settings(max_examples=4)
@given(st.integers(0, 1), setups(WIDE, 4), GENERATORS)
def test_errors_of_mounting_move_beams_and_shadows(number, setup, rng):
    """All but those of the cell."""
    scene, soft = soft_of(number, ERRORS, occlusion="shadow")
    check_sharp(scene, soft, setup, ERRORS, rng)


SLOPES = {
    "floors": CASES["floors"],
    "worst pose, blind": CASES["worst pose, blind"],
    "errors, shadows": (ERRORS, {"occlusion": "shadow"}),
}


@pytest.mark.slow
@pytest.mark.parametrize("case", SLOPES)
@settings(max_examples=2)
@given(setups(st.lists(NARROW, min_size=3, max_size=3), 12), GENERATORS)
def test_slopes_are_central_differences(case, setup, rng):
    """In 32 bit: rounding by 1e-7 shows in short steps, and a slope that bends in long ones, so the
    best of several steps counts. Where sensors are hidden or err, the next one of a ring may
    replace a nearest one with a jump, which wide sigmoids show; the median of several directions
    is free of it."""
    check_slopes(setup, rng, *SLOPES[case])


@pytest.mark.slow
@settings(max_examples=2)
@given(setups(THREE_SEVERAL, 12), GENERATORS)
def test_slopes_of_several_targets_are_central_differences(setup, rng):
    check_slopes(setup, rng, Criterion(), RETURNS)


def check_slopes(setup, rng, aim, fields):
    scene, soft = soft_of(0, aim, **fields)
    arrays, values = arrays_of(scene, setup)
    sample = Sample(points_of(terms_of(scene, setup, aim), rng).astype(np.float32))
    off = []
    value, slope = soft.value_and_slope(arrays, values, 0.01, sample)
    assert value == pytest.approx(
        soft.share(arrays, values, 0.01, sample), abs=1e-5 * (1 + abs(value))
    )
    for _ in range(5):
        d = rng.normal(size=values.shape)
        d /= np.linalg.norm(d)
        each = []
        for step in (3e-3, 1e-3, 3e-4, 1e-4):
            up, down = (soft.share(arrays, values + s * d, 0.01, sample) for s in (step, -step))
            each.append(abs((slope * d).sum() - (up - down) / (2 * step)) / (1 + abs(value)))
        off.append(min(each))
    assert np.median(off) < 3e-3


BARE = {"occlusion": "ignore", "obstacles": ()}
NEEDLES = st.builds(beam, st.tuples(st.integers(3, 20), st.just(0)), RANGES_MM, st.just(0))
THREE_NEEDLES = st.lists(NEEDLES, min_size=3, max_size=3)


@pytest.fixture(scope="module")
def bare() -> tuple[Scene, SoftCoverage, np.ndarray]:
    """A scene in which nothing occludes, its soft coverage, and the points of two poses."""
    scene = scene_of(1, **BARE, targets=(Shell(0.5),))
    points = np.random.default_rng(0).uniform(-0.8, 0.8, (2, 1000, 3))
    return scene, SoftCoverage(scene, [(0, 0), (0, 1)], list(points)), points


@pytest.mark.slow
@settings(max_examples=8)
@given(setups(THREE_NEEDLES, 12), st.sampled_from([0.01, 0.005]))
def test_the_mean_is_the_definition(bare, setup, width):
    """1 - prod(1 - sigmoid(-f / width)) of all sensors in NumPy; less what sensors beyond the two
    that have a point deepest add, or beyond the nearest two where a point is just past a base."""
    scene, soft, points = bare
    found = float(soft.mean(*arrays_of(scene, setup), width))
    ring, wanted, beyond = np.array(scene.with_cell(setup).ring_of_sensor), [], []
    for pose, here in zip(scene.poses, points, strict=True):
        cones = sensor_cones(scene.robot, scene.with_cell(setup), pose.q)
        f = np.stack([cones.part(here, k) for k in range(len(cones))])
        p = 1 / (1 + np.exp(np.minimum(f / width, 700)))
        wanted.append((1 - np.prod(1 - p, axis=0)).mean())
        rings = [np.sort(p[ring == i], axis=0)[:-2] for i in set(ring.tolist())]
        beyond.append(sum(some.sum(axis=0) for some in rings).mean())
    weights = scene.pose_weights
    assert weights @ wanted - weights @ beyond - 2e-3 <= found <= weights @ wanted + 1e-5


@pytest.mark.slow
@settings(max_examples=3)
@given(setups(THREE_NEEDLES, 12), st.sampled_from([0.02, 0.01]), GENERATORS)
def test_the_undecided_points_stand_for_all(bare, setup, width, rng):
    """Exactly at the start. What moves the points left out by up to 3 mm changes a degree as small
    as theirs by its own size."""
    scene, soft, _ = bare
    arrays, values = arrays_of(scene, setup)
    few = soft.undecided(arrays, values, width, 0, 500)
    assert few.points.shape == (2, 500, 3)
    assert soft.share(arrays, values, width, few) == pytest.approx(
        soft.share(arrays, values, width), abs=1e-5
    )
    move = rng.uniform(-0.002, 0.002, values.shape)
    assert soft.share(arrays, values + move, width, few) == pytest.approx(
        soft.share(arrays, values + move, width), abs=5e-4
    )


@pytest.mark.slow
def test_points_in_pieces_give_the_same(bare, monkeypatch):
    scene, soft, _ = bare
    arrays, values = arrays_of(scene, named_setup("n1_4_25"))
    value, slope = soft.value_and_slope(arrays, values, 0.05)
    pairs = soft.all.points[..., 0].size * len(arrays.length) * soft.near(arrays)
    monkeypatch.setattr(soft_coverage, "AT_ONCE", pairs // 6)
    *_, last = soft._pieces(arrays, values, 0.05, soft.all)
    assert (last.share == 0).any()  # points that only fill the last piece
    again, by = soft.value_and_slope(arrays, values, 0.05)
    assert again == pytest.approx(value, abs=1e-6)
    np.testing.assert_allclose(by, slope, atol=1e-5)
