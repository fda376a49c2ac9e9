"""Answers to a question of the benchmark in CSV: one ring a row, below comment lines that state
what the answer is and how it was counted."""

import csv
import io
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import tomli_w
from pydantic import Field

from ...coverage.definitions.definition import adapter, definition, fields_of
from ...coverage.definitions.errors import UserError, key_path, shown, unusable
from ...coverage.definitions.field_types import Text
from ...coverage.rings.ring import Ring, Setup
from ...coverage.rings.rounding import rounded, setup_faults, table_of
from ...coverage.rings.surface_lift import lift_to_surface
from ...coverage.sensors.sensor import Sensor
from ...objectives.feasibility.clearance import MountClearance
from ...objectives.named_layouts import ring_radii
from ...objectives.scene import Scene
from ..csv_rows import csv_rows
from ..loader import resolve
from ..schema.base_model import Percent, StrictModel
from ..user_files import read_text
from ..writing import without_none
from .csv_poses import MARK, columns_of, headed, read_csv


class EntryModel(StrictModel):
    """What the comment lines of an answer may state; each key may be left out."""

    question: str | None = Field(default=None, description="name of the question")
    version: int | None = Field(default=None, ge=1, description="version of the questions")
    by: str | None = Field(default=None, max_length=300, description="who or what found it")
    seed: int | None = Field(default=None, description="random seed")
    processor_s: float | None = Field(default=None, ge=0, description="processor time, s")
    percent: Percent | None = Field(default=None, description="counted value, percent")


@definition(kw_only=True)
class RingRow:
    """A row of an answer: one ring."""

    link: Annotated[Text, Field(min_length=1)]
    """Link that carries the ring."""
    position: Annotated[float, Field(ge=0, le=1)]
    """Position along the mount axis, from 0 proximal to 1 distal."""
    count: Annotated[int, Field(ge=1, le=1000)]
    """Number of sensors."""
    tilt_deg: Annotated[float, Field(gt=-90, lt=90)]
    """Angle of the sensors' axes out of the ring's plane, positive towards distal, degrees."""
    phase_deg: Annotated[float, Field(ge=-360, le=360)]
    """Angle of the first sensor about the mount axis, degrees."""


COLUMNS = fields_of(RingRow)
RADIUS_M = 1e-4
"""By how much a file may round a ring's radius, m."""
_BEAM = 1e-6  # m and rad, by which it may round a beam
_MOST = 1000  # rings


def read_head(path: Path) -> EntryModel:
    """Return what an answer in CSV states about itself.

    Raises:
        UserError: if the file is not usable.
    """
    return headed(str(path), read_text(path, "CSV"), EntryModel)[0]


def read_entry(path: Path, scene: Scene) -> tuple[EntryModel, Setup]:
    """Return what an answer states about itself, and its setup in the scene of its question.

    The answer is a CSV of rings, a CSV of sensors as ``place-rings cones`` prints it, a layout in
    CSV, or any other file with a setup that commands read. A ring whose radius and beam are those
    of the scene has the scene's own, whatever else the file states of it.

    Raises:
        UserError: if the file is not usable, or does not fit the scene's robot.
    """
    name = str(path)
    radii = ring_radii(scene, MountClearance(scene) if scene.real else None)
    if path.suffix.lower() != ".csv":
        return EntryModel(), _of_scene(resolve(name, scene)[0], scene, radii)
    text = read_text(path, "CSV")
    columns = columns_of(text)
    if {"name", "axis_x"} <= columns:
        return EntryModel(), _layout(name, text, scene)
    about, rest, above = headed(name, text, EntryModel)
    if "apex_x" in columns:
        from ..sensors.sensor_lists import mounted_setup

        return about, _of_scene(mounted_setup(name, rest, scene), scene, radii)
    allowed = f"the columns {','.join(COLUMNS)}"
    rows = csv_rows(name, rest, (RingRow,), allowed, above, what="ring")
    if len(rows) > _MOST:
        raise UserError(f"{name}: found {len(rows)} rings, allowed: at most {_MOST}")
    rings = tuple(_ring(f"{name}: line {n}", row, scene, radii) for n, row in rows)
    return about, rounded(Setup(rings), scene.sensor)


def _ring(where: str, row: RingRow, scene: Scene, radii: Mapping[str, float]) -> Ring:
    """Return the ring of a row."""
    if row.link not in radii:
        raise UserError(f"{where}: link: found {shown(row.link)}, allowed: {', '.join(radii)}")
    keys = {key: getattr(row, key) for key in COLUMNS}
    ring: Ring = adapter(Ring).validate_python(keys | {"radius": radii[row.link]})
    return replace(ring, sensor=scene.sensor_of(row.link))


def _of_scene(setup: Setup, scene: Scene, radii: Mapping[str, float]) -> Setup:
    """Return a setup as an answer states it: rounded, and with the radius and the sensor of the
    scene on each ring that has this radius and this beam."""

    def own(ring: Ring) -> Ring:
        sensor, radius = scene.sensor_of(ring.link), radii[ring.link]
        if abs(ring.radius - radius) <= RADIUS_M:
            ring = replace(ring, radius=radius)
        return replace(ring, sensor=sensor) if _same_beam(ring.sensor, sensor) else ring

    rings = rounded(setup, scene.sensor).rings
    return Setup(tuple(map(own, rings)), setup.singles)


def _same_beam(a: Sensor, b: Sensor) -> bool:
    return (a.form, a.near_m) == (b.form, b.near_m) and np.allclose(a.sizes, b.sizes, 0, _BEAM)


def _layout(name: str, text: str, scene: Scene) -> Setup:
    """Return the single sensors of a layout in CSV, in the scene of a question."""
    about, sensors = read_csv(name, text)
    if about.robot != scene.robot.name:
        raise UserError(f"{name}: robot: found {shown(about.robot)}, allowed: {scene.robot.name}")
    setup = Setup((), sensors)
    for where, value, allowed in setup_faults(setup, scene.robot, scene.sensor):
        raise unusable(f"{name}: {key_path(where)}", value, allowed)
    if about.lift_mm:
        setup, _ = lift_to_surface(scene.robot, setup, about.lift_mm / 1000)
    return setup


def entry_csv(about: EntryModel, setup: Setup, scene: Scene) -> str:
    """Return an answer in rings as CSV.

    Raises:
        ValueError: if the setup has single sensors.
    """
    if setup.singles:
        raise ValueError("an answer in rings has no single sensors")
    text = io.StringIO(newline="")
    keys = tomli_w.dumps(without_none(about.model_dump()))
    text.write("".join(f"{MARK} {line}\n" for line in keys.splitlines()))
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for ring in table_of(setup, scene.sensor)["rings"]:
        writer.writerow([ring[key] for key in COLUMNS])
    return text.getvalue()
