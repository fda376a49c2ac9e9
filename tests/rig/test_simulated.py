"""The simulated rig: its temporary folders, and mount checks in simulated time, with delays as they
come on a busy machine.
"""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.rig.mount.fit import fit_mount
from place_rings.rig.mount.fit_record import truth_of
from place_rings.rig.sensing.readings import at_stops
from place_rings.rig.simulated.process import PREFIX, RunFolder, sweep
from place_rings.rig.simulated_cell.ground_truth import injected
from place_rings.rig.simulated_cell.simulated_time import BUSY, Lateness, Pace, mount_check
from place_rings.rig.simulated_cell.world import World
from place_rings.simulation.twin.noise import Noise
from scipy import stats

from ..support.drawing import seeds
from .cell import SCENE, SETUP


def read(world, plan, rng, lateness=BUSY, pace=None):
    """The readings that count at the stops of a check."""
    readings = mount_check(world, plan.joints, plan.frames, rng, lateness, pace)
    return at_stops(readings, SETUP, plan.joints)


def judged(seed, plan):
    """Whether each ring's region and each value's interval hold what was injected."""
    rng, done = np.random.default_rng((seed, 9)), injected(SCENE, SETUP, seed)
    fits = fit_mount(SCENE, SETUP, read(done.world(SCENE), plan, rng))
    truth = [truth_of(f, e) for f, e in zip(fits, done.errors, strict=True)]
    each = [np.abs(f.values - t) <= f.margins() for f, t in zip(fits, truth, strict=True)]
    return [f.holds(t) for f, t in zip(fits, truth, strict=True)], np.concatenate(each).tolist()


@pytest.mark.slow
def test_margins_hold_as_often_as_they_say_although_frames_come_late(stops):
    held = [judged(seed, stops) for seed in range(2)]
    for hits in (
        [ok for rings, _ in held for ok in rings],
        [ok for _, each in held for ok in each],
    ):
        assert stats.binomtest(sum(hits), len(hits), 0.95, "less").pvalue > 0.01


@pytest.mark.slow
@settings(max_examples=2)
@given(seeds, st.floats(0, 1), st.sampled_from([1.0, 100.0]))
def test_no_reading_of_a_stop_was_measured_anywhere_else(stops, seed, longest, patience):
    """Whatever the delays and the time limits are."""
    lateness = Lateness(BUSY.share, tuple(s * (1 + 2 * longest) for s in BUSY.seconds))
    world = World(SCENE, SETUP, noise=Noise(0.0, 0.0, 0.0, 0.0))
    found = read(world, stops, np.random.default_rng(seed), lateness, Pace(patience=patience))
    wanted, there = world.distances(stops.joints), found.total > 0
    assert there.mean() > 0.5
    np.testing.assert_allclose(
        np.where(there, found.distance, 0.0),
        np.where(there & np.isfinite(wanted), wanted, np.where(there, np.nan, 0.0)),
        atol=5.1e-4,  # of frames in millimetres
    )
    np.testing.assert_allclose(found.spread[found.valid > 1], 0.0, atol=1e-6)


@settings(max_examples=8)
@given(seeds, st.sampled_from([0.008, 0.04, 0.5]))
def test_delays_have_the_measured_distribution(seed, step):
    drawn = [BUSY.drawn(np.random.default_rng((seed, i)), 50, step) for i in range(200)]
    for share, s in zip(BUSY.share[1:-1], BUSY.seconds[1:-1], strict=True):
        assert np.mean([d[-1] <= s for d in drawn]) == pytest.approx(share, abs=0.15)
    assert np.max(drawn) <= BUSY.seconds[-1]


def test_the_same_seed_gives_the_same_check(stops):
    done, same, other = (injected(SCENE, SETUP, seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(done.errors, same.errors)
    assert (done.errors != other.errors).any()
    assert done.alive.sum() == SETUP.sensors - 1
    assert injected(SCENE, Setup((Ring("tool", 0.0, 3),)), 0).pair == ()
    world = done.world(SCENE)
    few = replace(stops, stops=stops.stops[:3])
    a, b = (read(world, few, np.random.default_rng(4)) for _ in range(2))
    np.testing.assert_array_equal(a.distance, b.distance)


HOLD = """
import sys
from place_rings.rig.simulated.process import RunFolder
folder = RunFolder()
print(folder.path, flush=True)
sys.stdin.read()
"""


@pytest.fixture
def place(tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    return tmp_path


def held():
    """A process that holds a folder, and the folder."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    return process, Path(process.stdout.readline().strip())


def end(process):
    process.kill()
    process.communicate()


def test_a_folder_goes_with_its_run(place):
    folder = RunFolder()
    (folder.path / "ring0").touch()
    assert sweep() == []
    assert [p.name.startswith(PREFIX) for p in place.iterdir()] == [True]
    folder.close()
    assert list(place.iterdir()) == []


def test_folders_of_killed_runs_are_swept_and_those_of_living_ones_are_not(place):
    (alive, one), (dead, other) = held(), held()
    (other / "inside").mkdir()
    end(dead)
    folder = RunFolder()  # the next start
    assert one.exists()
    assert not other.exists()
    end(alive)
    assert sweep() == [one]
    folder.close()


def test_what_is_not_ours_stays(place):
    (place / f"{PREFIX}without-lock").mkdir()
    elsewhere = place / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "lock").touch()
    (place / f"{PREFIX}link").symlink_to(elsewhere)
    trap = place / f"{PREFIX}trap"
    trap.mkdir()
    (trap / "lock").symlink_to(elsewhere / "lock")
    (place / f"{PREFIX}file").touch()
    mine = place / f"{PREFIX}my-results"
    mine.mkdir()
    (mine / "lock").write_text("my own")
    before = sorted(place.rglob("*"))
    assert sweep() == []
    assert sorted(place.rglob("*")) == before
    assert os.path.exists(elsewhere / "lock")
