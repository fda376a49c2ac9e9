"""Sensors attached to a robot in a MuJoCo model of one's own."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from ...coverage.robots.kinematics import forward
from ...coverage.robots.robot import BASE
from ...formats.export.placed import PlacedSetup
from .world import SITE, TwinBody, TwinWorld, compiled

_MOST_MM, _MOST_RAD = 1.0, 2e-3  # by which a joint of the model may be off
_ROUNDS = 50  # of the fit


class _Lines(NamedTuple):
    """Axes of joints where all joints are at 0."""

    point: Float[np.ndarray, "J 3"]
    """A point of each, m."""
    way: Float[np.ndarray, "J 3"]
    """Unit vectors."""


def attached_world(
    spec: Any, placed: PlacedSetup, joints: Sequence[str], bodies: Sequence[TwinBody] = ()
) -> TwinWorld:
    """Return the world of a model with the sensors on its robot.

    The robot may stand anywhere, and its links may have other frames than the scene's: each sensor
    is placed by the axes of the joints.

    Args:
        spec: ``mujoco.MjSpec`` of the model, which stays as it is.
        placed: the setup on the scene's robot.
        joints: names of the robot's joints in the model, from the base on.
        bodies: further bodies.

    Raises:
        ValueError: if the model lacks a joint, or its arm is another one.
    """
    import mujoco

    spec = spec.copy()
    model = spec.compile()
    data = mujoco.MjData(model)
    ids = np.array([_joint(model, name) for name in joints])
    chain = placed.scene.robot.chain
    q = chain.settled(np.zeros(len(chain)))
    data.qpos[model.jnt_qposadr[ids]] = q
    mujoco.mj_kinematics(model, data)
    frames = np.asarray(forward(chain, q))
    own = _Lines(frames[:-1, :3, 3], np.einsum("jab,jb->ja", frames[:-1, :3, :3], chain.axis))
    T_world_base = _fitted(own, _Lines(data.xanchor[ids], data.xaxis[ids]), placed, joints)
    held = {body.id: body for body in spec.bodies}
    taken = {site.name for site in spec.sites}
    for sensor in placed.sensors:
        joint, T_link_sensor = placed.on_link(sensor)
        T_base_link = placed.T_base_root if joint == BASE else frames[joint]
        body = model.jnt_bodyid[ids[max(joint, 0)]]
        body = model.body_parentid[body] if joint == BASE else body
        T = np.linalg.inv(_pose(data, body)) @ T_world_base @ T_base_link @ T_link_sensor
        if sensor.name in taken:
            raise ValueError(f"found a site {sensor.name}, allowed: a model without the sensors")
        x, y, z, w = Rotation.from_matrix(T[:3, :3]).as_quat()
        held[body].add_site(name=sensor.name, pos=T[:3, 3], quat=(w, x, y, z), size=[SITE] * 3)
    return compiled(spec, placed, bodies)


def _joint(model: Any, name: str) -> int:
    """Return the number of a joint."""
    import mujoco

    number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)
    if number < 0:
        names = [model.joint(j).name for j in range(model.njnt)]
        raise ValueError(f"found no joint {name}; the model has {', '.join(names) or 'none'}")
    return int(number)


def _pose(data: Any, body: int) -> Float[np.ndarray, "4 4"]:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = data.xmat[body].reshape(3, 3), data.xpos[body]
    return T


def _fitted(
    own: _Lines, theirs: _Lines, placed: PlacedSetup, joints: Sequence[str]
) -> Float[np.ndarray, "4 4"]:
    """Return T_world_base, which moves the axes of the scene's robot onto those of the model.

    A point of an axis may lie anywhere along it, so points move along the axes between fits.
    """
    slides = np.asarray(placed.scene.robot.chain.slides)
    turns = np.flatnonzero(~slides) if not slides.all() else np.arange(len(slides))
    point, T, goal = own.point.copy(), np.eye(4), theirs.point[turns].mean(axis=0)
    for _ in range(_ROUNDS):
        turn, _ = Rotation.align_vectors(
            np.concatenate([theirs.way, theirs.point[turns] - goal]),
            np.concatenate([own.way, point[turns] - point[turns].mean(axis=0)]),
        )
        T[:3, :3] = turn.as_matrix()
        T[:3, 3] = goal - T[:3, :3] @ point[turns].mean(axis=0)
        back = (theirs.point - T[:3, 3]) @ T[:3, :3] - own.point
        point = own.point + np.sum(back * own.way, axis=1, keepdims=True) * own.way
    gap = theirs.point - (point @ T[:3, :3].T + T[:3, 3])
    gap -= np.sum(gap * theirs.way, axis=1, keepdims=True) * theirs.way
    off_mm = np.where(slides, 0.0, 1000 * np.linalg.norm(gap, axis=1))
    off = np.linalg.norm(own.way @ T[:3, :3].T - theirs.way, axis=1)
    worst = int(np.argmax(np.maximum(off_mm / _MOST_MM, off / _MOST_RAD)))
    if off_mm[worst] > _MOST_MM or off[worst] > _MOST_RAD:
        raise ValueError(
            f"found joint {joints[worst]} {off_mm[worst]:.3g} mm and"
            f" {np.degrees(off[worst]):.3g}° off, allowed: the arm of the scene,"
            f" {placed.scene.robot.name}, within {_MOST_MM:g} mm"
        )
    return T
