"""Common parts of the benchmarks: the cone task, timing, processes, tables."""

import math
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, version
from multiprocessing import get_context
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import numpy as np
from place_rings.coverage.solids.cones import Cones
from place_rings.reporting import pages

CONES, HALF_ANGLE, RANGE, BALL = 112, math.radians(11), 1.0, 1.0
_LONGEST = 10.0  # s, after which a function is not run again
# ends with the benchmark, even if that is killed
_SPIN = "import os\nwhile os.getppid() == {}:\n    for _ in range(10**6): pass"


def cone_task() -> Cones:
    """Return cones spread over a sphere of 1.6 m by the golden angle, each aimed near its
    centre.
    """
    rng = np.random.default_rng(0)
    i = np.arange(CONES)
    z = 1 - (2 * i + 1) / CONES
    azimuth, r = i * math.pi * (3 - math.sqrt(5)), np.sqrt(1 - z * z)
    apex = 1.6 * np.column_stack([r * np.cos(azimuth), r * np.sin(azimuth), z])
    aim = -apex / np.linalg.norm(apex, axis=1, keepdims=True) + 0.15 * rng.normal(size=(CONES, 3))
    axis = aim / np.linalg.norm(aim, axis=1, keepdims=True)
    return Cones(apex, axis, np.full(CONES, HALF_ANGLE), np.full(CONES, RANGE))


def medians(works: dict[str, Callable[[], Any]], runs: int = 5) -> dict[str, tuple[Any, float]]:
    """Return the result and the median time in seconds of each function.

    The functions run alternately, so that other work on the machine affects all of them. The first
    run of each only counts if it takes longer than 10 s; after 10 s in all a function rests.
    """
    results, seconds = dict[str, Any](), dict[str, list[float]]()
    for name, work in works.items():
        start = time.perf_counter()
        results[name] = work()
        took = time.perf_counter() - start
        seconds[name] = [took] if took > _LONGEST else []
    for _ in range(runs):
        for name, work in works.items():
            if sum(seconds[name]) < _LONGEST:
                start = time.perf_counter()
                work()
                seconds[name].append(time.perf_counter() - start)
    return {name: (results[name], statistics.median(seconds[name])) for name in works}


def exponent(sizes: Sequence[float], values: Sequence[float]) -> float:
    """Return the slope of a straight line through the logarithms."""
    return float(np.polyfit(np.log(sizes), np.log(values), 1)[0])


def peak_memory() -> float:
    """Return the peak resident memory of this process, MB (Linux)."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) / 1024


def own_process(work: Callable[..., Any], *arguments: Any) -> Any:
    """Return the result of a function in a new process, so that imports and memory are its own."""
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        return pool.submit(work, *arguments).result()


def on_each_core(tasks: Sequence[tuple[Any, ...]]) -> list[Any]:
    """Return the results of tasks, each a function and its arguments, in their order.

    Tasks run in one thread for each core; processes that a task starts stay on its core. Results
    are printed as they come.
    """
    free = SimpleQueue[int]()
    cores = sorted(os.sched_getaffinity(0))
    for core in cores:
        free.put(core)

    def told(task: tuple[Any, ...]) -> Any:
        work, *arguments = task
        result = work(*arguments)
        parts = (part for part in arguments if not callable(part))
        say(*(getattr(part, "name", part) for part in parts), result)
        return result

    with ThreadPoolExecutor(
        len(cores), initializer=lambda: os.sched_setaffinity(0, {free.get()})
    ) as threads:
        return list(threads.map(told, tasks))


@contextmanager
def busy(count: int) -> Iterator[None]:
    """Keep the machine busy with ``count`` processes in this context."""
    words = [sys.executable, "-c", _SPIN.format(os.getpid())]
    spinning = [subprocess.Popen(words) for _ in range(count)]
    try:
        yield
    finally:
        for process in spinning:
            process.kill()
            process.wait()


def say(*cells: Any) -> None:
    """Print a line of progress at once."""
    print(*cells, sep=" | ", flush=True)


def table(heads: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """Return a Markdown table."""
    return pages.table(heads, [[str(cell) for cell in row] for row in rows]).rstrip()


def installed(peer: str) -> bool:
    """Return whether a distribution is installed."""
    try:
        version(peer)
    except PackageNotFoundError:
        return False
    return True


def absent(peer: str, columns: int) -> list[str]:
    """Return the row of a table for a peer that is not installed."""
    return [f"{peer}: not installed (extra `bench`)", *["-"] * (columns - 1)]
