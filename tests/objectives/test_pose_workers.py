"""Poses divided among processes: the same records, and no process outlives the one that asked."""

import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import psutil
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.definitions.errors import InputError
from place_rings.coverage.targets.named import ReachSphere, Shell
from place_rings.objectives.occlusion import unseeing
from place_rings.objectives.pose_workers import PoseWorkers, each_pose
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import Verifier
from place_rings.objectives.verify_breakdown import by_occlusion
from place_rings.objectives.verify_targets import verify_targets

from ..strategies.rings import poses, setups

TARGETS = (Shell(0.5), ReachSphere())
# prints its processes' numbers, then goes on counting
COUNTING = """
import os, signal, time
from place_rings.objectives.pose_workers import PoseWorkers, each_pose
def number(pose):
    time.sleep(0.1)
    return os.getpid()
if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell may have it ignored
    with PoseWorkers(2):
        print(*set(each_pose(number, 2)), flush=True)
        each_pose(number, 10_000)
"""


@pytest.fixture(scope="module", autouse=True)
def found():
    """Let processes find functions of this file."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(Path(__file__).parents[2])
        yield


@pytest.fixture(scope="module")
def two(found):
    with PoseWorkers(2) as workers:
        yield workers


def results(scene, setup):
    verifier = Verifier(scene, 0.1)
    each = verify_targets(verifier, setup, TARGETS)
    each += by_occlusion(verifier, setup, each[0]).values()
    each.append(verifier.at_centres().verify(setup, TARGETS[0]))
    return [replace(v, seconds=0.0) for v in each], unseeing(scene, setup)


@settings(max_examples=5)
@given(
    st.lists(poses(), min_size=1, max_size=11),
    setups(),
    st.sampled_from(["ignore", "shadow", "blind"]),
)
def test_divided_poses_have_the_records_of_one_process(two, angles, setup, occlusion):
    scene = replace(Scene.paper(), poses=tuple(map(Pose, angles)), occlusion=occlusion)
    with PoseWorkers(1):
        alone = results(scene, setup)
    assert results(scene, setup) == alone


def process(_: int) -> int:
    return os.getpid()


def test_a_pose_stays_with_its_process(two):
    first, again = (each_pose(process, 11) for _ in range(2))
    assert first == again
    assert len(set(first)) == 2
    assert os.getpid() not in first
    with PoseWorkers(1):
        assert set(each_pose(process, 3)) == {os.getpid()}
    assert each_pose(process, 11) == first


def test_a_process_that_ends_is_named():
    with PoseWorkers(2):
        first = each_pose(process, 2)
        os.kill(first[1], signal.SIGTERM)
        with pytest.raises(InputError) as caught:
            each_pose(process, 10)
        assert not set(each_pose(process, 10)) & set(first)  # new ones
    assert caught.value.argument == "workers"


def refuse(pose: int) -> int:
    if pose == 6:
        raise ValueError(pose)
    return pose


class OddError(Exception):
    """Cannot be pickled, as it holds a function of its own."""

    def __init__(self):
        super().__init__(lambda: None)


def odd(pose: int) -> int:
    raise OddError


def full(pose: int) -> None:
    raise OSError(28, "no space left")


def test_what_cannot_be_sent_is_computed_here(two):
    assert each_pose(lambda pose: pose + 1, 11) == tuple(range(1, 12))
    with pytest.raises(OddError):
        each_pose(odd, 11)


def test_an_error_at_a_pose_is_the_callers(two):
    with pytest.raises(OSError, match="space"):
        each_pose(abs, 11, full)
    with pytest.raises(OSError, match="space"):
        each_pose(full, 11)
    with pytest.raises(ValueError, match="6"):
        each_pose(refuse, 11)
    seen = list[int]()
    assert each_pose(abs, 11, seen.append) == tuple(range(11))
    assert sorted(seen) == list(range(11))


@pytest.fixture
def few_files():
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (len(os.listdir("/proc/self/fd")) + 8, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_NOFILE, before)


@pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="counts open files by /proc")
def test_processes_that_cannot_be_started_are_named(few_files):
    with PoseWorkers(40), pytest.raises(InputError) as caught:
        each_pose(abs, 40)
    assert caught.value.argument == "workers"


def running(number: int) -> bool:
    try:
        return psutil.Process(number).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize("sign", [signal.SIGKILL, signal.SIGINT])
def test_processes_end_with_the_one_that_started_them(tmp_path, sign):
    file = tmp_path / "counting.py"
    file.write_text(COUNTING)
    run = subprocess.Popen(
        [sys.executable, file], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    try:
        assert run.stdout is not None
        numbers = [int(word) for word in run.stdout.readline().split()]
        assert len(numbers) == 2
        assert all(map(running, numbers))
        run.send_signal(sign)
        run.communicate(timeout=60)
    finally:
        run.kill()
    until = time.monotonic() + 60
    while any(map(running, numbers)) and time.monotonic() < until:
        time.sleep(0.05)
    assert not any(map(running, numbers))
