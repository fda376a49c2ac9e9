"""The minimum-distance study: what a good setup measures, what more sensors change, its table, and
the unseen approach.
"""

import math
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.occlusion.ranging import readings
from place_rings.coverage.rings.ring import Ring, Setup, named_setup, sensor_optics
from place_rings.coverage.rings.ring_kinematics import sensor_axes, sensor_cones
from place_rings.coverage.robots.built_in import UR10
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.link_bodies import robot_capsules
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.coverage.solids.capsules import gap_to_capsules
from place_rings.reporting import distance_figures
from place_rings.simulation import distance as study
from place_rings.simulation.approach import unseen_approaches
from place_rings.simulation.distance import (
    MODES,
    beliefs,
    cell,
    measures,
    repeated,
    series,
    summary,
)

from ..support import drawing

T = np.arange(0, 30, 0.2)


@pytest.fixture
def swing(reference_pose):
    """A smooth swing of the base about the reference pose."""
    q = np.tile(reference_pose, (len(T), 1))
    q[:, 0] = math.pi / 2 * np.sin(2 * np.pi * T / 6)
    return q


def dense() -> Setup:
    """Narrow beams in nearly all directions from seven places on each link."""
    sensor = Sensor(math.radians(4), 3.0)
    tilts = np.radians(np.arange(-80, 81, 4))
    rings = [
        Ring(link, position, 72, float(tilt), 0.0, 0.061, sensor)
        for link in ("upper_arm", "forearm")
        for position in (0.0, 0.25, 0.5, 0.75, 1.0)
        for tilt in tilts
    ]
    return Setup(
        (*rings, *(Ring("tool", 0.0, 72, float(tilt), 0.0, 0.061, sensor) for tilt in tilts))
    )


def test_a_dense_setup_measures_the_truth(reference_pose):
    """Where thin beams leave from all over the arm, what is believed tends to the truth, and is
    hardly ever far.
    """
    t, q = T[::15], np.tile(reference_pose, (len(T[::15]), 1))
    fine = series(UR10, dense(), t, q, "human", 3, "ignore")
    coarse = series(UR10, named_setup("n1_8_0"), t, q, "human", 3, "ignore")
    near = fine.true < 1.5
    assert near.any()
    assert fine.seen[near].all()
    error, worse = (np.sqrt(np.mean((s.believed - s.true)[near] ** 2)) for s in (fine, coarse))
    assert error < 0.04
    assert error < worse / 3


@settings(max_examples=6)
@given(st.integers(0, 1000))
def test_more_sensors_never_read_less(seed):
    """A setup that holds another's sensors reads at least what that reads, and its nearest reading
    is no farther.
    """
    t = T[::10]
    q = np.random.default_rng(seed).uniform(-math.pi, math.pi, (len(t), 6))
    frames = forward(UR10.chain, q)
    bodies = robot_capsules(UR10, frames)
    balls = study.thing_balls("human", seed, t, bodies)
    few, many = named_setup("n2_16_55"), named_setup("n3_16_55")
    found = []
    for setup in (few, many):
        axes = sensor_axes(UR10, setup, frames)
        optics = sensor_optics(setup)
        read = readings(*axes, *optics, *balls).distance
        found.append((read.min(axis=1), beliefs(*axes, optics[0], read, bodies)))
    assert np.all(found[1][0] <= found[0][0])
    assert np.all(found[1][1] <= found[0][1] + 1e-9)
    # the careful belief is the nearer one
    assert np.all(found[1][1][:, 1] <= found[1][1][:, 0] + 1e-9)


@pytest.mark.parametrize("thing", study.THINGS)
def test_shadows_only_raise_what_is_believed(swing, thing):
    setup = named_setup("n2_16_55")
    free, hidden = (series(UR10, setup, T, swing, thing, 1, mode) for mode in ("ignore", "shadow"))
    assert np.array_equal(free.true, hidden.true)
    assert np.all(hidden.believed >= free.believed)
    assert not np.any(hidden.seen & ~free.seen)


def test_table_of_one_run(swing):
    setup = named_setup("n2_16_25")
    table = cell(UR10, setup, T, swing, "human", 2, "ignore")
    assert table == cell(UR10, setup, T, swing, "human", 2, "ignore")
    run = series(UR10, setup, T, swing, "human", 2, "ignore")
    counts = run.true < 1.5
    error = (run.believed - run.true)[counts]
    assert table["rmse_m"] == pytest.approx(np.sqrt((error**2).mean()))
    assert table["max_error_m"] == pytest.approx(np.abs(error).max())
    assert table["near_s"] + table["far_s"] + table["beyond_s"] == pytest.approx(table["counted_s"])
    squares = sum(
        table[f"{z}_rmse_m"] ** 2 * table[f"{z}_s"]
        for z in ("near", "far", "beyond")
        if table[f"{z}_s"]
    )
    assert squares / table["counted_s"] == pytest.approx(table["rmse_m"] ** 2)
    assert table["unseen_longest_s"] <= table["unseen_s"] <= table["counted_s"]
    assert np.all(run.believed[~run.seen] == 1.5)
    none = measures(run._replace(true=np.full(len(T), 2.0)), 1.5)
    assert none["counted_s"] == 0
    assert none["rmse_m"] is None


def test_closing_speeds_add_up_to_the_way_closed(swing):
    """Over windows that follow each other the true closing speed sums to the change of distance;
    the unseen is still.
    """
    t = np.arange(0, 30, 0.1)
    still = np.tile(swing[0], (len(t), 1))
    run = series(UR10, named_setup("n1_8_0"), t, still, "human", 5, "ignore")
    frames = forward(UR10.chain, still)
    centre, radius = study.thing_balls("human", 5, t, robot_capsules(UR10, frames))
    back = round(study.WINDOW / 0.1)
    for i, end in enumerate((np.zeros(3), frames[0, -1, :3, 3])):
        distance = (np.linalg.norm(centre - end, axis=2) - radius).min(axis=1)
        closed = run.true_speed[back::back, i].sum() * back * 0.1
        last = (len(t) - 1) // back * back
        assert closed == pytest.approx(distance[0] - distance[last], abs=1e-9)
    assert np.all(run.believed_speed[~run.seen] == 0)
    assert np.abs(run.believed_speed).max() > 0


def test_names_are_checked(swing):
    setup = named_setup("n1_8_0")
    with pytest.raises(ValueError, match="dog"):
        series(UR10, setup, T, swing, "dog", 0, "ignore")
    with pytest.raises(ValueError, match="blind"):
        series(UR10, setup, T, swing, "rod", 0, "blind")


def test_summary_is_the_t_interval():
    mean, half = summary([{"a": v} for v in (1.0, 2.0, 3.0, 4.0)])["a"]
    assert mean == 2.5
    assert half == pytest.approx(3.182446 * np.std([1, 2, 3, 4], ddof=1) / 2, rel=1e-6)
    mean, half = summary([{"a": 1.0}, {"a": None}])["a"]
    assert mean == 1.0
    assert math.isnan(half)


def test_a_cycle_is_repeated(swing):
    time, q = repeated(T[:30], swing[:30], 20.0)
    assert time[-1] == pytest.approx(20.0)
    assert np.array_equal(q[30:60], q[:30])


@pytest.fixture(scope="module")
def approaches():
    """Unseen approaches of two balls to a robot with a named setup, each found once."""
    pose = np.radians([0.0, -45, 60, -105, -90, 0])
    return cache(lambda name: unseen_approaches(UR10, named_setup(name), pose, (0.05, 0.1), 0.06))


@pytest.mark.parametrize("name", ["n1_8_0", "n2_16_55"])
def test_approach_is_truly_unseen(name, approaches, reference_pose):
    """No point of the ball, sampled all over it all along the path, lies in a cone; it comes from
    outside; it ends clear.
    """
    cones = sensor_cones(UR10, named_setup(name), reference_pose)
    bodies = robot_capsules(UR10, forward(UR10.chain, reference_pose))
    rng = np.random.default_rng(0)
    for found in approaches(name):
        shares = np.linspace(0, 1, 60)[:, None]
        legs = zip(found.path[:-1], found.path[1:], strict=True)
        centres = np.concatenate([a + shares * (b - a) for a, b in legs])
        ball = found.radius * drawing.unit(rng, 100) * rng.uniform(0, 1, (100, 1)) ** (1 / 3)
        surface = found.radius * drawing.unit(rng, 100)
        points = (centres[:, None] + np.concatenate([ball, surface])).reshape(-1, 3)
        assert cones(points).min() > 0
        gap = gap_to_capsules(centres, bodies.start, bodies.end, bodies.radius)
        assert gap.min() >= found.radius - 1e-6
        arm = [b.frame > 0 for b in UR10.bodies]
        end = gap_to_capsules(
            found.path[-1], bodies.start[arm], bodies.end[arm], bodies.radius[arm]
        )
        assert end - found.radius == pytest.approx(found.gap_m, abs=1e-6)
        lower, upper = cones.bounds()
        assert np.any(
            (found.path[0] < lower - found.radius) | (found.path[0] > upper + found.radius)
        )


def test_larger_balls_stay_farther_off(approaches, reference_pose):
    small, large = approaches("n2_16_55")
    assert small.gap_m + small.radius <= large.gap_m + large.radius
    with pytest.raises(ValueError, match=r"0\.0"):
        unseen_approaches(UR10, named_setup("n1_8_0"), reference_pose, (0.0,))


def test_figure_is_drawn(swing, tmp_path):
    setups = {name: named_setup(name) for name in ("n1_8_0", "n2_16_55")}
    results = {
        (name, mode, "human"): [cell(UR10, s, T[:8], swing[:8], "human", k, mode) for k in (0, 1)]
        for name, s in setups.items()
        for mode in MODES
    }
    distance_figures.errors(results, tmp_path / "errors.png")
    assert (tmp_path / "errors.png").stat().st_size > 10_000
