"""Sensor poses in JSON: writing, and reading as rings and single sensors."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Any

import numpy as np
from jaxtyping import Float
from pydantic import AfterValidator, BeforeValidator, Field, ValidationError

from ...coverage.choices import Along, BaseFrame
from ...coverage.definitions.definition import adapter, definition, fault, refuse
from ...coverage.definitions.errors import UserError, explain, unusable
from ...coverage.definitions.field_types import Items, Point, Text, as_tuple
from ...coverage.rings.mounted_sensor import MountedSensor
from ...coverage.rings.ring import Ring, Setup
from ...coverage.robots.base_frame import T_turned
from ...coverage.robots.joint_values import joint_keys, joint_keys_of, misnamed, ordered
from ...coverage.robots.kinematics import forward
from ...coverage.robots.part_tables import JointAngle
from ...coverage.robots.robot import BASE, BASE_FRAME, TCP_FRAME, Robot
from ...coverage.sensors.sensor import Sensor
from ...objectives.scene import Scene
from ..schema.versions import Versioned
from .ring_fit import TOLERANCE_DEG, TOLERANCE_MM, setup_of_frames
from .sensor_frames import SensorFrame, looking_along_z, sensor_frames
from .single_fit import link_name, single_at

_DIGITS = 12
_MOST_KEYS = 200_000  # of a file
_UNIT = 1e-3  # tolerance of the length of a quaternion
_Name = Annotated[Text, Field(min_length=1)]


def _of_length_1(xyzw: tuple[float, ...]) -> tuple[float, ...]:
    if abs(math.hypot(*xyzw) - 1) > _UNIT:
        raise fault(f"{[*xyzw]}", "a quaternion of length 1")
    return xyzw


_Component = Annotated[
    float,
    Field(ge=-1.001, le=1.001, description="component of the unit quaternion x, y, z, w"),
]
_Quaternion = Annotated[
    tuple[_Component, _Component, _Component, _Component],
    BeforeValidator(as_tuple),
    AfterValidator(_of_length_1),
]


@definition(kw_only=True)
class SensorPose:
    """Pose of a sensor in the frame of its ring's link and, optionally, in the base frame at the
    file's pose."""

    name: _Name
    """Name of the sensor."""
    xyz: Point
    """Position in the link's frame, m."""
    xyzw: _Quaternion
    """Orientation in the link's frame, quaternion x, y, z, w."""
    base_xyz: Point | None = None
    """Position in the base frame, m."""
    base_xyzw: _Quaternion | None = None
    """Orientation in the base frame, quaternion x, y, z, w."""

    def __post_init__(self) -> None:
        if (self.base_xyz is None) != (self.base_xyzw is None):
            alone = None if self.base_xyz is None else "base_xyz alone"
            refuse([(("base_xyz",), alone, "both base_xyz and base_xyzw, or neither")])


@definition(kw_only=True)
class RingPoses:
    """A ring: its link, the frame in which its sensors are stated, and its sensors."""

    link: _Name | None = None
    """Link that carries the ring, if known."""
    frame: _Name
    """Joint that moves the link, or tcp."""
    sensor: Sensor = Sensor()
    """Sensor of the ring."""
    sensors: Annotated[Items[SensorPose], Field(min_length=1, max_length=1000)]
    """Poses of the sensors."""


@definition(kw_only=True)
class PosedSensor(SensorPose):
    """A single sensor: its pose on a link, and its beam."""

    frame: _Name
    """Joint that moves the link, tcp, or base."""
    sensor: Sensor = Sensor()
    """Beam of the sensor."""


@definition(kw_only=True)
class SetupPoses:
    """Poses of sensors (JSON)."""

    robot: Text = ""
    """Name of the robot, for information only."""
    beam: Along = "z"
    """Axis of a sensor's frame along the beam."""
    base: BaseFrame | None = None
    """Frame of base_xyz for an arm of Universal Robots, as the key base of a scene."""
    q_deg: Annotated[Items[JointAngle], Field(min_length=1, max_length=20)] | None = None
    """Joint angles for base_xyz, degrees."""
    q: Annotated[dict[str, JointAngle], Field(min_length=1, max_length=20)] | None = None
    """Joint values for base_xyz by name and unit, such as shoulder_deg and rail_m, in place of
    q_deg; a robot with prismatic joints needs them."""
    rings: Annotated[Items[RingPoses], Field(max_length=1000)] = ()
    """Rings with their sensors."""
    sensors: Annotated[Items[PosedSensor], Field(max_length=1000)] = ()
    """Single sensors."""

    def __post_init__(self) -> None:
        if not self.rings and not self.sensors:
            refuse([(("rings",), None, "one ring or single sensor, or more")])
        if self.q_deg is not None and self.q is not None:
            refuse([(("q",), "both", "either q_deg or q")])
        posed = (*(s for ring in self.rings for s in ring.sensors), *self.sensors)
        unknown = self.q_deg is None and self.q is None
        if unknown and any(s.base_xyz is not None for s in posed):
            refuse([(("q_deg",), None, "the joint angles for base_xyz, degrees")])


SensorPosesFile: Any = Annotated[SetupPoses, Versioned()]
"""The file ``sensors.json``."""


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


def poses_file(scene: Scene, setup: Setup, pose: int, base: BaseFrame | None = None) -> SetupPoses:
    """Return the file with a setup's sensors in the frames of their links, and in the base frame,
    or in ``base`` of it, at a pose of the scene."""
    q, robot = scene.poses[pose].q, scene.robot
    T_world_base, each = T_turned(robot, base), sensor_frames(robot, setup)
    frames = [*(T_world_base @ np.asarray(forward(robot.chain, q))), T_world_base]  # BASE is last

    def keys(s: SensorFrame) -> dict[str, Any]:
        T = frames[s.frame] @ s.T_frame_sensor
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
            poses = tuple(SensorPose(**keys(s)) for s in some)
            rings.append(RingPoses(link=group.link, frame=frame, sensor=beam, sensors=poses))
        else:
            singles.append(PosedSensor(frame=frame, sensor=beam, **keys(some[0])))
    joints: dict[str, Any] = {"base": base, **joint_keys_of(robot.chain, q)}
    return SetupPoses(robot=robot.name, **joints, rings=tuple(rings), sensors=tuple(singles))


def _transform(xyz: Sequence[float], xyzw: Sequence[float]) -> Float[np.ndarray, "4 4"]:
    from scipy.spatial.transform import Rotation

    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.from_quat(xyzw).as_matrix(), xyz
    return T


def setup_of_poses(name: str, text: str, scene: Scene) -> Setup:
    """Return the setup whose sensors the JSON ``text`` lists; ``name`` is its file's, for messages.

    Raises:
        UserError: if the text is no such file, names a joint or link that the robot lacks, or
            contradicts itself.
    """
    if (count := text.count('":')) > _MOST_KEYS:
        raise UserError(f"{name}: found {count} keys, allowed: at most {_MOST_KEYS}")
    try:
        file: SetupPoses = adapter(SensorPosesFile).validate_json(text)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        if first["type"] == "json_invalid":
            raise UserError(
                f"{name}: not JSON: {first['msg'].removeprefix('Invalid JSON: ')}"
            ) from error
        raise explain(name, error, SensorPosesFile) from error
    robot, sensors, singles = scene.robot, [], list[MountedSensor]()
    names, frames = (*robot.chain.joints, TCP_FRAME), np.eye(4)[None]
    try:
        T_base_world = T_turned(robot, file.base)
    except ValueError as error:
        raise unusable(f"{name}: base", file.base, str(error)) from error
    q = _joint_values(name, file, robot)
    if q is not None:  # the base comes last, which is BASE
        frames = np.concatenate([np.asarray(forward(robot.chain, q)), frames])

    def posed(key: str, stated: SensorPose, frame: int) -> Float[np.ndarray, "4 4"]:
        """Return the pose in its frame of a sensor that looks along z."""
        T = _transform(stated.xyz, stated.xyzw)
        if q is not None and stated.base_xyz is not None and stated.base_xyzw is not None:
            there = T_base_world @ _transform(stated.base_xyz, stated.base_xyzw)
            at = "q_deg" if file.q is None else "q"
            _check_base(f"{name}: {key}", frames[frame] @ T, there, at)
        return looking_along_z(T, file.beam)

    for i, ring in enumerate(file.rings):
        for key, value, allowed in (("frame", ring.frame, names), ("link", ring.link, robot.links)):
            if value is not None and value not in allowed:
                raise unusable(f"{name}: rings[{i}].{key}", value, ", ".join(allowed))
        frame, unit = names.index(ring.frame), ring.sensor
        for k, stated in enumerate(ring.sensors):
            T = posed(f"rings[{i}].sensors[{k}]", stated, frame)
            sensors.append(SensorFrame(i, k, frame, T, unit))
    for i, one in enumerate(file.sensors):
        if one.frame not in (*names, BASE_FRAME):
            listed = ", ".join((*names, BASE_FRAME))
            raise unusable(f"{name}: sensors[{i}].frame", one.frame, listed)
        frame = BASE if one.frame == BASE_FRAME else names.index(one.frame)
        T = posed(f"sensors[{i}]", one, frame)
        singles.append(single_at(robot, frame, T, one.sensor, one.name))
    links = {i: ring.link for i, ring in enumerate(file.rings) if ring.link is not None}
    fitted = setup_of_frames(name, sensors, scene, links)
    return replace(fitted, singles=(*fitted.singles, *singles))


def _joint_values(name: str, file: SetupPoses, robot: Robot) -> Float[np.ndarray, " J"] | None:
    """Return the stated joint values (J,), rad or m; None if the file states none.

    Raises:
        UserError: if they do not belong to the robot's joints.
    """
    chain = robot.chain
    if file.q is not None:
        if (wrong := misnamed(chain, file.q)) is not None:
            raise unusable(
                f"{name}: q.{wrong[0]}", file.q.get(wrong[0]), f"{wrong[1]} of {robot.name}"
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
