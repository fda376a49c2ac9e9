"""A serial chain of revolute and prismatic joints, and its forward kinematics."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from ..arrays import Array, Vector, namespace
from ..definitions.equality import equal_fields


@dataclass(frozen=True)
class Mimic:
    """A joint whose value follows another joint of the chain: multiplier * value + offset."""

    joint: int
    """Index of the joint that follows."""
    leader: int
    """Index of the joint that it follows, which follows none."""
    multiplier: float = 1.0
    """Value per unit of the leader's value, in rad and m."""
    offset: float = 0.0
    """Value where the leader is at 0, rad or m."""


@dataclass(frozen=True)
class Chain:
    """Joints from base to TCP."""

    joints: tuple[str, ...]
    """Names of the J joints."""
    origin: Float[np.ndarray, "F 4 4"]
    """T_parent_joint (J + 1, 4, 4): pose of each joint's frame in the frame before it where the
    joint is at 0, m; the last is the TCP in the last link's frame."""
    axis: Float[np.ndarray, "J 3"]
    """Unit axis of each joint in its own frame; a prismatic joint slides along it."""
    prismatic: tuple[int, ...] = ()
    """Indices of the prismatic joints; the others are revolute."""
    mimics: tuple[Mimic, ...] = ()
    """The joints that follow others. They keep their place among the J values; what stands there
    is replaced by what their leaders state."""

    __eq__ = equal_fields

    def __len__(self) -> int:
        return len(self.joints)

    @cached_property
    def slides(self) -> Bool[np.ndarray, " J"]:
        """Whether each joint is prismatic."""
        slides = np.zeros(len(self), bool)
        slides[list(self.prismatic)] = True
        return slides

    def settled(
        self, q: Float[np.ndarray, "*batch J"], speed: bool = False
    ) -> Float[np.ndarray, "*batch J"]:
        """Return joint values (..., J), rad or m, or speeds, with those of mimic joints put
        right."""
        if not self.mimics:
            return q
        settled = np.array(q, float)
        for m in self.mimics:
            offset = 0.0 if speed else m.offset
            settled[..., m.joint] = m.multiplier * settled[..., m.leader] + offset
        return settled

    @property
    def first_revolute(self) -> int:
        """Index of the first revolute joint, where the arm begins; 0 if all are prismatic.

        The prismatic joints before it (a rail, a lift) carry the whole arm.
        """
        turns = np.flatnonzero(~self.slides)
        return int(turns[0]) if len(turns) else 0


def rotation_rpy(roll: float, pitch: float, yaw: float) -> Float[np.ndarray, "3 3"]:
    """Return the rotation about the fixed x, then y, then z axis (URDF's rpy), rad."""
    cr, sr, cp, sp, cy, sy = (f(a) for a in (roll, pitch, yaw) for f in (math.cos, math.sin))
    x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    rotation: np.ndarray = z @ y @ x
    return rotation


def rpy_of(R: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, " 3"]:
    """Return URDF's rpy angles of a rotation, rad.

    At a pitch of a quarter turn, roll and yaw are not unique; yaw is then 0.
    """
    pitch = math.atan2(-R[2, 0], math.hypot(R[0, 0], R[1, 0]))
    if math.hypot(R[0, 0], R[1, 0]) < 1e-9:
        return np.array([math.atan2(-R[1, 2], R[1, 1]), pitch, 0.0])
    return np.array([math.atan2(R[2, 1], R[2, 2]), pitch, math.atan2(R[1, 0], R[0, 0])])


def transform(xyz: Vector = (0, 0, 0), rpy: Vector = (0, 0, 0)) -> Float[np.ndarray, "4 4"]:
    """Return the homogeneous transform of a translation (3,) m and URDF angles (3,) rad."""
    T = np.eye(4)
    T[:3, :3] = rotation_rpy(*rpy)
    T[:3, 3] = xyz
    return T


def dh_transform(d: float, a: float, alpha: float) -> Float[np.ndarray, "4 4"]:
    """Return the Denavit-Hartenberg link transform at joint angle 0.

    It translates along z by ``d`` (m) and along x by ``a`` (m), then rotates about x by ``alpha``
    (rad).
    """
    T: np.ndarray = transform((0, 0, d)) @ transform((a, 0, 0), (alpha, 0, 0))
    return T


def _rotation(axis: Array, angle: Array) -> Any:
    """Return Rodrigues' rotation (..., 4, 4) about a constant unit ``axis`` (3,).

    ``angle`` has shape (...), in rad.
    """
    xp = namespace(angle)
    x, y, z = (float(v) for v in axis)
    K = np.zeros((4, 4))
    K[:3, :3] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
    batch = (1,) * angle.ndim
    one, K, K2 = (
        xp.asarray(m.reshape(*batch, 4, 4), dtype=angle.dtype) for m in (np.eye(4), K, K @ K)
    )
    s, c = xp.sin(angle)[..., None, None], xp.cos(angle)[..., None, None]
    return one + s * K + (1 - c) * K2


def _translation(axis: Array, distance: Array) -> Any:
    """Return the translation (..., 4, 4) along a constant unit ``axis`` (3,).

    ``distance`` has shape (...), in m.
    """
    xp = namespace(distance)
    along = np.zeros((4, 4))
    along[:3, 3] = axis
    batch = (1,) * distance.ndim
    one, along = (
        xp.asarray(m.reshape(*batch, 4, 4), dtype=distance.dtype) for m in (np.eye(4), along)
    )
    return one + distance[..., None, None] * along


def forward(chain: Chain, q: Float[Array, "*batch J"]) -> Float[Array, "*batch F 4 4"]:
    """Return the frames of all joints and of the TCP in the base frame.

    Args:
        chain: the chain of J joints.
        q: joint angles, or distances of prismatic joints, (..., J) rad or m; NumPy, or JAX, which
            can differentiate by them. Values of mimic joints are ignored: they follow.

    Returns:
        T_base_frame (..., J + 1, 4, 4): entry j is the frame of joint j after its motion (the
            frame of the link it moves); the last is the TCP.

    Raises:
        ValueError: if q does not have one value for each joint.
    """
    if q.shape[-1] != len(chain):
        raise ValueError(f"q has {q.shape[-1]} values; the chain has {len(chain)} joints")
    xp = namespace(q)
    origin = [xp.asarray(T, dtype=q.dtype) for T in chain.origin]
    values = [q[..., j] for j in range(len(chain))]
    for m in chain.mimics:
        values[m.joint] = m.multiplier * values[m.leader] + m.offset
    T = xp.broadcast_to(xp.eye(4, dtype=q.dtype), (*q.shape[:-1], 4, 4))
    frames = []
    for j in range(len(chain)):
        motion = _translation if j in chain.prismatic else _rotation
        T = T @ origin[j] @ motion(chain.axis[j], values[j])
        frames.append(T)
    frames.append(T @ origin[-1])
    stacked: Array = xp.stack(frames, axis=-3)
    return stacked


def arm_base(chain: Chain, q: Float[np.ndarray, " J"]) -> Float[np.ndarray, " 3"]:
    """Return the origin of the arm, m: the base frame's, or the carriage of a rail or lift.

    A carriage is the frame that the last prismatic joint before the first revolute joint moves.
    """
    first = chain.first_revolute
    if first == 0:
        return np.zeros(3)
    return np.asarray(forward(chain, q)[first - 1, :3, 3])


def joint_origins(chain: Chain, q: Float[np.ndarray, " J"]) -> Float[np.ndarray, "P 3"]:
    """Return the pose as a polyline (P, 3) m through the base, each joint's origin and the TCP.

    Repeated points are removed. Where a rail or lift carries the arm, the polyline begins at its
    carriage (``arm_base``), so that the arm has the same polyline wherever the carriage stands.
    The origin of any other prismatic joint moves with it.
    """
    points = np.vstack([arm_base(chain, q), forward(chain, q)[chain.first_revolute :, :3, 3]])
    keep = np.ones(len(points), bool)
    keep[1:] = np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-9
    return points[keep]
