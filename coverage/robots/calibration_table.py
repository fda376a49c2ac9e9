"""The table ``[calibration]`` of a scene: where the joints of one arm really lie."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Annotated, Self

import numpy as np
from jaxtyping import Float
from pydantic import Field

from ..definitions.definition import Fault, definition
from ..definitions.field_types import Items
from .calibration import frames_differ
from .part_tables import PlaceTable, place_of, written_place
from .robot import Robot


@definition(kw_only=True)
class CalibrationTable:
    """The calibrated kinematics of one arm, in place of those of its model.

    A scene may name a file instead: ``calibration.conf`` of a controller of Universal Robots, or
    ``kinematics.yaml`` of its ROS description.
    """

    source: Annotated[str, Field(max_length=1000)] = ""
    """File or controller that stated the calibration."""
    joints: Annotated[Items[PlaceTable], Field(min_length=1, max_length=20)]
    """Place of each joint in the frame before it, as in a robot file."""
    tcp: PlaceTable
    """Tool centre point in the last joint's frame."""

    def faults(self, robot: Robot) -> Iterator[Fault]:
        """Yield a number of joints other than the robot's, and joints that differ too much."""
        chain = robot.nominal.chain
        if len(self.joints) != len(chain):
            wanted = f"{len(chain)}, as {robot.name} has"
            yield ("calibration", "joints"), len(self.joints), wanted
        elif (reason := frames_differ(chain, self._origin)) is not None:
            yield ("calibration",), reason, f"the calibration of a {robot.name}"

    @property
    def _origin(self) -> Float[np.ndarray, "F 4 4"]:
        return np.stack([place_of(place) for place in (*self.joints, self.tcp)])

    def applied(self, robot: Robot) -> Robot:
        """Return a robot with this calibration."""
        return robot.calibrated(replace(robot.nominal.chain, origin=self._origin), self.source)

    @classmethod
    def of(cls, robot: Robot) -> Self | None:
        """Return the table of a robot's calibration; None for that of its model."""
        if robot.calibration is None:
            return None
        *joints, tcp = (PlaceTable(**written_place(T)) for T in robot.chain.origin)
        return cls(source=robot.calibration.source, joints=tuple(joints), tcp=tcp)
