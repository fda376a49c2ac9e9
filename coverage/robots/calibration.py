"""The calibrated kinematics of one arm: its joint axes and flange as its controller knows them.

A controller of Universal Robots states them by Denavit-Hartenberg parameters that differ a little
from the model's own. Two axes that are almost parallel have their common normal far away, so that
single parameters may differ by tens of metres, though the axes move by millimetres only. The
links' bodies and mounts must not follow such frames. Therefore only the axes and the flange are
taken over. Each link's frame stays where the link is: on its own joint's axis, turned about it
until the next axis lies where the link's model has it.
"""

import math
from dataclasses import dataclass, replace
from functools import reduce
from itertools import accumulate

import numpy as np
from jaxtyping import Float

from ..definitions.equality import equal_fields
from .kinematics import Chain, dh_transform, forward, transform

_EQUAL = 1e-12  # m and rad; a calibration that changes less is none
_SAME_ARM = 1e-4  # m, to which the lengths of one model agree between its descriptions
_MOST_M, _MOST_RAD = 0.01, math.radians(2.0)  # by which one arm of a model differs from it
_LEVER = 0.1  # m, at which a direction counts as a place when a link's frame is turned
_PARALLEL = 1e-9  # sine of the angle between axes without a common normal of their own
_HALF = transform((0, 0, 0), (0, 0, math.pi))
_QUARTER = math.pi / 2
_Z = np.array([0.0, 0.0, 1.0])
_ALPHA = np.array([_QUARTER, 0.0, 0.0, _QUARTER, -_QUARTER, 0.0])


@dataclass(frozen=True)
class Calibration:
    """Where the chain of a calibrated robot comes from."""

    nominal: Chain
    """The model's chain, which the calibrated one replaces."""
    source: str
    """File or controller that states the calibration."""


@dataclass(frozen=True)
class DhTable:
    """Denavit-Hartenberg parameters of six joints: each turns about z by theta and the joint's
    angle, then follow a translation by d along z, one by a along x, and a turn by alpha about x.
    """

    theta: Float[np.ndarray, " 6"]
    """Angle where the joint is at 0, rad."""
    a: Float[np.ndarray, " 6"]
    """Length along x, m."""
    d: Float[np.ndarray, " 6"]
    """Length along z, m."""
    alpha: Float[np.ndarray, " 6"]
    """Turn about x, rad."""

    __eq__ = equal_fields

    def __add__(self, more: "DhTable") -> "DhTable":
        return DhTable(
            self.theta + more.theta, self.a + more.a, self.d + more.d, self.alpha + more.alpha
        )

    @property
    def origin(self) -> Float[np.ndarray, "7 4 4"]:
        """Pose of each joint's frame, and of the flange, in the one before it (7, 4, 4) m, where
        the joints are at 0; each joint turns about its z axis."""
        links = [
            transform((0, 0, 0), (0, 0, theta)) @ dh_transform(d, a, alpha)
            for theta, a, d, alpha in zip(self.theta, self.a, self.d, self.alpha, strict=True)
        ]
        return np.stack([np.eye(4), *links])


def with_kinematics(chain: Chain, measured: Float[np.ndarray, "7 4 4"], flange: float) -> Chain:
    """Return a chain whose joint axes and flange are those that a controller states.

    Args:
        chain: the model's chain, of an arm with a table (``dh_table``).
        measured: pose of each joint's frame, and of the flange, in the one before it (7, 4, 4) m,
            from the controller's base on, where the joints are at 0; joints turn about z.
        flange: distance of the model's flange from the axis of joint 4, m: d of joint 5.

    Returns:
        The chain; ``chain`` itself if nothing differs.

    Raises:
        ValueError: if a joint differs by more than a calibration does.
    """
    base, T_flange_tcp = controller_base(chain), tool_pose(chain, flange)
    axes = [base]  # of the measured joints in the base frame, then the flange
    for T in measured:
        axes.append(axes[-1] @ T)
    frames = _link_frames(chain, np.stack(axes[1:7]), axes[7] @ T_flange_tcp)
    before = np.concatenate([np.eye(4)[None], frames[:-1]])
    origin = np.linalg.inv(before) @ frames
    if np.abs(origin - chain.origin).max() <= _EQUAL:
        return chain
    if (reason := frames_differ(chain, origin)) is not None:
        raise ValueError(f"{reason}; the calibration belongs to another robot")
    return replace(chain, origin=origin)


def tool_pose(chain: Chain, flange: float) -> Float[np.ndarray, "4 4"]:
    """Return the TCP of a model's chain in the frame of its flange (4, 4) m; ``flange`` as in
    ``with_kinematics``."""
    table = dh_table(chain)
    table = replace(table, d=np.array([*table.d[:5], flange]))
    T_base_flange = reduce(np.matmul, table.origin, controller_base(chain))
    T: np.ndarray = np.linalg.inv(T_base_flange) @ forward(chain, np.zeros(6))[-1]
    return T


def _link_frames(
    chain: Chain, axes: Float[np.ndarray, "6 4 4"], tcp: Float[np.ndarray, "4 4"]
) -> Float[np.ndarray, "7 4 4"]:
    """Return the frames (7, 4, 4) m of all links, and of the TCP, where the joints are at 0.

    Each lies on its joint's axis, the z axis of ``axes``, next to where the link before it expects
    it. The angle about the axis is free: it brings the next axis closest to its place in the link.
    """
    frames, before = [], np.eye(4)
    for j in range(6):
        frame = before @ chain.origin[j]
        start, along = axes[j, :3, 3], axes[j, :3, 2]
        turned = _least_turn(frame[:3, :3] @ chain.axis[j], along)
        frame[:3, :3] = turned @ frame[:3, :3]
        frame[:3, 3] = start + ((frame[:3, 3] - start) @ along) * along
        after = frame @ chain.origin[j + 1]
        if j < 5:
            wanted = axes[j + 1, :3, 2]
            place = axes[j + 1, :3, 3]
            place = place + ((after[:3, 3] - place) @ wanted) * wanted
            here = np.stack(
                [after[:3, 3] - frame[:3, 3], _LEVER * after[:3, :3] @ chain.axis[j + 1]]
            )
            there = np.stack([place - frame[:3, 3], _LEVER * wanted])
        else:
            here = np.stack([after[:3, 3] - frame[:3, 3], *_LEVER * after[:3, :3].T])
            there = np.stack([tcp[:3, 3] - frame[:3, 3], *_LEVER * tcp[:3, :3].T])
        frame[:3, :3] = _turn(along, _angle_about(along, here, there)) @ frame[:3, :3]
        frames.append(frame)
        before = frame
    return np.stack([*frames, tcp])


def _angle_about(
    axis: Float[np.ndarray, " 3"], here: Float[np.ndarray, "N 3"], there: Float[np.ndarray, "N 3"]
) -> float:
    """Return the angle about ``axis`` that brings vectors closest to others, rad (the Procrustes
    problem in the plane)."""
    across = here - np.outer(here @ axis, axis)
    sine = float((np.cross(across, there) @ axis).sum())
    return math.atan2(sine, float((across * there).sum()))


def _turn(axis: Float[np.ndarray, " 3"], angle: float) -> Float[np.ndarray, "3 3"]:
    """Return Rodrigues' rotation about a unit axis."""
    x, y, z = axis
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    R: np.ndarray = np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * K @ K
    return R


def _least_turn(
    start: Float[np.ndarray, " 3"], end: Float[np.ndarray, " 3"]
) -> Float[np.ndarray, "3 3"]:
    """Return the smallest rotation from one unit vector to another."""
    normal = np.cross(start, end)
    size = float(np.linalg.norm(normal))
    if size < 1e-15:
        return np.eye(3)
    return _turn(normal / size, math.atan2(size, float(start @ end)))


def frames_differ(chain: Chain, origin: Float[np.ndarray, "F 4 4"]) -> str | None:
    """Return how a joint's frame differs by more than a calibration changes; None if none does.

    Args:
        chain: the model's chain.
        origin: frames (J + 1, 4, 4) m in place of the chain's own.
    """
    names = (*chain.joints, "flange")
    for name, old, new in zip(names, chain.origin, origin, strict=True):
        move = float(np.linalg.norm(new[:3, 3] - old[:3, 3]))
        cosine = (np.trace(old[:3, :3].T @ new[:3, :3]) - 1) / 2
        angle = math.acos(min(max(float(cosine), -1.0), 1.0))
        if not (move <= _MOST_M and angle <= _MOST_RAD):
            return (
                f"{name} is {1000 * move:.1f} mm and {math.degrees(angle):.2f}° from the model's"
                f" (calibrations: at most {1000 * _MOST_M:g} mm and {math.degrees(_MOST_RAD):g}°)"
            )
    return None


def controller_base(chain: Chain) -> Float[np.ndarray, "4 4"]:
    """Return the base frame of a controller of Universal Robots in the chain's base frame (4, 4).

    ROS turns it by half a turn about z: there, joint 1 turns about +y where joint 0 is at 0.
    """
    if len(chain) != 6:
        return np.eye(4)
    frames = forward(chain, np.zeros(6))
    return _HALF if (frames[1, :3, :3] @ chain.axis[1])[1] > 0 else np.eye(4)


def dh_table(chain: Chain) -> DhTable:
    """Return the table of an arm of Universal Robots, without a calibration.

    The flange is taken to be at the TCP.

    Raises:
        ValueError: if the chain is none of them.
    """
    if len(chain) != 6 or chain.prismatic or chain.mimics:
        raise ValueError("the robot is no arm of Universal Robots, with six revolute joints")
    turned = np.linalg.inv(controller_base(chain)) @ forward(chain, np.zeros(6))
    x, y, z = turned[:, :3, 3].T
    table = DhTable(
        np.zeros(6),
        np.array([0.0, x[2] - x[1], x[3] - x[2], 0.0, 0.0, 0.0]),
        np.array([z[1], 0.0, 0.0, -y[4], z[1] - z[5], y[4] - y[6]]),
        _ALPHA,
    )
    frame = np.eye(4)
    for j, T in enumerate(table.origin[:6]):
        frame = frame @ T
        along = turned[j, :3, :3] @ chain.axis[j]
        aside = np.cross(turned[j, :3, 3] - frame[:3, 3], frame[:3, 2])
        if np.abs(along - frame[:3, 2]).max() > 1e-6 or np.linalg.norm(aside) > _SAME_ARM:
            raise ValueError(
                f"joint {chain.joints[j]} does not lie as in an arm of Universal Robots"
            )
    return table


def dh_table_of(origin: Float[np.ndarray, "7 4 4"], like: DhTable) -> DhTable:
    """Return the table of six joint axes, with the common normals wherever they are.

    Args:
        origin: as in ``with_kinematics``; joint 0 turns about the base's z axis.
        like: a table near to it, which decides between a normal and its opposite.
    """
    frames = np.stack(list(accumulate(origin, np.matmul)))
    seat, rows = np.eye(4), []
    for j in range(6):
        start, z = seat[:3, 3], seat[:3, 2]
        end, along = frames[j + 1, :3, 3], frames[j + 1, :3, 2]
        hint = seat[:3, :3] @ [math.cos(like.theta[j]), math.sin(like.theta[j]), 0.0]
        if j == 5:  # the flange's own x axis and origin
            x, foot = frames[6, :3, 0], end
        else:
            normal, across = np.cross(z, along), end - start - ((end - start) @ z) * z
            parallel = float(np.linalg.norm(normal)) < _PARALLEL
            x = _unit(across if parallel else normal)
            x = x if x @ hint >= 0 else -x
            # the points of both axes between which x lies: start + d z + a x = end + s along
            A = np.stack([z, x, -along], axis=1)
            foot = start + across if parallel else end + np.linalg.solve(A, end - start)[2] * along
        side, way = np.cross(z, seat[:3, 0]), foot - start
        rows.append(
            (
                math.atan2(float(x @ side), float(x @ seat[:3, 0])),
                float(way @ x),
                float(way @ z),
                math.atan2(float(np.cross(z, along) @ x), float(z @ along)),
            )
        )
        seat = (
            seat
            @ transform((0, 0, 0), (0, 0, rows[-1][0]))
            @ dh_transform(rows[-1][2], rows[-1][1], rows[-1][3])
        )
    return DhTable(*np.array(rows).T)


def measured_axes(chain: Chain, model: Chain, flange: float) -> Float[np.ndarray, "7 4 4"]:
    """Return the frames of a calibrated chain as ``with_kinematics`` takes them, which returns the
    same kinematics for them.

    Args:
        chain: the calibrated chain.
        model, flange: as in ``with_kinematics``.
    """
    frames = np.linalg.inv(controller_base(model)) @ forward(chain, np.zeros(6))
    frames[6] = frames[6] @ np.linalg.inv(tool_pose(model, flange))
    for j in range(6):
        frames[j, :3, :3] = frames[j, :3, :3] @ _least_turn(_Z, chain.axis[j])
    measured: np.ndarray = np.linalg.inv(np.concatenate([np.eye(4)[None], frames[:-1]])) @ frames
    return measured


def _unit(v: Float[np.ndarray, " 3"]) -> Float[np.ndarray, " 3"]:
    unit: np.ndarray = v / np.linalg.norm(v)
    return unit
