"""A sensor: its beam and its use."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

import numpy as np
from jaxtyping import Bool
from pydantic import Field
from pydantic_core import PydanticCustomError

from ..definitions.definition import Fault, definition, fields_of, refuse
from ..definitions.errors import InFile
from ..definitions.field_types import Metres
from ..definitions.units import INLINE, Degrees, degrees
from ..solids.beams import WIDE, BeamShape, InBeam, Place, Sizes
from ..solids.sensor_beams import shape_of
from .boards import Board
from .effective_range import Step, Use, model_of, steps
from .sensor_model import Model

Shape = Literal["beam", "dome", "fan", "frustum"]
_SAME = 1e-6  # degrees and metres
# The catalogue may become more precise; a file keeps a beam that it states and that is as near to
# the catalogue's as this: degrees of an angle, and a share of a range.
_CLOSE_ANGLE, _CLOSE_RANGE = 0.2, 0.02


@definition
class Sensor:
    """A sensor whose beam is a cone or a pyramid, a dome, a fan or a frustum.

    In a file a model with its operating conditions determines the beam. A file may state both if
    they agree; files that place-rings writes do. A square beam with neither a model nor a number of
    zones counts as one zone, so that coverage is not overstated.
    """

    fov: Annotated[float, Degrees("fov_deg", gt=0, le=360)] = math.radians(25)
    """Full field of view, rad: below 180°, of a dome up to 180°, of a fan up to 360°; of a frustum
    its divergence."""
    range_m: Metres = 1.5
    """Range, m; a cone or pyramid ends in a plane across its axis there."""
    use: Annotated[Use | None, INLINE] = None
    """The use from which the range of a model follows; None for other sensors."""
    fov_up: Annotated[float, Degrees("fov_up_deg", gt=0, lt=180)] | None = None
    """Full field of view along the ring's axis (tilted with the sensor), rad, for a square beam;
    omit for a round beam."""
    zones: Annotated[int, Field(ge=1, le=1000)] = 1
    """Zones in a row of a square beam, each with its own reading; 1: one reading for the whole
    beam."""
    board: Board | None = None
    """Board that carries the sensor; default: the catalogue's, if it has one."""
    shape: Shape = "beam"
    """beam: a cone or pyramid; dome: a cone that ends in a ball about its apex, as of a capacitive
    pad; fan: a sector across up, as of a laser scanner; frustum: a round beam that is as wide as an
    aperture where it begins, as of a laser distance sensor, a light curtain or ultrasound."""
    thickness: Metres | None = None
    """Thickness of a fan, or diameter of a frustum's aperture, m."""
    near_m: Annotated[float, Field(ge=0, le=100)] = 0.0
    """Distance along the axis at which a cone or pyramid begins, m."""

    def __post_init__(self) -> None:
        """Refuse values that do not belong to the shape."""
        shape, form = self.shape, self.form
        fov, faults = degrees(self.fov), list[Fault]()
        none = f"no such key for a {shape}"
        if self.use is not None and not form.ends_flat:
            faults.append((("shape",), shape, "beam, the shape of all models"))
        most, limit = form.most_deg
        if fov > most or (fov == most and limit.startswith("below")):
            allowed = f"a number above 0 and {limit} (full field of view, degrees)"
            faults.append((("fov_deg",), fov, allowed))
        if self.fov_up is not None and not form.square:
            faults.append((("fov_up_deg",), degrees(self.fov_up), none))
        if form.thick != (self.thickness is not None):
            allowed = f"the thickness of the {shape}, m" if form.thick else none
            faults.append((("thickness",), self.thickness, allowed))
        if self.near_m >= self.range_m or (self.near_m > 0 and not form.ends_flat):
            allowed = "below range_m" if form.ends_flat else none
            faults.append((("near_m",), self.near_m, allowed))
        if self.zones > 1 and self.fov_up is None:
            faults.append((("zones",), self.zones, "1 for a round beam; more only with fov_up_deg"))
        refuse(faults)

    @classmethod
    def _of_table(cls, table: dict[str, Any]) -> dict[str, Any]:
        """Return a table with the beam of its model under its conditions; a stated one is kept if
        it is close."""
        if (use := table.get("use")) is None:
            return table
        try:
            sensor = effective(use).sensor
        except ValueError as error:
            raise PydanticCustomError("rule", "{error}", {"error": str(error)}) from error
        beam: dict[str, tuple[Any, Any, float]] = {
            "fov_deg": (sensor.fov, math.degrees(sensor.fov), _CLOSE_ANGLE),
            "range_m": (sensor.range_m, sensor.range_m, _CLOSE_RANGE * sensor.range_m),
            "zones": (sensor.zones, sensor.zones, _SAME),
        }
        if sensor.fov_up is not None:
            beam["fov_up_deg"] = sensor.fov_up, math.degrees(sensor.fov_up), _CLOSE_ANGLE
        elif (up := table.pop("fov_up_deg", None)) is not None:
            allowed = f"no such key, because the beam of {use.name} is round"
            refuse([(("fov_up_deg",), _number(up), allowed)])
        for key, (value, of_file, close) in beam.items():
            stated = _number(table.get(key))
            if stated is None:
                table[key] = value
            elif isinstance(stated, int | float):  # the validation of the field refuses others
                if not abs(stated - of_file) <= close:
                    allowed = f"{of_file:.9g}, the value of {use.name} here, or omit the key"
                    refuse([((key,), stated, allowed)])
                if abs(stated - of_file) <= _SAME:
                    table[key] = value
        return table | {"board": table.get("board") or sensor.board}

    def _as_table(self, table: dict[str, Any]) -> dict[str, Any]:
        """Return a table with its keys in the order of files, without the board of the model."""
        known = None if self.use is None else effective(self.use).sensor.board
        board = {"board": table.pop("board")} if "board" in table else {}
        if self.board == known:
            board = dict.fromkeys(board)
        last = {key: table.pop(key) for key in ("shape", "thickness", "near_m") if key in table}
        own = {k: table.pop(k) for k in fields_of(Use) if k in table}
        return table | own | last | board

    def __repr__(self) -> str:
        up = "" if self.fov_up is None else f", fov_up={self.fov_up:.6g}, zones={self.zones}"
        use = "" if self.use is None else f", use={self.use!r}"
        shape = "" if self.form.ends_flat else f", shape={self.shape!r}"
        shape += "" if self.thickness is None else f", thickness={self.thickness:g}"
        shape += f", near_m={self.near_m:g}" if self.near_m else ""
        return f"Sensor(fov={self.fov:.6g}, range_m={self.range_m:.4g}{up}{shape}{use})"

    @property
    def form(self) -> type[BeamShape]:
        """The shape of the beam, which knows all that follows from it."""
        return shape_of(self.shape, self.fov_up is not None)

    @property
    def rows(self) -> int:
        """Number of rows of zones: that of the model, or as many as zones in a row."""
        model = None if self.use is None else model_of(self.use)
        return model.rows if model is not None and model.zones == self.zones else self.zones

    @property
    def sizes(self) -> Sizes:
        """The sizes of the beam, for the functions of its shape."""
        size = self.form.size_of(self)
        return Sizes(*map(np.float64, (self.half_angle, self.range_m, size)))

    def holds(self, at: Place) -> Bool[np.ndarray, "*shape"]:
        """Return which points lie in the beam, without occlusion: 32-bit coordinates, to about 1e-6
        m."""
        terms = self.form.terms(Sizes(*map(np.float32, self.sizes)))
        inside: np.ndarray = self.form.function(at, *terms) <= 0
        return inside & (at.along >= np.float32(self.near_m)) if self.near_m else inside

    def nearest(self, at: InBeam) -> InBeam:
        """Return the points of the beam nearest to points in its frame, without occlusion."""
        return self.form.nearest(at, Sizes(*map(np.float32, self.sizes)), self.near_m)

    @property
    def square(self) -> bool:
        """Whether the beam is a pyramid."""
        return self.form.square

    @property
    def special(self) -> bool:
        """Whether the beam is more than a cone or pyramid from the apex on."""
        return not self.form.ends_flat or self.near_m > 0

    @property
    def plain(self) -> bool:
        """Whether the beam is a cone from the apex on."""
        return not self.square and not self.special

    @property
    def oriented(self) -> bool:
        """Whether the beam has an ``up``: that of a pyramid or fan has, a round one has not."""
        return self.form.oriented

    @property
    def zoned(self) -> bool:
        """Whether an occluder in a part of the beam leaves the others as they are: each zone of a
        pyramid reports its own distance, a fan measures in each direction, and a dome is no
        distance measurement."""
        return self.zones > 1 or not self.form.ends_flat

    @property
    def separations(self) -> tuple[float, ...]:
        """For each target that the sensor can report, the least distance, m, from the end of one
        body in its beam to the next target; infinite for the last one. A model without a stated
        separation reports one target."""
        model = None if self.use is None else model_of(self.use)
        if model is None or model.separation_m is None:
            return (math.inf,)
        return (model.separation_m,) * ((model.targets or 1) - 1) + (math.inf,)

    @property
    def half_angle(self) -> float:
        """Half angle of the beam along its ring, rad; for a cone in every direction."""
        return self.fov / 2

    @property
    def half_angle_up(self) -> float:
        """Half angle of a square beam along its ring's axis, rad; 0 for a cone."""
        return 0.0 if self.fov_up is None else self.fov_up / 2

    @property
    def inscribed_half_angle(self) -> float:
        """Half angle of the beam's inscribed cone, rad: the smaller one of a pyramid's or fan's."""
        return float(self.form.inner(self.sizes))

    @property
    def aperture(self) -> float:
        """Radius of a round beam where it begins, m: that of a frustum's aperture, or 0."""
        return float(self.form.aperture(self.sizes))

    @property
    def outer_angle(self) -> float:
        """Half angle of a cone from the apex that holds the beam, rad; pi where none does that is
        no wider than a half-space."""
        return float(self.form.outer(self.sizes))

    @property
    def circumscribed_half_angle(self) -> float:
        """Half angle of the circumscribed cone, rad; it passes through a pyramid's corners.

        That of a dome or fan is limited: no cone holds a half ball.
        """
        return self.outer_angle if self.form.ends_flat else min(self.outer_angle, WIDE)

    def with_angles(self, change: Callable[[float], float]) -> "Sensor":
        """Return the sensor with ``change`` applied to each of its full angles, rad."""
        up = None if self.fov_up is None else change(self.fov_up)
        return replace(self, fov=change(self.fov), fov_up=up)

    @property
    def farthest(self) -> float:
        """Distance from the apex to the farthest point of the beam, m."""
        return float(self.form.farthest(self.sizes))

    @property
    def volume(self) -> float:
        """Volume of the beam, m^3; 0.1737 for the paper's sensor."""
        return float(self.form.volume(self.sizes, self.near_m))

    @property
    def text(self) -> str:
        """The beam in a few words."""
        up = "" if self.fov_up is None else f" × {math.degrees(self.fov_up):.3g}°"
        return f"{self.form.title} of {math.degrees(self.fov):.3g}°{up}, {self.range_m:.3g} m"


@dataclass(frozen=True)
class Effective:
    """A sensor for a use, and the derivation of its range."""

    model: Model
    """The model, of the catalogue or the user's own."""
    use: Use
    """The use."""
    steps: tuple[Step, ...]
    """The applied rules; the range of the last one is used."""

    @property
    def range_m(self) -> float:
        return self.steps[-1].range_m

    @property
    def sensor(self) -> Sensor:
        """The resulting sensor."""
        m = self.model
        along, up = (math.radians(side) for side in m.sides_deg)
        return Sensor(along, self.range_m, self.use, up if m.square else None, m.zones, m.board)


def effective(use: Use) -> Effective:
    """Return the effective range of a sensor for ``use``.

    Raises:
        ValueError: if the light has no figure.
    """
    return Effective(model_of(use), use, steps(use))


PAPER_SENSOR = Sensor()


def _number(value: Any) -> Any:
    """Return the number that a file states."""
    return value.value if isinstance(value, InFile) else value
