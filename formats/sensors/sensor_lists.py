"""Sensor lists in CSV: writing, and fitting rings to them.

The list is the output of ``place-rings cones``, in the base frame at the scene's poses.
"""

import csv
import io
import math
from collections.abc import Sequence
from typing import Annotated

import numpy as np
from pydantic import Field

from ...coverage.definitions.definition import definition, fields_of
from ...coverage.definitions.errors import UserError
from ...coverage.definitions.field_types import Coordinate, Metres
from ...coverage.rings.ring import Setup
from ...coverage.rings.ring_kinematics import sensor_cones
from ...coverage.robots.kinematics import forward
from ...coverage.sensors.sensor import Sensor, Shape
from ...objectives.scene import Scene
from ..csv_rows import csv_rows
from .ring_fit import SensorAtPose, fitted_setup

_DIGITS = 9  # decimals of metres and of unit vectors
_Index = Annotated[int, Field(ge=0, le=999)]
_Part = Annotated[float, Field(ge=-1.001, le=1.001)]  # of a unit vector in the base frame


@definition(kw_only=True)
class ConeRow:
    """A row of ``place-rings cones``: one sensor at one pose, in the base frame."""

    pose: Annotated[int, Field(ge=0, lt=10_000)]
    """Number of the pose, counted from 0."""
    ring: _Index
    """Number of the ring, counted from 0."""
    sensor: _Index
    """Number of the sensor, counted from 0."""
    apex_x: Coordinate
    apex_y: Coordinate
    apex_z: Coordinate
    axis_x: _Part
    axis_y: _Part
    axis_z: _Part
    fov_deg: Annotated[float, Field(gt=0, lt=180)]
    """Full field of view, degrees."""
    range_m: Metres
    """Range, m."""


@definition(kw_only=True)
class SquareConeRow(ConeRow):
    """A row in a file with square beams: also the full angle along ``up``, 0 for a round beam, and
    ``up`` itself."""

    fov_up_deg: Annotated[float, Field(ge=0, lt=180)]
    """Full field of view along up, degrees; 0: a round beam."""
    up_x: _Part
    up_y: _Part
    up_z: _Part


@definition(kw_only=True)
class SpecialConeRow(SquareConeRow):
    """A row in a file with other shapes or with beams that begin at a distance: also the shape, its
    thickness (0 where it states none), and that distance."""

    fov_deg: Annotated[float, Field(gt=0, le=360)]
    """Full field of view, degrees."""
    shape: Shape
    """Shape of the beam."""
    thickness_m: Annotated[float, Field(ge=0, le=100)]
    """Thickness of a fan, or of a frustum's aperture, m; 0: none."""
    near_m: Annotated[float, Field(ge=0, le=100)]
    """Distance along the axis at which a cone or pyramid begins, m."""


COLUMNS, SQUARE_COLUMNS = fields_of(ConeRow), fields_of(SquareConeRow)
SPECIAL_COLUMNS = fields_of(SpecialConeRow)


def sensor_list(setup: Setup, scene: Scene, poses: Sequence[int] | None = None) -> str:
    """Return the beams of all sensors at poses of the scene (by default all) as CSV in the base
    frame.

    Each single sensor has a number of its own among those of the rings, after them.

    If some beams are square, four columns are added: the full angle along ``up`` (0 for a cone),
    and ``up`` itself. If some are domes, fans or begin at a distance, three more are added.
    """
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    sensors = [group.sensor for group in setup.groups for _ in range(group.count)]
    special = any(sensor.special for sensor in sensors)
    plain = all(sensor.plain for sensor in sensors)
    writer.writerow(SPECIAL_COLUMNS if special else COLUMNS if plain else SQUARE_COLUMNS)
    for p in range(len(scene.poses)) if poses is None else poses:
        c = sensor_cones(scene.robot, setup, scene.poses[p].q)
        for n, (i, k) in enumerate(setup.labels):
            values = [*c.apex[n], *c.axis[n], 2 * np.degrees(c.half_angle[n]), c.range_m[n]]
            if c.up is not None:
                values += [2 * math.degrees(sensors[n].half_angle_up), *c.up[n]]
            row: list[float | str] = [p, i, k, *(round(float(v), _DIGITS) + 0.0 for v in values)]
            if special:
                row += [sensors[n].shape, sensors[n].thickness or 0.0, sensors[n].near_m]
            writer.writerow(row)
    return text.getvalue()


def mounted_setup(name: str, text: str, scene: Scene) -> Setup:
    """Return the setup whose sensors the CSV ``text`` lists; ``name`` is its file's, for messages.

    Raises:
        UserError: if the text is no such list, or the sensors of a ring form no ring on any link of
            the robot.
    """
    square = ",".join(SQUARE_COLUMNS[len(COLUMNS) :])
    allowed = f"the columns {','.join(COLUMNS)}, and for square beams {square}"
    rows = csv_rows(name, text, (ConeRow, SquareConeRow, SpecialConeRow), allowed)
    frames = [np.asarray(forward(scene.robot.chain, pose.q)) for pose in scene.poses]
    for line, row in rows:
        if row.pose >= len(frames):
            raise UserError(
                f"{name}: line {line}: pose: found {row.pose}, allowed: 0 to {len(frames) - 1}, the"
                " scene's poses"
            )
    return fitted_setup(name, [_reading(name, row) for _, row in rows], frames, scene)


def _reading(name: str, row: ConeRow) -> SensorAtPose:
    """Return a row's sensor at its pose; raise a UserError for a beam that cannot be."""
    square = row if isinstance(row, SquareConeRow) else None
    shaped = row if isinstance(row, SpecialConeRow) else None
    up = square.fov_up_deg if square else 0.0
    try:
        unit = Sensor(
            math.radians(row.fov_deg),
            row.range_m,
            fov_up=math.radians(up) if up > 0 else None,
            shape=shaped.shape if shaped else "beam",
            thickness=(shaped.thickness_m or None) if shaped else None,
            near_m=shaped.near_m if shaped else 0.0,
        )
    except ValueError as error:
        raise UserError(f"{name}: ring {row.ring}: {error}") from error
    T = np.zeros((3, 3))
    for column, key in enumerate(("up", "axis", "apex")):
        T[:, column] = [getattr(row, f"{key}_{x}", 0.0) for x in "xyz"]
    return SensorAtPose(row.pose, row.ring, row.sensor, T, unit)
