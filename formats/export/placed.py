"""Input of every export: a setup on its robot at one pose of a scene."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...coverage.choices import BaseFrame
from ...coverage.rings.ring import Setup
from ...coverage.robots.base_frame import T_turned, base_frame
from ...coverage.robots.kinematics import forward
from ...coverage.robots.link_bodies import robot_capsules
from ...coverage.robots.robot import BASE
from ...coverage.solids.capsules import Capsules
from ...objectives.firing.schedule import FiringSchedule, firing_schedule
from ...objectives.options import FiringOptions
from ...objectives.scene import Scene
from ..robots.urdf_folding import Picked
from ..robots.urdf_matching import find_robot, moved_links, plain_names
from ..robots.urdf_model import Urdf
from ..sensors.sensor_frames import SensorFrame, sensor_frames

BASE_LINK, TCP_LINK = "base_link", "tcp"
PENDANT_LINK = "base"  # as ROS calls the frame


@dataclass(frozen=True)
class PlacedSetup:
    """A setup on the robot of a scene at one pose."""

    scene: Scene
    """The scene."""
    setup: Setup
    """The setup."""
    pose: int
    """Number of the pose."""
    folder: Path
    """Folder for the files."""
    urdf: Urdf | None = None
    """The user's URDF, if the robot comes from one."""
    packages: tuple[Path, ...] = ()
    """Folders that may hold its meshes."""
    package: Mapping[str, Path] = field(default_factory=dict)
    """Folders of its packages by name."""
    points: int = 0
    """Number of points to show in each target."""
    readings: bool = False
    """Whether a log holds what the sensors would report."""
    base: BaseFrame | None = None
    """Frame in which files state the cell; None: the robot's own base."""
    scheduled: bool = False
    """Whether firmware keeps to the firing schedule."""

    @cached_property
    def schedule(self) -> FiringSchedule | None:
        """The firing schedule at the scene's poses; None if all sensors fire at once."""
        if not self.scheduled:
            return None
        return firing_schedule(self.robot_name, self.setup, self.scene, FiringOptions())

    @cached_property
    def T_world_base(self) -> Float[np.ndarray, "4 4"]:
        """The robot's own base (4, 4) in the frame in which files state the cell.

        Raises:
            ValueError: as ``must_turn``.
        """
        return T_turned(self.scene.robot, self.base)

    @property
    def pendant_base(self) -> tuple[str, str, Float[np.ndarray, "4 4"]] | None:
        """The pendant's Base as a frame of ROS: the link that carries it, its name, and its pose
        (4, 4) m there; None unless files state the cell in it, or if the user's URDF has it.

        Raises:
            UserError: if the user's URDF lacks the robot's chain.
        """
        there = self.urdf is not None and PENDANT_LINK in self.urdf.links
        if self.base != "pendant" or base_frame(self.scene.robot) == "pendant" or there:
            return None
        return self.carrier(BASE), PENDANT_LINK, np.linalg.inv(self.T_world_base @ self.T_base_root)

    @property
    def whole(self) -> Setup:
        """The setup with the sensors of the cell."""
        return self.scene.with_cell(self.setup)

    @cached_property
    def sensors(self) -> tuple[SensorFrame, ...]:
        """Frames of all sensors in the frames of their links: of the rings, the single ones, and
        those of the cell."""
        return sensor_frames(self.scene.robot, self.whole)

    @cached_property
    def T_base_frame(self) -> Float[np.ndarray, "F 4 4"]:
        """Frames of the robot at the pose, the TCP last."""
        return np.asarray(forward(self.scene.robot.chain, self.scene.poses[self.pose].q))

    @cached_property
    def bodies(self) -> Capsules | None:
        """Bodies of the robot at the pose in the base frame; None if it has none."""
        return (
            robot_capsules(self.scene.robot, self.T_base_frame) if self.scene.robot.bodies else None
        )

    def on_link(self, sensor: SensorFrame) -> tuple[int, Float[np.ndarray, "4 4"]]:
        """Return the joint whose link carries the sensor (the last one for the TCP frame, ``BASE``
        for the base), and T_link_sensor (4, 4)."""
        return self.in_link(sensor.frame, sensor.T_frame_sensor)

    def in_link(
        self, frame: int, T_frame_part: Float[np.ndarray, "4 4"]
    ) -> tuple[int, Float[np.ndarray, "4 4"]]:
        """Return the joint whose link carries what is fixed to a frame, and its pose (4, 4) m on
        that link, as ``on_link`` does."""
        joint, T = self.in_chain(frame, T_frame_part)
        return joint, np.linalg.inv(self.T_base_root) @ T if joint == BASE else T

    def in_chain(
        self, frame: int, T_frame_part: Float[np.ndarray, "4 4"]
    ) -> tuple[int, Float[np.ndarray, "4 4"]]:
        """Return the same for files that place the robot by its chain alone, in which the base's
        link is the base frame."""
        chain = self.scene.robot.chain
        if frame < len(chain):
            return frame, T_frame_part
        return len(chain) - 1, chain.origin[-1] @ T_frame_part

    @cached_property
    def picked(self) -> Picked | None:
        """The robot's chain in the user's URDF; None without one.

        Raises:
            UserError: if the URDF describes another robot.
        """
        return None if self.urdf is None else find_robot(self.urdf, self.scene.robot)

    @cached_property
    def links(self) -> tuple[str, ...]:
        """Links that the joints move: those of the user's URDF, or generated names.

        Raises:
            UserError: if the URDF describes another robot.
        """
        return self.link_names if self.picked is None else moved_links(self.picked)[1:]

    def carrier(self, joint: int) -> str:
        """Return the name of the link that a joint moves or, for ``BASE``, of the base's link.

        Raises:
            UserError: if the user's URDF describes another robot.
        """
        if joint != BASE:
            return self.links[joint]
        return BASE_LINK if self.picked is None else self.picked.base

    @cached_property
    def T_base_root(self) -> Float[np.ndarray, "4 4"]:
        """Frame (4, 4) m of the link that holds the first joint, which a user's URDF may place
        elsewhere than the scene's base."""
        if self.picked is None:
            return np.eye(4)
        origin = self.picked.chain.origin[0]
        T: np.ndarray = self.scene.robot.chain.origin[0] @ np.linalg.inv(origin)
        return T

    def at_pose(self, frame: int) -> Float[np.ndarray, "4 4"]:
        """Return a frame (4, 4) of the robot at the pose, or the base frame for ``BASE``."""
        T: np.ndarray = np.eye(4) if frame == BASE else self.T_base_frame[frame]
        return T

    @property
    def joint_names(self) -> tuple[str, ...]:
        """ASCII names of the joints, for files that describe the robot."""
        taken = [f"{s.name}_joint" for s in self.sensors]
        return plain_names(self.scene.robot.chain.joints, [*taken, f"{TCP_LINK}_joint"])

    @property
    def link_names(self) -> tuple[str, ...]:
        """ASCII names of the links that the joints move, for use without a URDF."""
        return plain_names((f"{name}_link" for name in self.joint_names), [BASE_LINK])

    @property
    def robot_name(self) -> str:
        """ASCII name of the robot."""
        return plain_names([self.scene.robot.name])[0]
