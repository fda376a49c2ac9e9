"""The file of a target, for ``--target`` (TOML)."""

from typing import Annotated

from pydantic import Field

from ...coverage.choices import BaseFrame
from ...coverage.definitions.definition import definition
from ...coverage.definitions.records import FILE_VERSION
from ...coverage.robots.base_frame import must_turn
from ...coverage.robots.robot import Robot
from ...coverage.targets.combined import TargetTable
from ...coverage.targets.target import Target


@definition(kw_only=True)
class TargetFile(TargetTable):
    """A target of one's own, for ``--target`` (TOML)."""

    base: BaseFrame | None = None
    """Frame of its coordinates, as the key base of a scene."""
    version: Annotated[
        int, Field(ge=1, json_schema_extra={"default": 1, "maximum": FILE_VERSION})
    ] = FILE_VERSION
    """Version of the meaning of the keys; 1 if absent."""

    def on(self, robot: Robot) -> Target:
        """Return the target with coordinates in the robot's own base.

        Raises:
            ValueError: if the robot has no such base.
        """
        return self.target().turned() if must_turn(robot, self.base) else self.target()
