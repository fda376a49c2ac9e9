"""The pose curve: a polyline through the joint origins whose bends are rounded by quadratic Bezier
curves.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ..solids.swept_tube import Tube

_STRAIGHT = 1e-9  # sine of the angle below which two segments count as parallel
# of the longest velocity: below it a point of a bend has no tangent
_TURNING = 1e-12


@dataclass(frozen=True)
class Piece:
    """A Bezier curve of degree 1 (straight part) or 2 (bend)."""

    control: Float[np.ndarray, "C 3"]
    """Control points (2 or 3, 3), m."""

    @property
    def bend(self) -> bool:
        return len(self.control) == 3

    def point(self, t: Float[np.ndarray, " N"]) -> Float[np.ndarray, "N 3"]:
        """Return the points at parameters t in [0, 1]."""
        t = t[:, None]
        point: np.ndarray
        if self.bend:
            a, b, c = self.control
            point = (1 - t) ** 2 * a + 2 * t * (1 - t) * b + t**2 * c
        else:
            a, b = self.control
            point = (1 - t) * a + t * b
        return point

    def velocity(self, t: Float[np.ndarray, " N"]) -> Float[np.ndarray, "N 3"]:
        """Return the derivatives by t at parameters t in [0, 1]."""
        t = t[:, None]
        if not self.bend:
            a, b = self.control
            return np.broadcast_to(b - a, (len(t), 3)).copy()
        a, b, c = self.control
        velocity: np.ndarray = 2 * (1 - t) * (b - a) + 2 * t * (c - b)
        return velocity

    def speed(self, t: float) -> float:
        """Return the length of the derivative by t."""
        return float(np.linalg.norm(self.velocity(np.array([t]))))


@dataclass(frozen=True)
class PoseCurve:
    """Pieces from base to TCP, end to end."""

    pieces: tuple[Piece, ...]

    def arc_length(self) -> float:
        """Return the length of the curve, m, by adaptive quadrature of the speed."""
        from scipy.integrate import quad

        length: float = sum(quad(piece.speed, 0, 1, limit=200)[0] for piece in self.pieces)
        return length

    def discs(
        self, points_per_bend: int
    ) -> tuple[Float[np.ndarray, "D 3"], Float[np.ndarray, "D 3"], list[int]]:
        """Return discs along the curve: centres (D, 3) m, unit tangents (D, 3), first of each slab.

        A straight part has a disc at each end. A bend has ``points_per_bend`` discs, ends included.
        A disc shared by two pieces occurs once. Where an arm that is folded back turns round, the
        curve has no tangent. A disc exactly there may lie in any plane through the arm's axis: its
        neighbours share one centre, so that the three sweep the same volume for each such plane.
        """
        centres: list[np.ndarray] = []
        normals: list[np.ndarray] = []
        first: list[int] = []
        for piece in self.pieces:
            t = np.linspace(0, 1, points_per_bend if piece.bend else 2)
            centre, velocity = piece.point(t), piece.velocity(t)
            speed = np.linalg.norm(velocity, axis=1)
            turning = speed <= _TURNING * speed.max()
            if turning.any():
                velocity[turning], speed[turning] = _across(velocity[0]), 1.0
            normal = velocity / speed[:, None]
            shared = bool(normals) and float(np.dot(normals[-1], normal[0])) > 0
            if shared:
                centre, normal = centre[1:], normal[1:]
            start = len(centres) - 1 if shared else len(centres)
            centres.extend(centre)
            normals.extend(normal)
            first.extend(range(start, len(centres) - 1))
        return np.array(centres), np.array(normals), first

    def tube(self, radius: float, points_per_bend: int) -> Tube:
        """Return the solid swept by a disc of ``radius`` m perpendicular to the curve."""
        centre, normal, first = self.discs(points_per_bend)
        return Tube(centre, normal, float(radius), np.array(first))


def _across(v: Float[np.ndarray, " 3"]) -> Float[np.ndarray, " 3"]:
    """Return a unit vector normal to ``v``."""
    across = np.cross(v, np.eye(3)[np.abs(v).argmin()])
    unit: np.ndarray = across / np.linalg.norm(across)
    return unit


def pose_curve(points: Float[np.ndarray, "P 3"], blend: float = 0.5) -> PoseCurve:
    """Return the paper's piecewise Bezier curve through the polyline ``points``.

    Where the two segments at a joint do not continue in one direction, the curve leaves the first
    segment ``blend / 2`` of its length before the joint and rejoins the second ``blend / 2`` of its
    length after it. In between it is a quadratic Bezier curve with the joint as its middle control
    point. An arm that is folded back onto itself is the limit of a sharp bend: the curve turns
    round short of the joint, so that the volumes about it are continuous in the joint angles.

    Args:
        points: (P, 3) m, P at least 2, no two neighbours equal.
        blend: in (0, 1].

    Raises:
        ValueError: if the blend is outside (0, 1] or there are fewer than two points.
    """
    if not 0 < blend <= 1:
        raise ValueError(f"blend must be in (0, 1], got {blend}")
    if len(points) < 2:
        raise ValueError(f"a pose curve needs at least two points, got {len(points)}")
    step = np.diff(points, axis=0)
    unit = step / np.linalg.norm(step, axis=1, keepdims=True)
    pieces: list[Piece] = []
    start = points[0]
    for i in range(1, len(points) - 1):
        parallel = np.linalg.norm(np.cross(unit[i - 1], unit[i])) < _STRAIGHT
        if parallel and np.dot(unit[i - 1], unit[i]) > 0:
            leave = rejoin = points[i]
        else:
            leave, rejoin = points[i] - blend / 2 * step[i - 1], points[i] + blend / 2 * step[i]
        if np.linalg.norm(leave - start) > _STRAIGHT:
            pieces.append(Piece(np.stack([start, leave])))
        if rejoin is not leave:
            pieces.append(Piece(np.stack([leave, points[i], rejoin])))
        start = rejoin
    pieces.append(Piece(np.stack([start, points[-1]])))
    return PoseCurve(tuple(pieces))
