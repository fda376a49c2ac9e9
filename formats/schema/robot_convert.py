"""Between the model of a robot's file and the robot in code."""

import math

import numpy as np
from jaxtyping import Float

from ...coverage.robots.built_in import ROBOTS, built_in
from ...coverage.robots.kinematics import Chain, transform
from ...coverage.robots.robot import BASE, Body, Mount, Robot
from ...coverage.solids.capsules import Capsules
from .robot_models import (
    BASE_FRAME,
    TCP_FRAME,
    BodyModel,
    JointModel,
    MountAxisModel,
    RobotFile,
    TcpModel,
)

_DIGITS = 12  # decimals of metres and of unit vectors in a file
_DIGITS_DEG = 11


def _origin(place: JointModel | TcpModel) -> Float[np.ndarray, "4 4"]:
    return transform(place.xyz, [math.radians(a) for a in place.rpy_deg])


def robot_of(model: str | RobotFile) -> Robot:
    """The robot that a scene's ``robot`` means: a built-in one by its name (KeyError if there is
    none), or one in-line.
    """
    if isinstance(model, str):
        return ROBOTS[model]
    names = [j.name for j in model.joints]
    frames = {name: j for j, name in enumerate(names)} | {BASE_FRAME: BASE, TCP_FRAME: len(names)}
    limits = [[-math.inf, math.inf] if j.limits_deg is None else j.limits_deg for j in model.joints]
    return Robot(
        name=model.name,
        chain=Chain(
            joints=tuple(names),
            origin=np.stack([*(_origin(j) for j in model.joints), _origin(model.tcp)]),
            axis=np.array([j.axis for j in model.joints], float),
        ),
        mounts=tuple(
            Mount(
                m.link,
                frames[m.frame],
                np.array(m.start, float),
                np.array(m.axis, float),
                np.array(m.zero, float),
                float(m.length),
                (m.usable[0], m.usable[1]),
                m.section,
                m.aside,
                math.radians(m.toward_deg),
            )
            for m in model.mounts
        ),
        reach=model.reach,
        bodies=tuple(
            Body(
                b.name,
                frames[b.frame],
                Capsules(np.array(b.start, float), np.array(b.end, float), b.radius),
            )
            for b in model.bodies
        ),
        limits=np.radians(np.array(limits, float)),
        home=None if model.home_deg is None else np.radians(np.array(model.home_deg, float)),
        source=model.source,
    )


def _numbers(values: Float[np.ndarray, " N"], digits: int = _DIGITS) -> list[float]:
    return [round(float(v), digits) + 0.0 for v in values]


def rpy_of(R: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, " 3"]:
    """URDF's angles of a rotation, rad; where pitch is a quarter turn, only one of the others is of
    use, and yaw is 0.
    """
    pitch = math.atan2(-R[2, 0], math.hypot(R[0, 0], R[1, 0]))
    if math.hypot(R[0, 0], R[1, 0]) < 1e-9:
        return np.array([math.atan2(-R[1, 2], R[1, 1]), pitch, 0.0])
    return np.array([math.atan2(R[2, 1], R[2, 2]), pitch, math.atan2(R[1, 0], R[0, 0])])


def robot_file(robot: Robot) -> RobotFile:
    """The file that describes a robot."""
    names = robot.chain.joints
    frames = dict(enumerate(names)) | {BASE: BASE_FRAME, len(names): TCP_FRAME}
    limits = [None] * len(names) if robot.limits is None else list(np.degrees(robot.limits))

    def place(T: Float[np.ndarray, "4 4"]) -> dict[str, list[float]]:
        return {
            "xyz": _numbers(T[:3, 3]),
            "rpy_deg": _numbers(np.degrees(rpy_of(T[:3, :3])), _DIGITS_DEG),
        }

    return RobotFile(
        name=robot.name,
        source=robot.source,
        reach=round(robot.reach, _DIGITS),
        home_deg=None if robot.home is None else _numbers(np.degrees(robot.home), _DIGITS_DEG),
        tcp=TcpModel(**place(robot.chain.origin[-1])),
        joints=[
            JointModel(
                name=name,
                **place(T),
                axis=_numbers(axis),
                limits_deg=None
                if limit is None or not np.isfinite(limit).all()
                else _numbers(limit, _DIGITS_DEG),
            )
            for name, T, axis, limit in zip(
                names, robot.chain.origin[:-1], robot.chain.axis, limits, strict=True
            )
        ],
        mounts=[
            MountAxisModel(
                link=m.link,
                frame=frames[m.frame],
                start=_numbers(m.start),
                axis=_numbers(m.axis),
                zero=_numbers(m.zero),
                length=round(m.length, _DIGITS),
                usable=[m.usable[0], m.usable[1]],
                section=round(m.section, _DIGITS),
                aside=round(m.aside, _DIGITS),
                toward_deg=round(math.degrees(m.toward), _DIGITS_DEG),
            )
            for m in robot.mounts
        ],
        bodies=[
            BodyModel(
                name=b.name,
                frame=frames[b.frame],
                start=_numbers(np.asarray(b.capsule.start)),
                end=_numbers(np.asarray(b.capsule.end)),
                radius=round(b.capsule.radius, _DIGITS),
            )
            for b in robot.bodies
        ],
    )


def robot_model(robot: Robot) -> str | RobotFile:
    """A robot as a scene names it: by its name if it is built in, in-line otherwise."""
    return robot.name if built_in(robot) else robot_file(robot)
