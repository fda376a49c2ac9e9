"""The compiled part of the search objective: soft zetas of beams over the points of goals at poses,
and their slopes.
"""

from collections.abc import Callable
from threading import Lock
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from ..coverage.arrays import Array
from ..coverage.robots.attached import CarriedPolyhedron
from ..coverage.robots.link_bodies import robot_capsules
from ..coverage.robots.robot import BASE
from ..coverage.soft.beams import Hidden, InCell, Seen
from ..coverage.soft.estimator import Soft, soft_zeta
from ..coverage.soft.sampling import Cloud
from ..coverage.solids.cones import Cones
from ..coverage.solids.polyhedra import Polyhedron, placed
from ..coverage.solids.sensor_beams import BeamShapes
from .scene import CoreScene

# rows per call, and how many of them at once: on a CPU one after the other,
_ROWS = {"cpu": (16, None)}
_ROWS_ELSEWHERE = (256, 4)  # on an accelerator several, as memory allows

# a polyhedron at P poses: normals (P, F, 3), offsets (P, F) m and edges (P, E, 2, 3) m; its faces
Moved = tuple[list[np.ndarray], np.ndarray]


class Rows(NamedTuple):
    """N rows to evaluate: each one setup's K sensors at one pose, over the points of one term."""

    term: Int[Array, "*N"]
    """Index of the term."""
    pose: Int[Array, "*N"]
    """Index of the pose."""
    apex: Float[Array, "*N K 3"]
    """Apexes of the beams, m."""
    axis: Float[Array, "*N K 3"]
    """Axes of the beams."""
    beams: BeamShapes
    """Shapes (N, K) of the beams."""
    up: Float[Array, "*N K 3"] | None = None
    """Up vectors of the beams where these may be square, else None."""


class SoftTerms:
    """Soft zetas and slopes of rows, in 32 bit.

    One object may be used by many threads. It compiles once for all clouds of one shape, and for
    all widths, links, counts and numbers of rows.
    """

    def __init__(self, scene: CoreScene, frames: Float[np.ndarray, "P F 4 4"]) -> None:
        """Store a scene with the robot's ``frames`` at its poses."""
        self._occlusion, self._bodies = scene.occlusion, None
        self._obstacles = tuple(o.body for o in scene.obstacles)
        self._carried: list[Moved] = []
        if scene.occlusion != "ignore":
            self._bodies = robot_capsules(scene.robot, np.asarray(frames, np.float32))
            self._carried = [_moved(one, frames) for one in scene.robot.carried]
        self._each: Callable[..., Soft] = jax.jit(self._of_each)
        self._compiling, self._compiled = Lock(), False

    def __call__(self, rows: Rows, clouds: Cloud, width: float, slopes: bool) -> Soft:
        """Return zetas (N,) and slopes (N, K, 3), as NumPy arrays.

        Slopes are by apexes, axes and up vectors.
        """
        size, results, n = _rows()[0], [], len(rows.term)
        for i in range(0, n, size):
            some = jax.tree.map(lambda a, i=i: _filled(a[i : i + size], size), rows)
            results.append(self._run(some, min(size, n - i), clouds, np.float32(width), slopes))
        soft: Soft = jax.tree.map(lambda *a: np.concatenate(a)[:n], *results)
        return soft

    def _run(self, rows: Rows, count: int, clouds: Cloud, width: np.float32, slopes: bool) -> Soft:
        """Evaluate one call; the first runs alone, so that only one of several threads compiles."""
        if self._compiled:
            return self._each(rows, count, clouds, width, slopes)
        with self._compiling:
            soft = self._each(rows, count, clouds, width, slopes)
            self._compiled = True
        return soft

    def _of_each(
        self,
        rows: Rows,
        count: Int[jax.Array, ""],
        clouds: Cloud,
        width: Float[jax.Array, ""],
        slopes: Bool[jax.Array, ""],
    ) -> Soft:
        """Evaluate the first ``count`` rows; the others only pad the shape to a constant size."""

        def one(numbered: tuple[jax.Array, Rows]) -> Soft:
            i, row = numbered

            def look() -> Soft:
                beams = row.beams.solids(row.apex, row.axis, row.up)
                seen = self.past(beams, row.pose)
                points = jax.tree.map(lambda a: a[row.term], clouds)
                return soft_zeta(seen, points, width, slopes=slopes)

            def skip() -> Soft:
                by_apex, by_axis, by_up = jax.tree.map(jnp.zeros_like, (row.apex, row.axis, row.up))
                return Soft(jnp.zeros((), width.dtype), by_apex, by_axis, by_up)

            soft: Soft = jax.lax.cond(i < count, look, skip)
            return soft

        each: Soft = jax.lax.map(one, (jnp.arange(len(rows.term)), rows), batch_size=_rows()[1])
        return each

    def past(self, cones: Cones, pose: Int[Array, ""]) -> Seen:
        """Return the visible part of cones at a pose under the scene's occlusion and obstacles."""
        seen: Cones | Hidden = cones
        if self._bodies is not None:
            bodies = jax.tree.map(jnp.asarray, self._bodies).at(pose)
            seen = Hidden(cones, bodies, self._occlusion)
        carried = []
        for at_poses, faces in self._carried:
            normal, offset, edges = (jnp.asarray(a)[pose] for a in at_poses)
            carried.append(Polyhedron(normal, offset, edges, faces))
        obstacles = (*self._obstacles, *carried)
        return InCell(seen, obstacles) if obstacles else seen


def _moved(one: CarriedPolyhedron, frames: Float[np.ndarray, "P F 4 4"]) -> Moved:
    """Return what the robot carries at P poses, base frame."""
    still = np.broadcast_to(np.eye(4), (len(frames), 4, 4))
    each = [placed(one.body, T) for T in (still if one.frame == BASE else frames[:, one.frame])]
    at_poses = [
        np.stack([np.asarray(getattr(b, key), np.float32) for b in each])
        for key in ("normal", "offset", "edges")
    ]
    return at_poses, np.asarray(one.body.faces)


def _rows() -> tuple[int, int | None]:
    return _ROWS.get(jax.default_backend(), _ROWS_ELSEWHERE)


def _filled(array: np.ndarray, size: int) -> np.ndarray:
    """Return ``array`` padded with zeros to ``size`` along its first axis, in 32 bit."""
    kind = {"f": np.float32, "b": np.bool_}.get(array.dtype.kind, np.int32)
    padded = np.zeros((size, *array.shape[1:]), kind)
    padded[: len(array)] = array
    return padded
