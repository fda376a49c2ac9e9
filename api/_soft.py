"""Soft coverage of a setup, differentiable under ``jax.grad``, ``jit`` and ``vmap``."""

import logging
import math
from collections import OrderedDict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from hashlib import blake2b
from threading import Lock, Timer
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from ._arguments import check_question, whole
from ._errors import InputError, input_errors
from ._validation import SetupLike, given_scene, resolve_setup
from .coverage.detection.detection import Detection
from .coverage.rings.ring import Setup
from .coverage.rings.ring_kinematics import RingArrays, ring_arrays
from .objectives.criterion import Criterion
from .objectives.scene import Scene
from .objectives.soft_coverage import SoftCoverage
from .objectives.target_points import TargetPoints


class _Prepared(NamedTuple):
    """Compiled function of a setup in a scene with its points."""

    soft: SoftCoverage
    """The soft coverage."""
    arrays: RingArrays
    """Arrays of the setup's rings."""
    values: Any
    """(3, R) positions, tilts and phases of the setup's rings."""
    kept: tuple[Scene, Any]
    """Scene and points; holding them keeps the identities in the key unique."""


_LONG = 2.0  # s, after which a compilation is announced
_KEPT = 8  # compiled functions in the cache
_prepared: OrderedDict[Any, _Prepared] = OrderedDict()
_lock = Lock()  # guards ``_prepared``


def sample_points(scene: Scene, count: int = 8192, seed: int = 0) -> TargetPoints:
    """Draw points uniformly in each target of a scene at each pose, for ``coverage_fraction``.

    Args:
        scene: scene with its targets and poses.
        count: number of points in each target at each pose.
        seed: random seed; the same seed gives the same points.

    Returns:
        The points; ``points`` holds one array (count, 3) in m for each target and pose.

    Raises:
        InputError: for an empty target, or a count below 1.

    Example:
        >>> import place_rings as pr
        >>> pr.sample_points(pr.Scene(), 256).points[0].shape
        (256, 3)
    """
    whole("count", count, 1)
    whole("seed", seed, 0)
    with input_errors("target"):
        return TargetPoints(given_scene(scene), count, seed)


def coverage_fraction(
    setup: SetupLike,
    scene: Scene,
    points: TargetPoints | Any,
    width: float | jax.Array = 0.02,
    *,
    values: Any = None,
    detect: Detection | None = None,
) -> jax.Array:
    """Return the soft coverage of a setup, differentiable with respect to its rings' values.

    Single sensors and those of the cell count, and stay where they are.

    A beam with the implicit function f covers a point to the degree sigmoid(-f / width). Several
    beams cover it to 1 - prod(1 - degree); of each ring the sensors nearest in azimuth count. The
    result is the weighted mean over points, targets and poses. As the width approaches 0, it
    approaches the share of covered points. The function works under ``jax.grad``, ``jax.jit`` and
    ``jax.vmap``. It ignores ``at_least_percent`` of targets and ``over_poses``. With ``detect`` the
    degree of a point is the probability that the test piece there is detected in time. The first
    call for a scene and setup of a new shape compiles it; a compilation of more than 2 s is logged.

    Args:
        setup: the rings: links, sensors and radii, and their positions and angles unless ``values``
            is given.
        scene: robot, poses, occlusion, obstacles and weights.
        points: result of ``sample_points``, or an array (N, 3) in m, base frame, used at every
            pose. The compiled function is reused for the same object, and for an array with the
            same numbers.
        width: width of the sigmoid, m, above 0. It is a constant without a gradient.
        values: (3, R) array: positions (0 to 1), tilts (rad) and phases (rad) of the R rings;
            ``setup.values`` by default.
        detect: what is to be detected; None: points are to be in beams. It is smooth by itself:
            ``width`` smooths first returns only.

    Returns:
        A scalar in [0, 1]; NaN for values that are not finite, or for a traced width that is not
        above 0.

    Raises:
        InputError: for a width that is not above 0, values or points of another shape, a setup that
            does not fit the scene, or light in which no source states a sensor's range.

    Example:
        >>> import jax
        >>> import place_rings as pr
        >>> scene, setup = pr.Scene(), pr.Setup.named("n1_8_0")
        >>> points = pr.sample_points(scene, 256)
        >>> def objective(values):
        ...     return pr.coverage_fraction(setup, scene, points, 0.05, values=values)
        >>> jax.grad(objective)(setup.values).shape
        (3, 3)
    """
    check_question(detect)
    ready = _prepare(setup, scene, points, detect)
    given = ready.values if values is None else _numbers(values, ready.values.shape)
    if not isinstance(width, jax.core.Tracer):
        _check_width(width)
    with _said_if_long():
        return ready.soft.mean(ready.arrays, given, width)


@contextmanager
def _said_if_long() -> Iterator[None]:
    """Log one line if what is done in this context, the compilation of a first call, lasts."""
    text = "compiling coverage_fraction for scenes and setups of a new shape; later calls are fast"
    timer = Timer(_LONG, logging.getLogger(__name__).warning, [text])
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def _numbers(values: Any, shape: tuple[int, ...]) -> jax.Array:
    """Return values of rings, traced or not; raise InputError for another shape."""
    try:
        array = jnp.asarray(values)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"found values that are not numbers, allowed: numbers {shape}", "values"
        ) from error
    if array.shape != shape or jnp.iscomplexobj(array):
        raise InputError(f"found shape {array.shape}, allowed: numbers {shape}", "values")
    return array


def _check_width(width: Any) -> None:
    try:
        holds = 0 < float(width) < math.inf
    except (TypeError, ValueError):
        holds = False
    if not holds:
        raise InputError(f"found {width!r}, allowed: m, above 0 and finite", "width")


def _prepare(setup: Any, scene: Any, points: Any, detect: Detection | None) -> _Prepared:
    """Return the compiled function of a setup, a scene and points, from the cache if it is there.

    Setups and their files are resolved on every call, and arrays of points are compared by their
    numbers, because both may change between calls.
    """
    _, placed, core = resolve_setup(setup, scene)
    among: tuple[Any, ...] = (id(core), detect, id(points))
    if not isinstance(points, TargetPoints):
        points = _array(points)
        among = (id(core), detect, len(points), blake2b(points.tobytes()).digest())
    key = (*among, placed)
    with _lock:
        if key not in _prepared:
            soft = next((one.soft for at, one in _prepared.items() if at[:-1] == among), None)
            _prepared[key] = _made(placed, core, points, soft, detect)
            while len(_prepared) > _KEPT:
                _prepared.popitem(last=False)
        _prepared.move_to_end(key)
        return _prepared[key]


def _made(
    setup: Setup, core: Scene, points: Any, soft: SoftCoverage | None, detect: Detection | None
) -> _Prepared:
    # the cached values must not belong to a caller's trace
    with input_errors(), jax.ensure_compile_time_eval():
        aim, placed = Criterion(detection=detect), core.with_cell(setup)
        soft = soft or _soft_coverage(core, points, aim)
        arrays = ring_arrays(core.robot, placed.groups, detection=detect)
    return _Prepared(soft, arrays, setup.values, (core, points))


def _array(points: Any) -> np.ndarray:
    """Return a copy of points (N, 3) in m; raise InputError for anything else."""
    if isinstance(points, jax.core.Tracer):
        raise InputError("found traced points, allowed: an array of numbers", "points")
    try:
        each = np.array(points, float)
    except (TypeError, ValueError) as error:
        raise InputError(
            "found values that are not numbers, allowed: finite (N, 3), m", "points"
        ) from error
    if each.ndim != 2 or each.shape[1] != 3 or not len(each) or not np.isfinite(each).all():
        raise InputError(f"found shape {each.shape}, allowed: finite (N, 3), m", "points")
    return each


def _soft_coverage(scene: Scene, points: Any, aim: Criterion) -> SoftCoverage:
    """Return the soft coverage at points of each target at each pose, or at an array of points at
    every pose."""
    poses = len(scene.poses)
    if not isinstance(points, TargetPoints):
        one = replace(scene, targets=scene.targets[:1])
        return SoftCoverage(one, [(0, p) for p in range(poses)], [points] * poses, aim)
    if (
        max(g for g, _ in points.terms) >= len(scene.targets)
        or max(p for _, p in points.terms) >= poses
    ):
        raise InputError("found points of another scene, allowed: those of this one", "points")
    return SoftCoverage(scene, points.terms, points.points, aim)
