"""Closed meshes as targets: the solids that they approximate, and those of other libraries."""

import math

import numpy as np
import place_rings as pr
import pytest
import trimesh
from hypothesis import given, settings
from place_rings.coverage.robots.built_in import UR10
from place_rings.coverage.robots.kinematics import transform
from place_rings.coverage.solids.closed_mesh import ClosedMesh
from place_rings.coverage.solids.spheres import sphere
from place_rings.coverage.targets.own import Box, Mesh
from place_rings.coverage.targets.solid import target_solid
from place_rings.coverage.voxels.certified_bounds import bracket
from place_rings.coverage.voxels.octree import count
from place_rings.formats.loader import read_target
from place_rings.objectives.scene import Scene

from ..strategies.solids import MESHES
from ..strategies.units import GENERATORS, failures
from ..strategies.volumes import ANYWHERE, BOXES
from ..support.refusals import refused
from ..support.scene_tables import scene_of_table, scene_table


def solid_of(mesh):
    return ClosedMesh(np.array(mesh.vertices, float), np.array(mesh.faces, np.int64))


@settings(max_examples=12)
@given(MESHES, GENERATORS)
def test_sign_and_distance_are_those_of_trimesh(mesh, rng):
    solid = solid_of(mesh)
    points = rng.uniform(-1.2, 1.2, (300, 3))
    away = np.abs(trimesh.proximity.signed_distance(mesh, points))
    value = solid(points)
    assert failures(points, (value < 0) == (np.abs(mesh_winding(mesh, points)) > 0.5)) == []
    assert failures(points, np.abs(value) <= away + 1e-9) == []
    near = away < 2 * solid._radius
    assert failures(points[near], np.abs(np.abs(value) - away)[near] < 1e-6) == []


def mesh_winding(mesh, points):
    """The winding number about each point: the sum of solid angles of all triangles."""
    a, b, c = (mesh.triangles[None, :, i] - points[:, None] for i in range(3))
    la, lb, lc = (np.linalg.norm(v, axis=2) for v in (a, b, c))
    up = np.einsum("ijk,ijk->ij", a, np.cross(b, c))
    down = la * lb * lc + (a * b).sum(2) * lc + (b * c).sum(2) * la + (c * a).sum(2) * lb
    return np.arctan2(up, down).sum(axis=1) / (2 * math.pi)


@settings(max_examples=8)
@given(BOXES)
def test_a_mesh_of_a_box_is_the_box(volume):
    mesh = trimesh.creation.box(
        volume.size, transform(np.array(volume.centre), np.radians(volume.rpy_deg))
    )
    same = Mesh(mesh.vertices, mesh.faces)
    one, other = (v.solid(ANYWHERE) for v in (volume, same))
    assert abs(count(one, 0.0431) - count(other, 0.0431)) <= 2  # centres on a face


@settings(max_examples=4)
@given(MESHES)
def test_certified_volume_holds_that_of_trimesh(mesh):
    solid = solid_of(mesh)
    found = bracket(solid, sphere(np.zeros(3), 0.3), 0.1)
    assert found.volume_low <= mesh.volume * (1 + 1e-9)
    assert found.volume_high >= mesh.volume * (1 - 1e-9)
    assert found.high - found.low <= 0.1


def test_a_ray_along_walls_and_edges_counts_once():
    """Points above, below and beside the edges and the walls of a box on the lattice."""
    solid = solid_of(trimesh.creation.box((1, 1, 1)))
    at = np.array([-1.0, -0.5, 0.0, 0.25, 0.5, 1.0])
    points = np.stack(np.meshgrid(at, at, at, indexing="ij"), -1).reshape(-1, 3)
    inside = (np.abs(points) < 0.5).all(axis=1)
    outside = (np.abs(points) > 0.5).any(axis=1)
    held = solid.holds(points)
    assert held[inside].all()
    assert not held[outside].any()


def test_files_hold_meshes(tmp_path):
    mesh = trimesh.creation.box((200, 400, 600))
    mesh.export(tmp_path / "zone.stl")
    (tmp_path / "zone.toml").write_text(
        "name = 'zone'\n[volume]\nkind = 'mesh'\nfile = 'zone.stl'\nscale = 0.001\n"
        "centre = [0.5, 0.0, 0.5]\nrpy_deg = [0.0, 0.0, 90.0]\n"
    )
    target = read_target(tmp_path / "zone.toml")
    box = Box((0.4, 0.2, 0.6), (0.5, 0.0, 0.5))
    one, other = (target_solid(t, UR10, Scene.poses[0].q) for t in (target, box))
    assert abs(count(one, 0.0217) - count(other, 0.0217)) <= 2
    keys = scene_table(Scene(targets=(target,)))
    assert scene_of_table(keys).targets[0] == target
    again = pr.Mesh.load(
        tmp_path / "zone.stl", scale=0.001, centre=(0.5, 0, 0.5), rpy_deg=(0, 0, 90), name="zone"
    )
    assert again == target
    scene = pr.Scene(targets=pr.UnionOf([again, pr.Shell(0.5)], name="both"))
    assert scene.targets[0] == pr.UnionOf([again, pr.Shell(0.5)], name="both")


def test_open_meshes_are_refused(tmp_path):
    mesh = trimesh.creation.box((1, 1, 1))
    mesh.update_faces(np.arange(12) > 0)
    mesh.export(tmp_path / "open.stl")
    (tmp_path / "open.toml").write_text(
        "name = 'zone'\nvolume = {kind = 'mesh', file = 'open.stl'}\n"
    )
    with refused("open.toml volume.file 3 18"):  # 3 of its 18 edges belong to one face
        read_target(tmp_path / "open.toml")
    with refused("3 18", error=pr.InputError):
        pr.Mesh.load(tmp_path / "open.stl")


BAD = {
    "{kind = 'mesh'}": "volume.file",
    "{kind = 'mesh', file = 'none.stl'}": "volume.file none.stl",
    "{kind = 'mesh', file = '../a.stl'}": "volume.file ../a.stl",
    "{kind = 'mesh', file = 'a.txt'}": "volume.file a.txt .stl",
    "{kind = 'mesh', file = 'text.stl'}": "volume.file text.stl",
    "{kind = 'mesh', file = 'text.stl', vertices = [[0.0,0.0,0.0]]}": "volume vertices",
}


@pytest.mark.parametrize("volume", BAD)
def test_bad_meshes_are_refused(volume, tmp_path):
    (tmp_path / "a.txt").write_text("hello")
    (tmp_path / "text.stl").write_text("hello")
    (tmp_path / "target.toml").write_text(f"name = 'zone'\nvolume = {volume}\n")
    with refused(f"target.toml {BAD[volume]}"):
        read_target(tmp_path / "target.toml")
