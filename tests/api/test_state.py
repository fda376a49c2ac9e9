"""What the front door keeps: nothing stale, nothing that others change; and results that travel."""

from concurrent.futures import ThreadPoolExecutor
from multiprocessing.reduction import ForkingPickler

import jax
import jax.numpy as jnp
import numpy as np
import place_rings as pr
import pytest
from place_rings import _soft

NEAR = pr.Scene(targets=[pr.Shell(0.5)])
PAPER = pr.Scene.paper(targets=[pr.Shell(0.5)])  # compiles in an eighth of the time
SETUP = pr.Setup.named("n1_4_25")


@pytest.fixture
def nothing_kept():
    _soft._prepared.clear()


def test_points_that_changed_in_place_are_counted_anew():
    points = pr.sample_points(PAPER, 64).points[0].copy()
    before = float(pr.coverage_fraction(SETUP, PAPER, points, 0.01))
    points += 100.0  # out of every beam's reach
    assert before > 0.05
    assert float(pr.coverage_fraction(SETUP, PAPER, points, 0.01)) == pytest.approx(0, abs=1e-6)


def test_a_file_that_was_written_anew_is_read_anew(tmp_path):
    points, file = pr.sample_points(PAPER, 64), tmp_path / "proposal.toml"
    for name in ("n1_4_25", "n1_4_-25"):
        placed = pr.Setup.named(name)
        pr.Proposal(placed, PAPER).save(file)
        for one in (file, str(file)):
            again = pr.coverage_fraction(one, PAPER, points, 0.01)
            assert float(again) == pytest.approx(
                float(pr.coverage_fraction(placed, PAPER, points, 0.01)), abs=1e-4
            )


def test_equal_arrays_share_what_is_compiled(nothing_kept):
    points = pr.sample_points(PAPER, 64).points[0]
    pr.coverage_fraction(SETUP, PAPER, points)
    pr.coverage_fraction(pr.Setup.named("n1_4_25"), PAPER, jnp.asarray(points, float))
    assert len(_soft._prepared) == 1


def test_threads_share_what_is_compiled(monkeypatch, nothing_kept):
    monkeypatch.setattr(_soft, "_KEPT", 2)
    setups = [pr.Setup.named(f"n1_{count}_0") for count in range(1, 5)]
    points = pr.sample_points(PAPER, 16)
    ready = {setup: _soft._prepare(setup, PAPER, points, None).values for setup in setups}

    def prepare(i):
        setup = setups[i % len(setups)]
        return np.array_equal(_soft._prepare(setup, PAPER, points, None).values, ready[setup])

    with ThreadPoolExecutor(8) as pool:
        assert all(pool.map(prepare, range(400)))
    assert len(_soft._prepared) == 2


def test_the_first_call_may_be_traced(nothing_kept):
    points = pr.sample_points(PAPER, 64)

    def value(values):
        return pr.coverage_fraction(SETUP, PAPER, points, values=values)

    traced = float(jax.jit(value)(jnp.asarray(SETUP.values)))
    assert float(value(SETUP.values)) == pytest.approx(traced, abs=1e-6)


def test_values_that_are_not_finite_give_nan():
    points = pr.sample_points(PAPER, 64)

    def value(values, width=0.02):
        return pr.coverage_fraction(SETUP, PAPER, points, width, values=values)

    jitted, slope = jax.jit(value), jax.grad(value)
    for bad in (np.nan, np.inf):
        values = jnp.asarray(SETUP.values).at[0, 0].set(bad)
        assert np.isnan(value(values))
        assert np.isnan(jitted(values))
        assert np.isnan(slope(values)).any()
    assert np.isnan(jitted(jnp.asarray(SETUP.values), 0.0))


@pytest.mark.parametrize("width", [0, -1, np.nan, np.inf, jnp.array(0.0), jnp.array(-1.0), "a"])
def test_a_width_that_is_none_is_refused(width):
    with pytest.raises(pr.InputError, match="width: "):
        pr.coverage_fraction(SETUP, NEAR, pr.sample_points(NEAR, 16), width)


def test_the_arrays_that_made_a_scene_may_change():
    q, times, motion = np.zeros((1, 6)), np.array([0.0, 1.0]), np.zeros((2, 6))
    pose = pr.Pose(np.zeros(6), rate=np.zeros(6))
    record = pr.Trajectory(times, motion)
    scenes = [pr.Scene(poses=q), pr.Scene(poses=[pose]), pr.Scene(poses=record), NEAR]
    scenes.append(NEAR.replace(poses=q))
    before = [scene.poses[0].q.copy() for scene in scenes]
    for array in (q, motion, pose.q, pose.rate):
        array += 1
    times[0] = 5
    for scene, was in zip(scenes, before, strict=True):
        np.testing.assert_array_equal(scene.poses[0].q, was)
        with pytest.raises(ValueError, match="read-only"):
            scene.poses[0].q[0] = 1
    assert not scenes[1].poses[0].rate.any()
    assert record.seconds == 1


RESULTS = {
    "counted": lambda: pr.verify("n1_4_0", NEAR, voxel=0.05, progress=lambda pose: None),
    "proved": lambda: pr.certify("n1_4_0", NEAR, width=20, progress=lambda bracket: None),
    "robust": lambda: pr.robustness("n1_4_0", NEAR, draws=1, voxel=0.1, k=1),
    "searched": lambda: pr.search(PAPER, sensors=6, voxel=0.1, time=1),
    "scene": lambda: pr.Scene(obstacles=pr.Obstacle(size=[1, 1, 1], centre=[1, 0, 0])),
    "motion": lambda: pr.Trajectory([0, 1], np.zeros((2, 6))),
    "setup": lambda: pr.Setup.named("n1_4_0", pr.sensors["vl53l5cx"]),
    "robot": lambda: pr.robots["panda"],
    "points": lambda: pr.sample_points(NEAR, 16),
}


@pytest.mark.parametrize("kind", RESULTS)
def test_results_travel_to_another_process_and_back(kind):
    result = RESULTS[kind]()
    again = ForkingPickler.loads(ForkingPickler.dumps(result))
    assert repr(again) == repr(result) or kind == "points"
    if kind == "counted":
        assert again.coverage == result.coverage
        assert pr.verify(again, voxel=0.05).coverage == result.coverage
        assert again.verifier._targets == {}
        assert result.verifier._targets != {}
    if kind == "searched":
        assert again.search_file([], {}, {}).proposal.rings == result.file().rings


def test_errors_travel_whole():
    with pytest.raises(pr.InputError) as caught:
        pr.Scene(robot="ur9")
    again = ForkingPickler.loads(ForkingPickler.dumps(caught.value))
    assert (str(again), again.argument) == (str(caught.value), "Scene: robot")
    with pytest.raises(pr.InfeasibleError) as infeasible:
        pr.search(NEAR, sensors=1)
    again = ForkingPickler.loads(ForkingPickler.dumps(infeasible.value))
    assert str(again) == str(infeasible.value)
