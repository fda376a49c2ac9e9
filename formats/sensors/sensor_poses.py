"""Sensor poses in JSON: writing, and reading as rings and single sensors."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float
from pydantic import ValidationError

from ...coverage.rings.mounted_sensor import MountedSensor
from ...coverage.rings.ring import Ring, Setup
from ...coverage.robots.joint_values import joint_keys, misnamed, ordered
from ...coverage.robots.kinematics import forward
from ...coverage.robots.robot import BASE, Robot
from ...objectives.scene import CoreScene
from ..errors import UserError, explain, shown
from ..schema.result_models import joint_keys_of
from ..schema.robot_models import BASE_FRAME, TCP_FRAME
from ..schema.sensor_pose_models import (
    RingPosesModel,
    SensorPoseModel,
    SensorPosesFile,
    SinglePoseModel,
)
from ..schema.versions import FROM_FILE
from .ring_fit import TOLERANCE_DEG, TOLERANCE_MM, setup_of_frames
from .sensor_frames import SensorFrame, looking_along_z, sensor_frames
from .single_fit import link_name, single_at

_DIGITS = 12
_MOST_KEYS = 200_000  # of a file


def quaternion(T: Float[np.ndarray, "4 4"]) -> list[float]:
    """Return the rotation of a transform as x, y, z, w, with w not negative."""
    from scipy.spatial.transform import Rotation

    return [
        round(float(v), _DIGITS) + 0.0
        for v in Rotation.from_matrix(T[:3, :3]).as_quat(canonical=True)
    ]


def place(T: Float[np.ndarray, "4 4"]) -> list[float]:
    """Return the translation of a transform, m, rounded as in files."""
    return [round(float(v), _DIGITS) + 0.0 for v in T[:3, 3]]


def poses_file(scene: CoreScene, setup: Setup, pose: int) -> SensorPosesFile:
    """Return the file with a setup's sensors in the frames of their links, and in the base frame at
    a pose of the scene."""
    q, robot = scene.poses[pose].q, scene.robot
    frames, each = np.asarray(forward(robot.chain, q)), sensor_frames(robot, setup)

    def keys(s: SensorFrame) -> dict[str, Any]:
        T = s.T_frame_sensor if s.frame == BASE else frames[s.frame] @ s.T_frame_sensor
        here, there = (
            (place(s.T_frame_sensor), quaternion(s.T_frame_sensor)),
            (place(T), quaternion(T)),
        )
        names = ("xyz", "xyzw", "base_xyz", "base_xyzw")
        return {"name": s.name} | dict(zip(names, (*here, *there), strict=True))

    rings, singles = [], []
    for i, group in enumerate(setup.groups):
        some = [s for s in each if s.ring == i]
        beam, frame = group.sensor, link_name(robot, some[0].frame)
        if isinstance(group, Ring):
            poses = [SensorPoseModel(**keys(s)) for s in some]
            ring = RingPosesModel(link=group.link, frame=frame, sensor=beam, sensors=poses)
            rings.append(ring)
        else:
            singles.append(SinglePoseModel(frame=frame, sensor=beam, **keys(some[0])))
    joints = joint_keys_of(robot.chain, q)
    return SensorPosesFile(robot=robot.name, **joints, rings=rings, sensors=singles)


def _transform(xyz: Sequence[float], xyzw: Sequence[float]) -> Float[np.ndarray, "4 4"]:
    from scipy.spatial.transform import Rotation

    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.from_quat(xyzw).as_matrix(), xyz
    return T


def setup_of_poses(name: str, text: str, scene: CoreScene) -> Setup:
    """Return the setup whose sensors the JSON ``text`` lists; ``name`` is its file's, for messages.

    Raises:
        UserError: if the text is no such file, names a joint or link that the robot lacks, or
            contradicts itself.
    """
    if (found := text.count('":')) > _MOST_KEYS:
        raise UserError(f"{name}: found {found} keys, allowed: at most {_MOST_KEYS}")
    try:
        file = SensorPosesFile.model_validate_json(text, context=FROM_FILE)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        if first["type"] == "json_invalid":
            raise UserError(
                f"{name}: not JSON: {first['msg'].removeprefix('Invalid JSON: ')}"
            ) from error
        raise explain(name, error, SensorPosesFile) from error
    robot, sensors = scene.robot, []
    names = (*robot.chain.joints, TCP_FRAME)
    q = _joint_values(name, file, robot)
    frames = None if q is None else np.asarray(forward(robot.chain, q))
    for i, ring in enumerate(file.rings):
        for key, value, allowed in (("frame", ring.frame, names), ("link", ring.link, robot.links)):
            if value is not None and value not in allowed:
                raise UserError(
                    f"{name}: rings[{i}].{key}: found {shown(value)}, allowed: {', '.join(allowed)}"
                )
        frame, unit = names.index(ring.frame), ring.sensor
        for k, sensor in enumerate(ring.sensors):
            T = _transform(sensor.xyz, sensor.xyzw)
            if frames is not None and sensor.base_xyz is not None and sensor.base_xyzw is not None:
                _check_base(
                    f"{name}: rings[{i}].sensors[{k}]",
                    frames[frame] @ T,
                    _transform(sensor.base_xyz, sensor.base_xyzw),
                    "q_deg" if file.q is None else "q",
                )
            sensors.append(SensorFrame(i, k, frame, looking_along_z(T, file.beam), unit))
    links = {i: ring.link for i, ring in enumerate(file.rings) if ring.link is not None}
    fitted = setup_of_frames(name, sensors, scene, links)
    return replace(fitted, singles=(*fitted.singles, *_singles(name, file, scene, frames)))


def _singles(
    name: str, file: SensorPosesFile, scene: CoreScene, frames: Any
) -> Iterator[MountedSensor]:
    """Yield the single sensors that the file states as such."""
    robot = scene.robot
    names = (*robot.chain.joints, TCP_FRAME, BASE_FRAME)
    for i, one in enumerate(file.sensors):
        if one.frame not in names:
            raise UserError(
                f"{name}: sensors[{i}].frame: found {shown(one.frame)}, allowed: {', '.join(names)}"
            )
        frame = BASE if one.frame == BASE_FRAME else names.index(one.frame)
        T = _transform(one.xyz, one.xyzw)
        if frames is not None and one.base_xyz is not None and one.base_xyzw is not None:
            here = T if frame == BASE else frames[frame] @ T
            stated = _transform(one.base_xyz, one.base_xyzw)
            _check_base(f"{name}: sensors[{i}]", here, stated, "q_deg" if file.q is None else "q")
        yield single_at(robot, frame, looking_along_z(T, file.beam), one.sensor, one.name)


def _joint_values(name: str, file: SensorPosesFile, robot: Robot) -> Float[np.ndarray, " J"] | None:
    """Return the stated joint values (J,), rad or m; None if the file states none.

    Raises:
        UserError: if they do not belong to the robot's joints.
    """
    chain = robot.chain
    if file.q is not None:
        if (wrong := misnamed(chain, file.q)) is not None:
            raise UserError(
                f"{name}: q.{wrong[0]}: found {shown(file.q.get(wrong[0]))}, allowed: {wrong[1]}"
                f" of {robot.name}"
            )
        return ordered(chain, file.q)
    if file.q_deg is not None and (chain.prismatic or len(file.q_deg) != len(chain)):
        allowed = f"{len(chain)}, one for each joint of {robot.name}"
        if chain.prismatic:
            slides = chain.joints[chain.prismatic[0]]
            allowed = f"q with {', '.join(joint_keys(chain))}, because {slides} is prismatic"
        raise UserError(f"{name}: q_deg: found {len(file.q_deg)} angles, allowed: {allowed}")
    return None if file.q_deg is None else np.radians(file.q_deg)


def _check_base(
    where: str, T: Float[np.ndarray, "4 4"], stated: Float[np.ndarray, "4 4"], key: str
) -> None:
    """Check the stated pose of a sensor in the base frame at the joint values of ``key``.

    Raises:
        UserError: if it contradicts the pose on the link.
    """
    from scipy.spatial.transform import Rotation

    mm = 1000 * float(np.linalg.norm(T[:3, 3] - stated[:3, 3]))
    deg = math.degrees(Rotation.from_matrix(T[:3, :3].T @ stated[:3, :3]).magnitude())
    if mm > TOLERANCE_MM or deg > TOLERANCE_DEG:
        raise UserError(
            f"{where}: base_xyz and base_xyzw: found {mm:.3g} mm and {deg:.3g}° off xyz and xyzw at"
            f" {key}, allowed: {TOLERANCE_MM:g} mm and {TOLERANCE_DEG:g}°"
        )
