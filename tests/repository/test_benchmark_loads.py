"""Measurements on a quiet machine and beside busy processes stand side by side, and the busy
processes end with the benchmark.
"""

import importlib
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

BENCHMARKS = str(Path(__file__).parents[2] / "benchmarks")


@pytest.fixture(scope="module")
def benchmarks():
    sys.path.insert(0, BENCHMARKS)
    try:
        yield importlib.import_module
    finally:
        sys.path.remove(BENCHMARKS)


def spinning(process):
    return [c for c in process.children(recursive=True) if "getppid" in " ".join(c.cmdline())]


def fail_once_they_spin(process, count):
    until = time.monotonic() + 60
    while len(spinning(process)) != count:  # one that has just begun shows no command yet
        assert time.monotonic() < until
        time.sleep(0.01)
    raise ZeroDivisionError


def test_busy_processes_are_started_and_stopped_even_by_an_error(benchmarks):
    loads, me = benchmarks("loads"), psutil.Process()
    with pytest.raises(ZeroDivisionError), loads.busy(2):
        fail_once_they_spin(me, 2)
    assert spinning(me) == []


def test_busy_processes_end_with_a_benchmark_that_is_killed(benchmarks):
    code = (
        f"import sys, time; sys.path.insert(0, {str(BENCHMARKS)!r}); import loads\n"
        "with loads.busy(1): print('on', flush=True); time.sleep(99)"
    )
    command = [sys.executable, "-c", code]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "on\n"
        (child,) = psutil.Process(process.pid).children()
        process.kill()
    until = time.monotonic() + 60
    while child.is_running() and child.status() != psutil.STATUS_ZOMBIE:
        assert time.monotonic() < until
        time.sleep(0.05)


def test_figures_of_both_loads_stand_side_by_side_if_the_same_code_made_them(
    benchmarks, tmp_path, monkeypatch
):
    loads, rig = benchmarks("loads"), benchmarks("rig")
    monkeypatch.chdir(tmp_path)

    def figures(ms):
        row = ["a fault", "1", "seen (1)", ms, ms, "80", "", "0"]
        return {"rows": [row], "closing": 0.1, "again": 0, "speed": [["d", ms, "", ""]]}

    quiet, beside = loads.measured("rig 1", "old", 0, lambda: figures("70"))
    assert beside is None
    text = "\n".join(rig.page(1, quiet, beside))
    assert "| a fault | 1 | seen (1) | 70 | 70 | 80 |  | 0 |" in text
    assert "beside busy processes: not measured yet" in text
    both = loads.measured("rig 1", "old", 1, lambda: figures("90"))
    text = "\n".join(rig.page(1, *both))
    assert "| a fault | 1 / 1 | seen (1) | 70 / 90 | 70 / 90 | 80 |  | 0 / 0 |" in text
    for one in both:
        assert f"load average {one.before:.1f} before, {one.after:.1f} after" in text
    assert loads.measured("rig 1", "new", 1, lambda: figures("90"))[0] is None
