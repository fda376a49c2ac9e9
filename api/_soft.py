"""The soft coverage of a setup, for gradients: under ``jax.grad``, ``jit`` and ``vmap``."""

from collections import OrderedDict
from typing import Any

import jax
import numpy as np

from ._checks import SetupLike, resolve_setup
from ._errors import InputError, input_errors
from ._scene import Scene, core_scene
from .coverage.rings.ring_kinematics import RingArrays, ring_arrays
from .coverage.soft.sampling import Cloud, cloud
from .objectives.scene import Scene as CoreScene
from .objectives.soft_fraction import SoftFraction
from .objectives.soft_objective import TargetPoints

_KEPT = 8  # setups in scenes that are kept compiled
_prepared: OrderedDict[Any, tuple[Any, SoftFraction, RingArrays, Any]] = OrderedDict()


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
    if count < 1:
        raise InputError(f"found {count}, allowed: 1 and more", "count")
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
            Keep the object between calls: what is compiled for it is kept too.
        width: of the sigmoid, m, above 0. A constant: it has no gradient.
        values: (3, R): positions, tilts and phases (rad) of the R rings; ``setup.values`` by
            default.

    Returns:
        A scalar in [0, 1].

    Raises:
        InputError: for values or points of another shape, or a setup that does not fit the scene.

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
    fraction, arrays, own = _prepare(setup, scene, points)
    if values is None:
        values = own
    elif np.shape(values) != own.shape:
        raise InputError(f"found shape {np.shape(values)}, allowed: {own.shape}", "values")
    if not isinstance(width, jax.Array) and not width > 0:
        raise InputError(f"found {width}, allowed: m, above 0", "width")
    return fraction(arrays, values, width)


def _prepare(setup: Any, scene: Any, points: Any) -> tuple[SoftFraction, RingArrays, Any]:
    """What is compiled for these objects; kept, with the objects, for the next call."""
    key = (setup if isinstance(setup, str) else id(setup), id(scene), id(points))
    if key not in _prepared:
        _, placed, core = resolve_setup(setup, scene)
        if not placed.rings:
            raise InputError("found no ring, allowed: one or more", "setup")
        with input_errors():
            fraction = next(
                (kept[1] for kept in _prepared.values() if _same(kept[0], scene, points)), None
            ) or SoftFraction(core, *_terms(core, points))
            arrays = ring_arrays(core.robot, placed.rings)
        _prepared[key] = ((setup, scene, points), fraction, arrays, placed.values)
        if len(_prepared) > _KEPT:
            _prepared.popitem(last=False)
    _prepared.move_to_end(key)
    return _prepared[key][1:]


def _same(kept: Any, scene: Any, points: Any) -> bool:
    return kept[1] is scene and kept[2] is points


def _terms(scene: CoreScene, points: Any) -> tuple[Cloud, Any, Any]:
    """Clouds, poses and weights of all terms."""
    poses = len(scene.poses)
    if isinstance(points, TargetPoints):
        goal, pose = (np.array(column) for column in zip(*points.terms, strict=True))
        if goal.max() >= len(scene.goals) or pose.max() >= poses:
            raise InputError("found points of another scene, allowed: those of this one", "points")
        weights = scene.goal_weights[goal] * scene.pose_weights[pose] / points.mountings
        return points.clouds(len(points.points[0])), pose, weights
    if isinstance(points, jax.core.Tracer):
        raise InputError("found traced points, allowed: an array of numbers", "points")
    each = np.asarray(points, float)
    if each.ndim != 2 or each.shape[1] != 3 or not len(each) or not np.isfinite(each).all():
        raise InputError(f"found shape {each.shape}, allowed: finite (N, 3), m", "points")
    one = cloud(each)
    clouds = jax.tree.map(lambda a: np.stack([a] * poses), one)
    return jax.device_put(clouds), np.arange(poses), scene.pose_weights
