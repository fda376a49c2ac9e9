"""Sensors of several targets: laws of ``returns`` between ``shadow`` and ``blind``, and the same
from rays that embree casts at meshes.
"""

from dataclasses import replace

import numpy as np
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.occlusion import occluders
from place_rings.coverage.occlusion.first_return import Beam, capsule_gap
from place_rings.coverage.occlusion.occluded_beams import OccludedBeams
from place_rings.coverage.occlusion.occluders import Occluders, beams
from place_rings.coverage.occlusion.occlusion_mode import OCCLUSIONS
from place_rings.coverage.solids.capsules import Capsules
from place_rings.coverage.solids.cones import Cones, around
from place_rings.coverage.solids.polyhedra import box
from place_rings.coverage.voxels.octree import count
from place_rings.objectives.target_voxels import target_voxels

from ..strategies.scenes import CELLS, scenes, shells
from ..strategies.units import GENERATORS, failures

SCENES = scenes(shells(300, 1000), CELLS)
TARGETS = st.integers(1, 5)
SEPARATIONS = st.integers(0, 800).map(lambda mm: mm / 1000)


def reporting(cones, targets, separation):
    """The beams of sensors that report a number of targets."""
    rows = np.array([*[separation] * (targets - 1), np.inf])
    return replace(cones, separation=np.tile(rows, (len(cones), 1)))


@settings(max_examples=10)
@given(SCENES, TARGETS, SEPARATIONS)
def test_counts_fall_from_model_to_model(scene, targets, separation):
    """As integers; one target is ``blind``, and more targets or less separation never cost."""
    voxel = scene.voxel("centre")
    wanted = target_voxels(scene.solid, voxel, "centre")

    def counted(model, targets, separation):
        cones = reporting(scene.cones, targets, separation)
        return count(beams(cones, scene.occluders, model), voxel, "centre", wanted)

    each = [counted(model, targets, separation) for model in OCCLUSIONS]
    assert each == sorted(each, reverse=True)
    assert counted("returns", 1, separation) == each[-1]
    assert counted("returns", targets + 1, separation) >= each[2]
    assert counted("returns", targets, separation + 0.1) <= each[2]


@settings(max_examples=20)
@given(SCENES)
def test_the_coarse_search_keeps_each_body_that_meets_a_beam_and_few_others(scene):
    looks = occluders._looks(around(scene.cones), np.arange(len(scene.cones)))
    beam, bodies = Beam(*(a[:, None] for a in looks)), scene.occluders.bodies
    gap = capsule_gap(beam, *bodies.arrays())[0]  # (K, N)
    near = occluders._near(looks, bodies)
    assert near[gap <= 0].all()
    length = np.linalg.norm(bodies.end - bodies.start, axis=-1)
    assert (gap <= 0.005 * length + 1e-4)[near].all()


@settings(max_examples=10)
@given(SCENES, GENERATORS)
def test_enough_targets_without_separation_miss_what_is_beside_a_body_only(scene, rng):
    """``shadow``, but for the distances at which bodies of the beam stand."""
    cones, past = reporting(scene.cones, 100, 0.0), scene.occluders
    points = rng.uniform(-1.5, 1.5, (1000, 3))
    reported, shadowed = (beams(cones, past, how) for how in ("returns", "shadow"))
    bodies = past.bodies
    for k, apex in enumerate(cones.apex):
        away = np.linalg.norm(points - apex, axis=1)
        ends = np.linalg.norm(np.stack([bodies.start, bodies.end]) - apex, axis=2).max(axis=0)
        near = [(np.asarray(bodies.distance(apex[None])), ends + bodies.radius)]
        for body in past.obstacles:
            end = np.linalg.norm(body.edges - apex, axis=2).max(initial=0.0)
            near.append((np.array([body(apex[None])[0]]), np.array([end])))
        beside = [((n <= away[:, None]) & (away[:, None] < f)).any(axis=1) for n, f in near]
        same = (reported.part(points, k) <= 0) == (shadowed.part(points, k) <= 0)
        assert failures(points, same | np.any(beside, axis=0)) == []


@settings(max_examples=5)
@given(SCENES, TARGETS, SEPARATIONS, GENERATORS)
def test_the_function_changes_no_faster_than_distance(scene, targets, separation, rng):
    seen = beams(reporting(scene.cones, targets, separation), scene.occluders, "returns")
    points, step = rng.uniform(-1.5, 1.5, (500, 3)), rng.normal(size=(500, 3)) * 0.1
    for k in np.flatnonzero(seen.cones.range_m > 0 if isinstance(seen, OccludedBeams) else []):
        change = np.abs(seen.part(points + step, k) - seen.part(points, k))
        assert failures(points, change <= np.linalg.norm(step, axis=1) * (1 + 1e-9) + 1e-12) == []


# A brute force without the code of the package: meshes, rays and the definition in words
RAYS, RANGE = 20_000, 2.0


def directions(half: float, count: int = RAYS):
    """Unit vectors within an angle of +z, evenly spread, and their largest spacing, rad."""
    i = np.arange(count) + 0.5
    z = 1 - (1 - np.cos(half)) * i / count
    turn = np.pi * (1 + 5**0.5) * i
    aside = np.sqrt(1 - z * z)
    spacing = 2 * np.sqrt(2 * np.pi * (1 - np.cos(half)) / count)
    return np.column_stack([aside * np.cos(turn), aside * np.sin(turn), z]), spacing


def mesh_of(start, end, radius):
    """A mesh in a capsule, whose vertices lie on its surface."""
    length = np.linalg.norm(end - start)
    mesh = trimesh.creation.capsule(length, radius, count=(48, 48))
    turn = trimesh.geometry.align_vectors([0, 0, 1], (end - start) / length)
    mesh.apply_transform(trimesh.transformations.translation_matrix((start + end) / 2) @ turn)
    return mesh


def first_hits(mesh, way):
    """Distances from the origin at which rays first meet a mesh; infinite for those that miss."""
    at, ray, _ = mesh.ray.intersects_location(np.zeros_like(way), way, multiple_hits=False)
    distance = np.full(len(way), np.inf)
    np.minimum.at(distance, ray, np.linalg.norm(at, axis=1))
    return distance


def judged(meshes, half, range_m, targets, separation, points):
    """Whether meshes leave points in sight and reported, from the definition in words."""
    way, _ = directions(half)
    away = np.linalg.norm(points, axis=1)
    clear, reported, taken = np.ones((2, len(points)), bool), None, np.zeros(len(points), int)
    clear, reported = clear
    for mesh in meshes:
        clear &= first_hits(mesh, points / away[:, None]) > away
        hit = first_hits(mesh, way)
        near = hit[hit * way[:, 2] <= range_m].min(initial=np.inf)
        far = np.linalg.norm(mesh.vertices, axis=1).max()
        reported &= (away < near) | (away >= far + separation)
        taken += near <= away
    return clear & reported & (taken < targets)


def test_points_are_seen_as_by_rays():
    """Between meshes in the bodies, in a narrower beam, and meshes about them, in a wider one."""
    decided, beyond = [], []

    @settings(max_examples=12, deadline=None, database=None)
    @given(st.integers(15, 45), TARGETS, st.integers(0, 300).map(lambda mm: mm / 1000), GENERATORS)
    def look(half_deg, targets, separation, rng):
        half = np.radians(half_deg)
        way, spacing = directions(half)
        grown = spacing * 1.6 + 0.004
        middle = way[rng.integers(RAYS, size=2)] * rng.uniform(0.3, 1.2, (2, 1))
        turned = rng.normal(size=(2, 3)) * 0.08
        start, end, radius = middle - turned, middle + turned, rng.uniform(0.02, 0.06, 2)
        size, place = rng.uniform(0.05, 0.2, 3), way[rng.integers(RAYS)] * rng.uniform(0.5, 1.5)

        def solids(more):
            lid = trimesh.creation.box(size + 2 * more)
            lid.apply_translation(place)
            return [*map(mesh_of, start, end, radius + more), lid]

        points = way[rng.integers(RAYS, size=1500)] * rng.uniform(0.1, RANGE, (1500, 1))
        points = points[points[:, 2] < RANGE - 0.01]
        asked = targets, separation, points
        more = judged(solids(0.0), half, RANGE, *asked)
        less = judged(solids(grown), half + spacing, RANGE + grown, *asked)
        cone = Cones(*(np.array(a) for a in ([[0.0, 0, 0]], [[0.0, 0, 1]], [half], [RANGE])))
        here = Occluders(Capsules(start, end, radius), (box(place, size),))
        seen = beams(reporting(cone, targets, separation), here, "returns").part(points, 0) <= 1e-9
        assert failures(points, (seen | ~less) & (more | ~seen)) == []
        decided.append(np.mean(more == less))
        blind = beams(cone, here, "blind").part(points, 0) <= 0
        beyond.append(np.mean(seen & ~blind))

    look()
    assert np.mean(decided) > 0.8
    assert np.mean(np.array(beyond) > 0.02) > 0.25
