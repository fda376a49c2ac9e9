"""The options of an export: defined once, for Python and the command."""

from dataclasses import dataclass
from typing import Annotated

from ...coverage.choices import BaseFrame, Bus
from ...coverage.definitions.options import Options, Whole
from ...coverage.electronics.controllers import ControllerName


@dataclass(frozen=True, kw_only=True)
class BaseFrameOptions(Options):
    """The frame in which an export, or a twin, has the cell."""

    base_frame: BaseFrame | None = None
    """Frame in which the robot and the cell stand, for an arm of Universal Robots: base_link, or
    pendant, which is turned by 180° about z. Default: the robot's own base, as in scenes."""


@dataclass(frozen=True, kw_only=True)
class ExportOptions(BaseFrameOptions):
    """Options of an export."""

    pose: Annotated[int, Whole(0)] = 0
    """Number of the scene's pose to export, from 0."""
    points: Annotated[int, Whole(0, 1_000_000)] = 0
    """Number of points of each target to draw in a glb, coloured by coverage."""
    board: ControllerName | None = None
    """Controller board of each ring, for firmware. Default: the scene's."""
    scheduled: bool = False
    """Let no two sensors fire together that may disturb each other: the firmware starts each in its
    slot of the firing schedule (``place-rings schedule``), which is written beside it. Default: all
    fire at once."""
    readings: bool = False
    """In an mcap, also what the sensors would report, from a twin in MuJoCo (extra mujoco)."""
    wiring: Bus | None = None
    """How the sensors of a ring share its I2C bus, for firmware: direct (each XSHUT on a pin),
    multiplexer (each sensor on a channel), or auto (direct where the bus bears it). Default: the
    scene's."""
