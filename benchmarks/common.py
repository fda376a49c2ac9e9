"""Common parts of the benchmarks: the cone task, timing, tables."""

import math
import statistics
import time
from collections.abc import Callable, Sequence
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np
from place_rings.coverage.solids.cones import Cones

CONES, HALF_ANGLE, RANGE, BALL = 112, math.radians(11), 1.0, 1.0


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


def medians(works: dict[str, Callable[[], Any]], runs: int) -> dict[str, tuple[Any, float]]:
    """Return the result and the median time in seconds of each function.

    Each runs several times in a row after a warm-up.
    """
    found: dict[str, tuple[Any, float]] = {}
    for name, work in works.items():
        result, seconds = work(), []
        for _ in range(runs):
            start = time.perf_counter()
            work()
            seconds.append(time.perf_counter() - start)
        found[name] = result, statistics.median(seconds)
    return found


def table(columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> list[str]:
    """Return a Markdown table."""
    lines = ["| " + " | ".join(columns) + " |", "| " + " | ".join("---" for _ in columns) + " |"]
    return lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]


def missing(peer: str) -> str:
    """Return the line for a peer that is not installed."""
    return f"{peer} is not installed (the `[bench]` extra): left out."


def installed(peer: str) -> bool:
    """Return whether a distribution is installed."""
    try:
        version(peer)
    except PackageNotFoundError:
        return False
    return True
