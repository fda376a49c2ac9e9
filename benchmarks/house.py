"""Structure of the source tree, installed size, and cost of the public soft coverage

Levels are the longest chains of imports inside a room. The installed size is that of the files of
place-rings and of all distributions that it needs without an extra. The last figure is the ratio of
processor seconds of ``pr.coverage_fraction`` under ``jax.jit`` to those of the soft estimator
inside it, each with its gradient, at the same beams and points, in one run.
"""

import re
import statistics
import time
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, distribution
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import place_rings as pr
from common import table
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.soft.estimator import soft_zeta
from place_rings.coverage.soft.sampling import cloud
from source_tree import FILE_LINES, FUNCTION_LINES, TYPED, SourceTree

SETUP, WIDTH, POINTS, ROUNDS = "n3_16_55", 0.02, 50_000, 9


def needed_distributions(name: str, known: set[str] | None = None) -> set[str]:
    """Return a distribution and all that it needs, without extras, by their normal names."""
    known = set() if known is None else known
    name = re.sub("[-_.]+", "-", name).lower()
    if name in known:
        return known
    try:
        requirements = distribution(name).requires or []
    except PackageNotFoundError:  # the requirement holds on other machines only
        return known
    known.add(name)
    for requirement in requirements:
        if "extra ==" not in requirement:
            needed_distributions(re.split(r"[^\w.-]", requirement, maxsplit=1)[0], known)
    return known


def installed_size(names: set[str]) -> int:
    """Return the bytes of the files that distributions installed; a file counts once."""
    files = {
        distribution(name).locate_file(file).resolve()  # type: ignore[union-attr]
        for name in names
        for file in distribution(name).files or []
    }
    return sum(file.stat().st_size for file in files if file.is_file())


def gradient_ratio() -> tuple[float, float]:
    """Return the ratio of the public soft coverage to the soft estimator: value, and gradient."""
    scene = pr.Scene.paper()
    setup = pr.Setup.named(SETUP)
    points = pr.sample_points(scene, POINTS)
    q = scene.poses[0].q
    cones = jax.tree.map(
        lambda a: jnp.asarray(a, jnp.float32), sensor_cones(pr.robots["ur10"], setup, q)
    )
    inner_points = jax.tree.map(jnp.asarray, cloud(points.points[0].astype(np.float32)))

    def public(values: Any) -> Any:
        return pr.coverage_fraction(setup, scene, points, WIDTH, values=values)

    estimate = jax.jit(soft_zeta)
    value, both = jax.jit(public), jax.jit(jax.value_and_grad(public))
    return (
        ratio(
            lambda: value(setup.values),
            lambda: estimate(cones, inner_points, jnp.float32(WIDTH), slopes=False),
        ),
        ratio(
            lambda: both(setup.values), lambda: estimate(cones, inner_points, jnp.float32(WIDTH))
        ),
    )


def ratio(work: Callable[[], Any], peer: Callable[[], Any]) -> float:
    """Return the median ratio of processor seconds of two functions that run alternately."""
    seconds: list[list[float]] = [[], []]
    for function in (work, peer):
        jax.block_until_ready(function())  # compiles
    for _ in range(ROUNDS):
        for function, each in zip((work, peer), seconds, strict=True):
            began = time.process_time()
            jax.block_until_ready(function())
            each.append(time.process_time() - began)
    return statistics.median(a / b for a, b in zip(*seconds, strict=True))


def report() -> list[str]:
    """Read the tree, measure and return Markdown."""
    tree = SourceTree()
    some, all_ = tree.parameters_of_any()
    core = needed_distributions("place-rings")
    value, gradient = gradient_ratio()
    lines = sorted(len(text.splitlines()) for text in tree.texts.values())
    figures = [
        ("files, rooms, sub-rooms", f"{len(tree.texts)}, {len(tree.rooms)}, {tree.sub_rooms()}"),
        ("lines of a file, median", lines[len(lines) // 2]),
        (f"files over {FILE_LINES} lines", len(tree.long_files())),
        (f"functions over {FUNCTION_LINES} lines", len(tree.long_functions())),
        ("class names defined twice", ", ".join(tree.classes_defined_twice()) or "none"),
        (
            f"parameters of {' and '.join(TYPED)} whose annotation contains `Any`",
            f"{some} of {all_} ({100 * some / all_:.1f} %)",
        ),
        (
            "installed size of core",
            f"{installed_size(core) / 1e6:.0f} MB, {len(core)} distributions",
        ),
        ("`pr.coverage_fraction` under `jit` to the soft estimator, value", f"{value:.2f}"),
        ("the same, value and gradient", f"{gradient:.2f}"),
    ]
    files = {room: sum(file.parts[0] == room for file in tree.texts) for room in tree.rooms}
    rooms = [(f"{room}/", files[room], tree.levels[room]) for room in tree.rooms]
    long = [(f"`{name}`", count) for count, name in (*tree.long_files(), *tree.long_functions())]
    return [
        *table(("figure", "value"), figures),
        "",
        *table(("room", "files", "levels"), rooms),
        "",
        *table(("long file or function", "lines"), long),
    ]
