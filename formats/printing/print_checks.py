"""Measurements of a printed ring with their limits, taken from the STL files where possible."""

import io
import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import trimesh
from jaxtyping import Bool, Float
from manifold3d import Manifold

from ...coverage.rings.ring_envelope import Envelope
from ...coverage.sensors.lids import MARGIN
from ..schema.print_models import PrintCheck
from .lids import lid_solid
from .primitives import tube, union
from .print_plan import MM, PrintPlan
from .ring_solids import Assembly, envelope_solid

_RAYS = 1500  # rays that measure wall thickness, for each half
_PARALLEL = math.cos(math.radians(20))  # least cosine between opposite faces of a wall
_STEEP = math.cos(math.radians(45)) + 1e-6
_SEAM = 2e-3  # mm
_DIGITS = 4  # decimals of a millimetre to which vertices that coincide agree
_FAR = 60.0  # mm, length of the rays
_IN = 1e-4  # mm, start of the rays below a face
NOTHING = 0.01
"""Rounding error of Booleans, mm³."""
NEAR = 5.0
"""Largest gap that is measured, mm."""


def printing_origin(solid: Manifold) -> tuple[float, float, float]:
    """Return the point (3,) mm of the print frame that is the origin of the solid's file: midway
    along x and y, at its lowest z."""
    low_x, low_y, low_z, high_x, high_y, _ = solid.bounding_box()
    return (low_x + high_x) / 2, (low_y + high_y) / 2, low_z


def stl(solid: Manifold, yaw: float = 0.0) -> bytes:
    """Return a solid as a binary STL file in its printing position: turned about z by ``yaw``
    degrees, its lowest point at z = 0, centred on the origin."""
    turned = solid.rotate((0.0, 0.0, yaw)) if yaw else solid
    x, y, z = printing_origin(turned)
    mesh = turned.translate((-x, -y, -z)).to_mesh()
    surface = trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts, process=False)
    surface.vertices = _parted(surface)
    surface.update_faces(_thick(surface))
    data: Any = surface.export(file_type="stl")
    return bytes(data)


def _parted(surface: trimesh.Trimesh) -> Float[np.ndarray, "V 3"]:
    """Return the vertices (V, 3) mm of a closed surface, of which no two coincide.

    Where a solid touches itself along an edge, a file of triangles would join four of them there.
    Such vertices are moved into the material by 2 micrometres.
    """
    vertices = np.asarray(surface.vertices, float)
    _, which, times = np.unique(
        np.round(vertices, _DIGITS), axis=0, return_inverse=True, return_counts=True
    )
    double = times[which.reshape(-1)] > 1
    inwards = np.where(double[:, None], -_SEAM * np.asarray(surface.vertex_normals), 0.0)
    parted: np.ndarray = vertices + inwards
    return parted


def _thick(surface: trimesh.Trimesh) -> Bool[np.ndarray, " F"]:
    """Return which faces (F,) of a closed surface its file needs.

    Where faces touch, Booleans may leave a flap: two faces that cover each other, whose corners lie
    at the same three places of the file. Its edges would join four faces, so the flap is left out,
    and the faces around it meet. So is a face with two corners at one place.
    """
    _, place = np.unique(np.asarray(surface.vertices, np.float32), axis=0, return_inverse=True)
    a, b, c = corners = place.reshape(-1)[np.asarray(surface.faces)].T
    sense = np.sign((b - a) * (c - b) * (a - c))  # 0: two corners at one place
    _, which = np.unique(np.sort(corners.T, axis=1), axis=0, return_inverse=True)
    thick: np.ndarray = np.bincount(which.reshape(-1), sense)[which.reshape(-1)] != 0
    return thick


def read_stl(data: bytes) -> trimesh.Trimesh:
    """Return the mesh in an STL file, with merged vertices."""
    mesh = trimesh.load_mesh(io.BytesIO(data), file_type="stl")
    mesh.merge_vertices()
    return mesh


def open_edges(mesh: trimesh.Trimesh) -> int:
    """Return the number of edges that are not shared by exactly two faces: 0 on a closed surface
    that does not touch itself."""
    edges = np.sort(mesh.edges, axis=1)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    return int(np.count_nonzero(counts != 2))


def overhang(mesh: trimesh.Trimesh) -> float:
    """Return the share of a mesh's area that faces down by more than 45 degrees and does not lie on
    the printing bed, z = 0."""
    down = mesh.face_normals[:, 2] < -_STEEP
    raised = mesh.triangles[:, :, 2].max(axis=1) > 0.05
    return float(mesh.area_faces[down & raised].sum() / mesh.area)


def least_wall(solid: Manifold, seed: int = 0) -> float:
    """Return the least distance, mm, that rays measure between opposite faces of a solid, parallel
    within 20 degrees."""
    mesh = solid.to_mesh()
    surface = trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts, process=False)
    points, faces = map(np.asarray, trimesh.sample.sample_surface(surface, _RAYS, seed=seed))
    normals, least = surface.face_normals[faces], math.inf
    for point, normal in zip(points, normals, strict=True):
        for hit in solid.ray_cast(tuple(point - _IN * normal), tuple(point - _FAR * normal))[:1]:
            if float(np.dot(hit.normal, normal)) < -_PARALLEL:
                least = min(least, hit.distance * (_FAR - _IN) + _IN)
    return least


def lens_of(board: Manifold, plan: PrintPlan, k: int) -> float:
    """Return the distance from the middle of a sensor's front to the apex of its beam, mm, measured
    on the solid."""
    frame = plan.frame(k)
    corners = board.to_mesh().vert_properties[:, :3]
    ahead = (corners - frame[:, 3]) @ frame[:, 2]
    front = corners[ahead > ahead.max() - 1e-3]
    return float(np.linalg.norm((front.min(axis=0) + front.max(axis=0)) / 2 - frame[:, 3]))


def neighbours(boards: list[Manifold]) -> float:
    """Return the least distance between boards, or lids, mm, measured from the first, because all
    are arranged alike about the axis."""
    return float(boards[0].min_gap(union(boards[1:]), NEAR)) if len(boards) > 1 else NEAR


def check_ring(
    plan: PrintPlan,
    made: Assembly,
    files: Sequence[bytes],
    lids: Sequence[bytes],
    envelope: Envelope,
) -> list[PrintCheck]:
    """Return all measurements of a ring.

    Args:
        plan: the ring.
        made: its solids.
        files: STL files of its parts.
        lids: STL file of a lid; empty without lids.
        envelope: the solid that must contain the mounted ring.
    """
    inside = envelope_solid(plan, envelope)
    checks = [*_of_parts(plan, made, files), *_of_assembly(plan, made, inside)]
    return checks + [check for lid in lids for check in _of_lids(plan, made, lid, inside)]


def _of_parts(plan: PrintPlan, made: Assembly, files: Sequence[bytes]) -> list[PrintCheck]:
    """Return the measurements of the parts and their files."""
    meshes, p = [read_stl(data) for data in files], plan.printing
    hull = sum(part.hull().volume() for part in made.parts)
    volume = float(sum(mesh.volume for mesh in meshes))
    return [
        at_most("open edges in the files", sum(open_edges(m) for m in meshes), "", 0.0),
        at_most("separate pieces of a part", max(map(pieces, made.parts)), "", 1.0),
        print_check("volume of all parts", volume / 1000, "cm³", 1e-3, hull / 1000),
        at_most(
            "volume error of the files",
            abs(volume - sum(part.volume() for part in made.parts)) / volume * 100,
            "%",
            0.1,
        ),
        at_most("overhang beyond 45°", 100 * max(map(overhang, meshes)), "%", 100 * p.overhang),
        at_least("least wall", min(map(least_wall, made.parts)), p.least_wall),
        at_least("wall behind the lettering", _behind(plan, made), p.least_wall),
    ]


def _of_assembly(plan: PrintPlan, made: Assembly, inside: Manifold) -> list[PrintCheck]:
    """Return the measurements of the closed ring with bolts and boards, on its link."""
    boards, p = union([*made.boards, *made.plugs]), plan.printing
    plastic = union(made.parts)
    solid = plastic + made.bolts
    return [
        at_most("overlap of two parts", _shared(made.parts), "mm³", NOTHING),
        nothing("overlap of bolts and parts", made.bolts ^ plastic),
        at_least("distance between boards", neighbours(made.boards), min(p.clearance, p.wall)),
        at_least("distance from boards to bolts", boards.min_gap(made.bolts, NEAR), p.clearance),
        at_least("distance from boards to link", boards.min_gap(made.link, NEAR), p.slack),
        nothing("volume outside the envelope", solid + boards - inside),
        nothing("overlap of boards and ring", boards ^ solid),
        nothing("overlap of link and ring", made.link ^ solid),
        nothing("overlap of beams with ring, bolts and boards", made.beams ^ (solid + boards)),
        at_most(
            "distance from lenses to apexes",
            max(lens_of(b, plan, k) for k, b in enumerate(made.boards)),
            "mm",
            1e-3,
        ),
    ]


def _of_lids(plan: PrintPlan, made: Assembly, data: bytes, inside: Manifold) -> list[PrintCheck]:
    """Return all measurements of the lids of a ring, and of the STL file of one."""
    mesh, p, lids = read_stl(data), plan.printing, union(made.lids)
    covers, ring = lids + union(made.heads), union([*made.parts, made.bolts])
    boards = union([*made.boards, *made.plugs])
    one = lid_solid(plan)
    return [
        at_most("open edges in the file of a lid", open_edges(mesh), "", 0.0),
        at_most("separate pieces of a lid", pieces(one), "", 1.0),
        at_least("least wall of a lid", least_wall(one), p.least_wall),
        at_most("overhang of a lid beyond 45°", 100 * overhang(mesh), "%", 100 * p.overhang),
        nothing("overlap of lids and ring", covers ^ ring),
        nothing("overlap of lids and boards", covers ^ boards),
        at_least("distance between lids", neighbours(made.lids), p.clearance),
        at_least("distance from lids to bolts", covers.min_gap(made.bolts, NEAR), p.clearance),
        at_least("distance from lids to link", covers.min_gap(made.link, NEAR), p.slack),
        at_least("distance from beams to lids", made.beams.min_gap(lids, NEAR), MARGIN),
        nothing("overlap of beams with lids and screws", made.beams ^ covers),
        nothing("volume of lids outside the envelope", covers - inside),
    ]


def _behind(plan: PrintPlan, made: Assembly) -> float:
    """Return the least material between the lettering and the ring's bore, mm."""
    if made.letters.is_empty():
        return NEAR
    hole = tube(plan.bore, plan.low - 1, plan.lug[1] + 1)
    return float(made.letters.min_gap(hole, NEAR))


def _shared(parts: list[Manifold]) -> float:
    """Return the largest volume, mm³, that two parts have in common."""
    return float(max((a ^ b).volume() for a, b in itertools.combinations(parts, 2)))


def pieces(solid: Manifold) -> int:
    """Return the number of separate pieces of a solid."""
    return len(solid.decompose())


def at_least(name: str, measured: float, least: float) -> PrintCheck:
    """Return a length, mm, with the smallest allowed one, m."""
    return print_check(name, measured, "mm", least=MM * least)


def at_most(name: str, measured: float, unit: str, most: float) -> PrintCheck:
    """Return a measurement with its largest allowed value."""
    return print_check(name, measured, unit, most=most)


def nothing(name: str, solid: Manifold) -> PrintCheck:
    """Return the volume, mm³, of a solid that should be empty."""
    return print_check(name, solid.volume(), "mm³", most=NOTHING)


def print_check(
    name: str, measured: float, unit: str, least: float | None = None, most: float | None = None
) -> PrintCheck:
    """Return a measurement with its smallest and largest allowed value, judged to within 1e-6."""
    low, high = (-math.inf if least is None else least), (math.inf if most is None else most)
    value, holds = round(float(measured), 9) + 0.0, low - 1e-6 <= measured <= high + 1e-6
    return PrintCheck(name=name, measured=value, least=least, most=most, unit=unit, holds=holds)
