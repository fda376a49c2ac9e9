"""Model of the table ``[calibration]`` in a scene: where the joints of one arm really lie."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Annotated, Self

import numpy as np
from pydantic import Field

from ...coverage.definitions.definition import Fault
from ...coverage.robots.calibration import frames_differ
from ...coverage.robots.robot import Robot
from .base_model import StrictModel
from .chain_models import TcpModel, place_of, written_place


class CalibrationModel(StrictModel):
    """The calibrated kinematics of one arm, in place of those of its model.

    A scene may name a file instead: ``calibration.conf`` of a controller of Universal Robots, or
    ``kinematics.yaml`` of its ROS description.
    """

    source: str = Field(
        default="", max_length=1000, description="file or controller that stated the calibration"
    )
    joints: Annotated[list[TcpModel], Field(min_length=1, max_length=20)] = Field(
        description="place of each joint in the frame before it, as in a robot file"
    )
    tcp: TcpModel = Field(description="tool centre point in the last joint's frame")

    def faults(self, robot: Robot) -> Iterator[Fault]:
        """Yield a number of joints other than the robot's, and joints that differ too much."""
        wanted = len(robot.chain)
        if len(self.joints) != wanted:
            yield ("calibration", "joints"), len(self.joints), f"{wanted}, as {robot.name} has"
        elif (reason := frames_differ(robot.chain, self._origin)) is not None:
            yield ("calibration",), reason, f"the calibration of a {robot.name}"

    @property
    def _origin(self) -> np.ndarray:
        return np.stack([place_of(place) for place in (*self.joints, self.tcp)])

    def applied(self, robot: Robot) -> Robot:
        """Return a robot with this calibration."""
        return robot.calibrated(replace(robot.nominal.chain, origin=self._origin), self.source)

    @classmethod
    def of(cls, robot: Robot) -> Self | None:
        """Return the table of a robot's calibration; None for that of its model."""
        if robot.calibration is None:
            return None
        places = [TcpModel(**written_place(T)) for T in robot.chain.origin]
        return cls(source=robot.calibration.source, joints=places[:-1], tcp=places[-1])
