"""The soft coverage of a setup, for gradients: under ``jax.grad``, ``jit`` and ``vmap``."""

import math
from collections import OrderedDict
from hashlib import blake2b
from threading import Lock
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from ._arguments import whole
from ._errors import InputError, input_errors
from ._scene import Scene, core_scene
from ._validation import SetupLike, resolve_setup
from .coverage.rings.ring import Setup
from .coverage.rings.ring_kinematics import RingArrays, ring_arrays
from .coverage.soft.sampling import Cloud, cloud
from .objectives.scene import Scene as CoreScene
from .objectives.soft_fraction import SoftFraction
from .objectives.target_points import TargetPoints


class _Prepared(NamedTuple):
    """What is compiled for a setup in a scene with its points, and the objects that it is of: an
    identity in its key stays theirs as long as they are kept."""

    fraction: SoftFraction
    arrays: RingArrays
    values: Any
    kept: tuple[CoreScene, Any]


_KEPT = 8  # setups in scenes that are kept compiled
_prepared: OrderedDict[Any, _Prepared] = OrderedDict()
_lock = Lock()  # of ``_prepared``


def sample_points(scene: Scene | CoreScene, count: int = 8192, seed: int = 0) -> TargetPoints:
    """Draw points uniformly in each target of a scene at each pose, for ``coverage_fraction``.

    Args:
        scene: with its targets and poses.
        count: points in each target at each pose.
        seed: the same seed gives the same points.

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
        return TargetPoints(core_scene(scene), count, seed)


def coverage_fraction(
    setup: SetupLike,
    scene: Scene | CoreScene,
    points: TargetPoints | Any,
    width: float | jax.Array = 0.02,
    *,
    values: Any = None,
) -> jax.Array:
    """The soft coverage of a setup, differentiable by the values of its rings.

    A beam covers a point to the degree sigmoid(-f / width) with the implicit function f of the
    beam, several cover it to 1 - prod(1 - degree), and the result is the weighted mean over points,
    targets and poses. For a width towards 0 it is the share of the points that are covered. Goes
    under ``jax.grad``, ``jax.jit`` and ``jax.vmap``; floors of targets and ``over_poses`` have no
    part in it.

    Args:
        setup: the rings: links, sensors, radii, and where ``values`` is not given their places.
        scene: robot, poses, occlusion, obstacles, weights.
        points: from ``sample_points``; or an array (N, 3) m, base frame, the same at every pose.
            What is compiled is kept between calls with the same object, or with an array of the
            same numbers.
        width: of the sigmoid, m, above 0. A constant: it has no gradient.
        values: (3, R): positions, tilts and phases (rad) of the R rings; ``setup.values`` by
            default.

    Returns:
        A scalar in [0, 1]; NaN for values that are not finite, and for a traced width that is not
        above 0.

    Raises:
        InputError: for a width that is not above 0, values or points of another shape, or a setup
            that does not fit the scene.

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
    ready = _prepare(setup, scene, points)
    given = ready.values if values is None else _numbers(values, ready.values.shape)
    if not isinstance(width, jax.core.Tracer):
        _check_width(width)
    return ready.fraction(ready.arrays, given, width)


def _numbers(values: Any, shape: tuple[int, ...]) -> jax.Array:
    """Values of rings, traced or not; InputError for another shape."""
    try:
        found = jnp.asarray(values)
    except (TypeError, ValueError) as error:
        raise InputError(f"found no numbers, allowed: numbers {shape}", "values") from error
    if found.shape != shape or jnp.iscomplexobj(found):
        raise InputError(f"found shape {found.shape}, allowed: numbers {shape}", "values")
    return found


def _check_width(width: Any) -> None:
    try:
        holds = 0 < float(width) < math.inf
    except (TypeError, ValueError):
        holds = False
    if not holds:
        raise InputError(f"found {width!r}, allowed: m, above 0 and finite", "width")


def _prepare(setup: Any, scene: Any, points: Any) -> _Prepared:
    """What is compiled for a setup, a scene and points; kept for the next call with them.

    Setups and files of setups are resolved each time, and arrays of points are told apart by their
    numbers: both may change between calls.
    """
    _, placed, core = resolve_setup(setup, scene)
    if not isinstance(points, TargetPoints):
        points = _array(points)
    among = (id(core), id(points) if isinstance(points, TargetPoints) else _digest(points))
    key = (*among, placed)
    with _lock:
        if key not in _prepared:
            fraction = next(
                (one.fraction for at, one in _prepared.items() if at[:2] == among), None
            )
            _prepared[key] = _made(placed, core, points, fraction)
            while len(_prepared) > _KEPT:
                _prepared.popitem(last=False)
        _prepared.move_to_end(key)
        return _prepared[key]


def _made(setup: Setup, core: CoreScene, points: Any, fraction: SoftFraction | None) -> _Prepared:
    # a caller may be tracing, and what is kept is no part of its trace
    with input_errors(), jax.ensure_compile_time_eval():
        fraction = fraction or SoftFraction(core, *_terms(core, points))
        arrays = ring_arrays(core.robot, setup.rings)
    return _Prepared(fraction, arrays, setup.values, (core, points))


def _array(points: Any) -> np.ndarray:
    """Points (N, 3) m as an array of the caller's own numbers; InputError for anything else."""
    if isinstance(points, jax.core.Tracer):
        raise InputError("found traced points, allowed: an array of numbers", "points")
    try:
        each = np.array(points, float)
    except (TypeError, ValueError) as error:
        raise InputError("found no numbers, allowed: finite (N, 3), m", "points") from error
    if each.ndim != 2 or each.shape[1] != 3 or not len(each) or not np.isfinite(each).all():
        raise InputError(f"found shape {each.shape}, allowed: finite (N, 3), m", "points")
    return each


def _digest(points: np.ndarray) -> tuple[int, bytes]:
    return len(points), blake2b(points.tobytes()).digest()


def _terms(scene: CoreScene, points: Any) -> tuple[Cloud, Any, Any]:
    """Clouds, poses and weights of all terms."""
    poses = len(scene.poses)
    if isinstance(points, TargetPoints):
        goal, pose = (np.array(column) for column in zip(*points.terms, strict=True))
        if goal.max() >= len(scene.goals) or pose.max() >= poses:
            raise InputError("found points of another scene, allowed: those of this one", "points")
        weights = scene.goal_weights[goal] * scene.pose_weights[pose] / points.mountings
        return points.clouds(len(points.points[0])), pose, weights
    one = cloud(points)
    clouds = jax.tree.map(lambda a: np.stack([a] * poses), one)
    return jax.device_put(clouds), np.arange(poses), scene.pose_weights
