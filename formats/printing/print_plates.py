"""Plates of printed parts: 3MF files, each with the parts that a printer's bed holds at once.

The files follow the 3MF core specification (3MF Consortium, version 1.2): lengths in millimetres,
one named object for each part, and one build item for each copy of it. trimesh's writer draws
random identifiers and needs two more packages, so that equal parts would give unequal files.
"""

import io
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from xml.sax.saxutils import quoteattr

import numpy as np
import trimesh

from .print_bed import PLATE, Bed
from .print_checks import read_stl
from .print_plan import MM

_GAP = 5.0  # mm, between two parts
_CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
_PACKAGE = "http://schemas.openxmlformats.org/package/2006"
_DATE = (1980, 1, 1, 0, 0, 0)  # the earliest of a zip file, so that equal parts give equal files
_HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'
_TYPES = (
    f'{_HEAD}<Types xmlns="{_PACKAGE}/content-types">'
    '<Default Extension="rels"'
    ' ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model"'
    ' ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>\n'
)
_RELATIONS = (
    f'{_HEAD}<Relationships xmlns="{_PACKAGE}/relationships"><Relationship Id="rel0"'
    ' Target="/3D/3dmodel.model"'
    ' Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>\n'
)


@dataclass(frozen=True)
class PlatePart:
    """A part on a plate."""

    name: str
    """Name of the part."""
    mesh: trimesh.Trimesh
    """Its surface, mm, with its lowest point at z = 0."""
    at: tuple[float, float]
    """Position of its lower corner, x and y mm."""


def print_plates(
    files: Mapping[str, bytes], bed: Bed, copies: Mapping[str, int] | None = None
) -> dict[str, bytes]:
    """Return plates with all parts as 3MF files by name, as many as they need.

    Args:
        files: STL files by name.
        bed: width, depth and height that can be printed, m; None: plates of 250 × 210 mm.
        copies: number of copies by file; 1 where it is not stated.
    """
    meshes = {name.removesuffix(".stl"): read_stl(data) for name, data in files.items()}
    counts = {name.removesuffix(".stl"): count for name, count in (copies or {}).items()}
    packed = _packed(meshes, bed, counts)
    return {f"plate{i}.3mf": plate_3mf(parts) for i, parts in enumerate(packed)}


def _packed(
    meshes: Mapping[str, trimesh.Trimesh], bed: Bed, copies: Mapping[str, int]
) -> list[list[PlatePart]]:
    """Return the parts of each plate, in rows, the deepest parts first.

    Each part fits the bed alone; without a bed, a part larger than the usual plate lies on a plate
    of its own.
    """
    sizes = {name: mesh.extents for name, mesh in meshes.items()}
    each = [name for name in sizes for _ in range(copies.get(name, 1))]
    wide, deep = (MM * side for side in (bed or PLATE)[:2])
    plates, x, y, row = list[list[PlatePart]](), np.inf, np.inf, 0.0
    for name in sorted(each, key=lambda name: -sizes[name][1]):
        width, depth, _ = (float(v) for v in sizes[name])
        if width > wide + 1e-3 or depth > deep + 1e-3:  # without a bed: on a plate of its own
            plates.insert(0, [PlatePart(name, meshes[name], (0.0, 0.0))])
            continue
        if x + width > wide + 1e-3:  # a new row
            x, y, row = 0.0, y + row, depth + _GAP
        if y + depth > deep + 1e-3:  # a new plate
            x, y, row = 0.0, 0.0, depth + _GAP
            plates.append([])
        plates[-1].append(PlatePart(name, meshes[name], (x, y)))
        x += width + _GAP
    return plates


def _object(part: PlatePart, number: int) -> str:
    """Return a part as an object of a 3MF file with an identifier."""
    points = "".join(
        f'<vertex x="{a:.9g}" y="{b:.9g}" z="{c:.9g}"/>' for a, b, c in part.mesh.vertices
    )
    faces = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in part.mesh.faces)
    return (
        f'<object id="{number}" type="model" name={quoteattr(part.name)}><mesh>'
        f"<vertices>{points}</vertices><triangles>{faces}</triangles></mesh></object>\n"
    )


def plate_3mf(parts: list[PlatePart]) -> bytes:
    """Return a 3MF file of parts, each a named object at its place on the build platform; copies of
    a part are items of one object."""
    objects, items, numbers = list[str](), list[str](), dict[str, int]()
    for part in parts:
        if part.name not in numbers:
            numbers[part.name] = len(numbers) + 1
            objects.append(_object(part, numbers[part.name]))
        corner = np.append(part.mesh.bounds[0, :2], 0.0)
        x, y, z = np.append(part.at, 0.0) - corner
        items.append(
            f'<item objectid="{numbers[part.name]}"'
            f' transform="1 0 0 0 1 0 0 0 1 {x:.6f} {y:.6f} {z:.6f}"/>\n'
        )
    model = (
        f'{_HEAD}<model unit="millimeter" xml:lang="en-US" xmlns="{_CORE}">\n'
        f'<metadata name="Application">place-rings</metadata>\n'
        f"<resources>\n{''.join(objects)}</resources>\n<build>\n{''.join(items)}</build></model>\n"
    )
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as package:
        for name, text in (
            ("[Content_Types].xml", _TYPES),
            ("_rels/.rels", _RELATIONS),
            ("3D/3dmodel.model", model),
        ):
            package.writestr(zipfile.ZipInfo(name, _DATE), text.encode(), zipfile.ZIP_DEFLATED)
    return file.getvalue()
