"""Model of a volume of one's own: a solid, a mesh, or a combination of volumes."""

import math
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from ...coverage.targets import NAMES, WITH_RADIUS
from ...coverage.volumes import (
    MOST_FACES,
    OWN,
    RULES,
    BallVolume,
    BoxVolume,
    CombinedVolume,
    CylinderVolume,
    HalfSpaceVolume,
    MeshVolume,
    NamedVolume,
    Volume,
)
from ..errors import UserError
from .base_model import StrictModel, fault
from .field_types import FARTHEST, THREE, Angles, Metres
from .mapping import rounded_degrees

_BaseCoordinate = Annotated[
    float, Field(ge=-FARTHEST, le=FARTHEST, description="coordinate in the base frame, m")
]
_BasePoint = Annotated[list[_BaseCoordinate], THREE]
_Component = Annotated[float, Field(ge=-FARTHEST, le=FARTHEST, description="component")]
_ANGLE = rounded_degrees(9)
Kind = Literal[
    "box",
    "cylinder",
    "sphere",
    "half_space",
    "mesh",
    "union",
    "difference",
    "intersection",
    "V_O",
    "V_T",
    "V_OT",
    "V_S",
    "V_N",
    "V_P",
    "V_R",
]
_PLACED = ("centre", "rpy_deg")
# keys that each kind needs, and keys that it may have
_KEYS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "box": (("size",), _PLACED),
    "cylinder": (("radius", "height"), _PLACED),
    "sphere": (("radius",), ("centre",)),
    "half_space": (("normal",), ("point",)),
    "mesh": ((), ("file", "scale", *_PLACED, "vertices", "faces")),
    **dict.fromkeys(RULES, (("of",), ())),
    **{name: (("radius",) if name in WITH_RADIUS else (), ()) for name in (*NAMES, OWN)},
}


class VolumeModel(StrictModel):
    """A volume by its ``kind``.

    ``centre`` and ``rpy_deg`` (rotations about x, then y, then z of the base frame) place a box, a
    cylinder or a sphere. The axis of a cylinder is z of its own frame. A half-space lies behind the
    plane through ``point``; its ``normal`` leads out of it. ``of`` holds the volumes of a union, an
    intersection, or a difference: the first less all others.
    """

    kind: Kind = Field(description="kind of the volume")
    size: Annotated[list[Metres], THREE] | None = Field(
        default=None, description="sides of a box along its axes, m"
    )
    radius: Metres | None = Field(
        default=None, description="radius of a cylinder, a sphere, V_S or V_N, m"
    )
    height: Metres | None = Field(default=None, description="height of a cylinder, m")
    centre: _BasePoint | None = Field(
        default=None, description="centre in the base frame, m; default the origin"
    )
    rpy_deg: Angles | None = Field(
        default=None,
        description="orientation in degrees: rotations about the fixed x, then y, then z axis",
    )
    normal: Annotated[list[_Component], THREE] | None = Field(
        default=None, description="direction out of a half-space"
    )
    point: _BasePoint | None = Field(
        default=None, description="point of a half-space's plane, m; default the origin"
    )
    file: str | None = Field(
        default=None,
        min_length=1,
        max_length=1000,
        description="file of a closed mesh (.stl, .ply, .off, .obj) in the file's folder or below",
    )
    scale: Annotated[float, Field(gt=0, le=1000)] | None = Field(
        default=None, description="length of one unit of the mesh in the file, m; default 1"
    )
    vertices: list[_BasePoint] | None = Field(
        default=None, min_length=4, max_length=3 * MOST_FACES, description="corners of a mesh, m"
    )
    faces: list[Annotated[list[Annotated[int, Field(ge=0)]], THREE]] | None = Field(
        default=None,
        min_length=4,
        max_length=MOST_FACES,
        description="corners of each triangle of a mesh, counted from 0",
    )
    of: list["VolumeModel"] | None = Field(
        default=None,
        min_length=2,
        max_length=100,
        description="volumes of a union, a difference or an intersection",
    )

    @model_validator(mode="after")
    def _of_its_kind(self) -> Self:
        needed, possible = _KEYS[self.kind]
        given = [key for key in type(self).model_fields if getattr(self, key) is not None]
        for key in needed:
            if key not in given:
                raise fault(None, f"the key {key}, because the kind is {self.kind}")
        for key in given:
            if key not in ("kind", *needed, *possible):
                keys = ", ".join((*needed, *possible)) or "no other key"
                raise fault(key, f"{keys}, because the kind is {self.kind}")
        if self.kind == "mesh":
            self._check_mesh()
        if self.normal is not None and not math.hypot(*self.normal) > 1e-9:
            raise fault(self.normal, "a direction of a length above 0")
        return self

    def _check_mesh(self) -> None:
        inline, place = (self.vertices, self.faces), (self.scale, self.centre, self.rpy_deg)
        whole = all(keys is not None for keys in inline)
        if self.file is None and not whole:
            raise fault(None, "the key file, or the keys vertices and faces")
        if self.file is not None and inline != (None, None):
            raise fault(self.file, "no file, because the vertices and faces are given")
        if whole and any(keys is not None for keys in place):
            raise fault(None, "no scale, centre or rpy_deg, because the vertices are given")
        if whole:
            try:
                self.volume()
            except ValueError as error:
                raise fault(self.faces, f"other triangles: {error}") from error

    def volume(self) -> Volume:
        """Return the volume.

        Raises:
            UserError: if a file still holds a mesh.
        """
        centre, rpy = _three(self.centre), _three(self.rpy_deg, math.radians)
        match self.kind:
            case "box":
                return BoxVolume(_three(self.size), centre, rpy)
            case "cylinder":
                return CylinderVolume(self.radius or 0.0, self.height or 0.0, centre, rpy)
            case "sphere":
                return BallVolume(self.radius or 0.0, centre)
            case "half_space":
                return HalfSpaceVolume(_three(self.normal), _three(self.point))
            case "mesh":
                if self.vertices is None or self.faces is None:
                    raise UserError(f"{self.file}: the mesh in this file is not read yet")
                return MeshVolume(np.array(self.vertices, float), np.array(self.faces, np.int64))
            case "union" | "difference" | "intersection":
                return CombinedVolume(self.kind, tuple(v.volume() for v in self.of or ()))
            case _:
                return NamedVolume(self.kind, self.radius)

    @property
    def files(self) -> bool:
        """Whether files still hold meshes."""
        return self.file is not None or any(volume.files for volume in self.of or ())

    @classmethod
    def of_volume(cls, volume: Volume) -> Self:
        """Return the table of a volume.

        Raises:
            UserError: if no file can hold it, as for a function.
        """
        keys: dict[str, Any]
        match volume:
            case BoxVolume(size, centre, rpy):
                keys = {"kind": "box", "size": list(size), **_placed(centre, rpy)}
            case CylinderVolume(radius, height, centre, rpy):
                keys = {"kind": "cylinder", "radius": radius, "height": height}
                keys |= _placed(centre, rpy)
            case BallVolume(radius, centre):
                keys = {"kind": "sphere", "radius": radius, **_placed(centre)}
            case HalfSpaceVolume(normal, point):
                keys = {"kind": "half_space", "normal": list(normal), "point": list(point)}
            case MeshVolume(vertices, faces):
                keys = {"kind": "mesh", "vertices": vertices.tolist(), "faces": faces.tolist()}
            case CombinedVolume(rule, of):
                keys = {"kind": rule, "of": [cls.of_volume(v) for v in of]}
            case NamedVolume(name, named):
                keys = {"kind": name, "radius": named}
            case _:
                raise UserError("a target by a function of Python's cannot be written to a file")
        return cls(**keys)


def _three(values: list[float] | None, unit: Any = float) -> tuple[float, float, float]:
    x, y, z = (unit(value) for value in values or (0.0, 0.0, 0.0))
    return x, y, z


def _placed(
    centre: tuple[float, float, float], rpy: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> dict[str, list[float]]:
    """Return the keys of a place, without those at their defaults."""
    turned = [_ANGLE.write(angle) for angle in rpy]
    keys = {"centre": [float(x) for x in centre], "rpy_deg": turned}
    return {key: values for key, values in keys.items() if any(values)}
