"""Shadows and blinded beams: laws of their functions, and the same from rays cast at meshes."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import trimesh
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from place_rings.coverage.occlusion.first_return import MARGIN, Beam, capsule_in_beam, cone_gap
from place_rings.coverage.occlusion.polyhedron_return import polyhedron_in_beam
from place_rings.coverage.solids.capsule_shadows import behind, capsule_shadow
from place_rings.coverage.solids.capsules import gap_to_capsules
from place_rings.coverage.solids.cones import cone
from place_rings.coverage.solids.polyhedra import box, half_space, hull, largest, polyhedron_shadow
from place_rings.coverage.solids.segments import segment_to_segment
from scipy.spatial.transform import Rotation

from ..strategies.solids import boxes, capsule, pointed_bodies
from ..strategies.units import GENERATORS, failures, metres, points_mm, uniform_directions


def drawn_capsules(rng, n):
    """Apexes outside of capsules, some of these balls, some with the apex on the axis's line."""
    apex, start = rng.uniform(-1, 1, (n, 3)), rng.uniform(-0.6, 0.6, (n, 3))
    end = start + rng.uniform(-0.5, 0.5, (n, 3)) * (rng.random((n, 1)) > 0.1)
    end = np.where(
        rng.random((n, 1)) < 0.1, start + (start - apex) * rng.uniform(0.1, 1, (n, 1)), end
    )
    radius = rng.uniform(0.01, 0.3, n)
    out = gap_to_capsules(apex, start[:, None], end[:, None], radius[:, None]) > 1e-6
    return apex[out], start[out], end[out], radius[out]


def drawn_polyhedra(rng):
    size = rng.uniform(0.05, 0.6, 3)
    turned = Rotation.random(random_state=int(rng.integers(2**31))).as_matrix()
    return [
        box(rng.uniform(-0.3, 0.3, 3), size, turned),
        hull(rng.normal(size=(12, 3)) * 0.2),
        half_space(-0.4),
    ]


BODIES = st.tuples(boxes(300, (50, 600)), pointed_bodies(300), st.just(half_space(-0.4)))


shadow_value = jax.jit(lambda *a: behind(a[0], capsule_shadow(*a[1:])))


def laws(function, points, step):
    """1-Lipschitz and convex."""
    here, there, between = function(points), function(points + step), function(points + step / 2)
    assert np.all(np.abs(there - here) <= np.linalg.norm(step, axis=-1) * (1 + 1e-6) + 1e-12)
    assert np.all(between <= (here + there) / 2 + 1e-12)


@settings(max_examples=20)
@given(
    points_mm(1000),
    st.builds(capsule, points_mm(600), points_mm(900), st.integers(10, 300)),
    st.sampled_from(["anywhere", "a ball", "in line with the apex"]),
    GENERATORS,
)
def test_the_shadow_of_a_capsule_is_where_the_line_of_sight_meets_it(apex_mm, body, kind, rng):
    apex, start, end = (metres(mm) for mm in (apex_mm, body.start_mm, body.end_mm))
    if kind == "a ball":
        end = start
    if kind == "in line with the apex":
        end = start + (start - apex) * 0.7
    assume(gap_to_capsules(apex[None], start[None], end[None], metres([body.radius_mm]))[0] > 1e-6)
    n = 500  # one shape for all examples
    apex, start, end = (np.broadcast_to(a, (n, 3)) for a in (apex, start, end))
    radius = np.full(n, body.radius_mm / 1000)
    points, shadow = rng.uniform(-1.5, 1.5, (n, 3)), capsule_shadow(apex, start, end, radius)
    value = behind(points, shadow)
    miss = segment_to_segment(apex, points, start, end) - radius
    assert failures(points, ((value < 0) == (miss < 0)) | (np.abs(miss) <= 1e-9)) == []
    laws(
        lambda p: behind(p, shadow),
        points,
        rng.normal(size=(n, 3)) * 10 ** rng.uniform(-6, 0, (n, 1)),
    )
    jitted = shadow_value(points, apex, start, end, radius)
    assert failures(points, np.abs(jitted - value) <= 1e-11) == []


def test_a_shadow_grows_at_the_pace_of_distance():
    """Far behind a near body, too: the gradient has length 1, and central differences see it, by
    the apex as well.
    """
    rng = np.random.default_rng(3)
    scene = drawn_capsules(rng, 400)
    # a frame of its own
    turning = np.linalg.norm(np.cross(scene[1] - scene[0], scene[2] - scene[0]), axis=1) > 1e-3
    apex, *bodies = (a[turning] for a in scene)
    places = rng.uniform(-1.5, 1.5, apex.shape)

    def total(p, apex):
        return shadow_value(p, apex, *bodies).sum()

    by_point, by_apex = jax.jit(jax.grad(total, (0, 1)))(places, apex)
    assert np.allclose(np.linalg.norm(by_point, axis=1), 1, atol=1e-9)

    def each(apex):
        return behind(places, capsule_shadow(apex, *bodies))

    h = 1e-6
    for i in range(3):
        step = h * np.eye(3)[i]
        slope = (each(apex + step) - each(apex - step)) / (2 * h)
        off = np.abs(slope - np.asarray(by_apex)[:, i])
        assert np.quantile(off, 0.98) < 1e-5  # a few lie on a crease


@settings(max_examples=5)
@given(BODIES, st.lists(points_mm(1000), min_size=1, max_size=40), GENERATORS)
def test_the_shadow_of_a_polyhedron_is_where_the_line_of_sight_meets_it(bodies, apexes_mm, rng):
    for body in bodies:
        apex = metres(apexes_mm)
        apex = apex[body(apex) > 1e-3]
        if not len(apex):
            continue
        points = rng.uniform(-1, 1, (2000, 3))
        normal, offset = (a[:, None] for a in polyhedron_shadow(apex, body))
        value = largest(points[None], normal, offset)
        enter, leave = clipped(body, apex[:, None], points[None] - apex[:, None])
        sure = np.abs(value) > 1e-9
        assert np.array_equal(
            (value < 0)[sure], ((enter < leave) & (enter < 1) & (leave > 0))[sure]
        )
        laws(
            lambda p, n=normal, o=offset: largest(p, n, o),
            points[None],
            rng.normal(size=(1, 2000, 3)) * 0.2,
        )


def clipped(body, origin, way):
    """Where lines origin + t way enter and leave a convex polyhedron."""
    with np.errstate(divide="ignore", invalid="ignore"):
        pace = way @ body.normal.T
        t = (body.offset - origin @ body.normal.T) / pace
    return np.where(pace < 0, t, -np.inf).max(axis=-1), np.where(pace > 0, t, np.inf).min(axis=-1)


def hidden(mesh, apex, points):
    """By embree: is there a face between apex and point?"""
    way = points - apex
    distance = np.linalg.norm(way, axis=1)
    where, ray, _ = mesh.ray.intersects_location(
        np.broadcast_to(apex, points.shape), way, multiple_hits=False
    )
    first = np.full(len(points), np.inf)
    first[ray] = np.linalg.norm(where - apex, axis=1)
    return first < distance


@pytest.mark.parametrize("seed", range(2))
def test_rays_cast_at_meshes_agree(seed):
    """A tessellated capsule lies between the capsule and one as much thinner as its facets are off;
    boxes are exact. Embree counts in 32 bits, so that points within 1e-5 m of a shadow's edge may
    differ."""
    assert trimesh.ray.has_embree
    rng = np.random.default_rng(seed)
    apex, start, end, radius = (a[0] for a in drawn_capsules(rng, 20))
    sides = 96
    mesh = trimesh.creation.capsule(
        height=float(np.linalg.norm(end - start)), radius=float(radius), count=[sides, sides]
    )
    turn = trimesh.geometry.align_vectors(
        [0, 0, 1], (end - start) / max(np.linalg.norm(end - start), 1e-12)
    )
    turn[:3, 3] = (start + end) / 2 - turn[:3, :3] @ mesh.bounds.mean(axis=0)
    mesh.apply_transform(turn)
    points = rng.uniform(-1.5, 1.5, (20_000, 3))
    thin = radius * math.cos(math.pi / sides) ** 2 - 1e-5
    outer, inner = (
        behind(points, capsule_shadow(apex, start, end, np.asarray(r))) for r in (radius, thin)
    )
    seen = hidden(mesh, apex, points)
    assert 0 < seen.mean() < 1
    assert not np.any(seen & (outer > 1e-5))
    assert not np.any(~seen & (inner < -1e-5))

    body = drawn_polyhedra(rng)[0]
    corners = body.edges.reshape(-1, 3)
    mesh, apex = trimesh.convex.convex_hull(corners), np.array([0.9, -0.8, 0.85])
    value = largest(points, *polyhedron_shadow(apex[None], body))
    sure = np.abs(value) > 1e-5
    assert np.array_equal(hidden(mesh, apex, points)[sure], (value < 0)[sure])


def fan(rng, beam, rays):
    """Directions (R, 3) all over a cone, its rim among them, and their lengths to the flat base."""
    cosine = rng.uniform(math.cos(beam.half_angle), 1, rays)
    cosine[: rays // 4] = math.cos(beam.half_angle)
    turn = rng.uniform(0, 2 * math.pi, rays)
    across = np.cross(beam.axis, np.eye(3)[np.abs(beam.axis).argmin()])
    across /= np.linalg.norm(across)
    aside = np.cos(turn)[:, None] * across + np.sin(turn)[:, None] * np.cross(beam.axis, across)
    return cosine[:, None] * beam.axis + np.sqrt(1 - cosine**2)[
        :, None
    ] * aside, beam.range_m / cosine


def first_on_capsule(apex, way, start, end, radius):
    """Where rays first meet a capsule: quadratics of its cylinder and its balls."""
    axis = (end - start) / np.linalg.norm(end - start)
    m = apex - start
    u, v = way - np.outer(way @ axis, axis), m - (m @ axis) * axis

    def enters(a, b, c):
        d = b * b - a * c
        return np.where(d >= 0, (-b - np.sqrt(np.maximum(d, 0))) / a, np.inf)

    t = enters(np.maximum((u * u).sum(axis=1), 1e-12), u @ v, v @ v - radius**2)
    with np.errstate(invalid="ignore"):
        place = m @ axis + t * (way @ axis)
    t = np.where((place >= 0) & (place <= np.linalg.norm(end - start)), t, np.inf)
    for centre in (start, end):
        v = apex - centre
        t = np.minimum(t, enters(1.0, way @ v, v @ v - radius**2))
    return np.where(t > 0, t, np.inf)


def one_beam(rng):
    return Beam(
        rng.uniform(-0.5, 0.5, 3),
        uniform_directions(rng, 1)[0],
        np.array(rng.uniform(0.05, 1.2)),
        np.array(rng.uniform(0.3, 1.5)),
    )


def test_no_ray_of_a_dense_fan_meets_a_body_sooner():
    """No ray is nearer than the closed answer, which ends all of them; the fan comes close to
    it.
    """
    rng = np.random.default_rng(0)
    met = 0
    for _ in range(25):
        beam, (_, (start, *_), (end, *_), (radius, *_)) = one_beam(rng), drawn_capsules(rng, 30)
        gap = gap_to_capsules(beam.apex, start[None], end[None], radius[None])
        if gap < 1e-3 or np.all(start == end):
            continue
        way, reach = fan(rng, beam, 40_000)
        t = first_on_capsule(beam.apex, way, start, end, radius)
        near = np.where(t <= reach, t, np.inf).min()
        found, gap = capsule_in_beam(beam, start, end, radius)
        assert found <= near + 1e-9
        assert near <= found + 0.02 or gap > -0.02
        met += np.isfinite(near)
        for body in drawn_polyhedra(rng):
            if body(beam.apex[None])[0] < 1e-3:
                continue
            enter, leave = clipped(body, beam.apex, way)
            near = np.where((enter <= leave) & (enter > 0) & (enter <= reach), enter, np.inf).min()
            row = (beam.apex[None], beam.axis[None], beam.half_angle[None], beam.range_m[None])
            found = polyhedron_in_beam(Beam(*row), body)[0]
            assert found <= near + 1e-7
            narrow = polyhedron_in_beam(Beam(*row[:2], row[2] - 0.03, row[3]), body, margin=-0.01)[
                0
            ]
            assert near <= found + 0.03 or narrow == np.inf  # it grazes the rim
            met += np.isfinite(near)
    assert met > 20


@settings(max_examples=5)
@given(BODIES, GENERATORS)
def test_a_margin_brackets_the_blinded_distance(bodies, rng):
    """Of 200 beams at 200 capsules and at each body."""
    apex, start, end, radius = drawn_capsules(rng, 200)
    n = len(apex)
    beams = Beam(
        apex, uniform_directions(rng, n), rng.uniform(0.02, 1.3, n), rng.uniform(0.2, 1.5, n)
    )
    low, found, high = (
        capsule_in_beam(beams, start, end, radius, m)[0] for m in (1e-7, 0.0, -1e-7)
    )
    assert np.all(low <= found + MARGIN)
    assert np.all(found <= high + MARGIN)
    both = np.isfinite(low) & np.isfinite(high)
    assert both.sum() > 0
    assert np.quantile(high[both] - low[both], 0.95) < 1e-4
    for body in bodies:
        out = body(apex) > 1e-6
        row = tuple(a[out] for a in beams)
        low, found, high = (
            polyhedron_in_beam(Beam(*row), body, margin=m) for m in (1e-7, 0.0, -1e-7)
        )
        assert np.all(low <= found + MARGIN)
        assert np.all(found <= high + MARGIN)


def test_the_gap_of_a_cone_is_a_distance():
    """Its sign is the cone's, it is 1-Lipschitz, and no sampled point of the cone is nearer."""
    rng = np.random.default_rng(1)
    beam = one_beam(rng)
    points = rng.uniform(-2, 2, (800, 3))
    gap = cone_gap(beam, points)
    value = cone(
        points,
        beam.apex[None],
        beam.axis[None],
        np.cos(beam.half_angle),
        np.sin(beam.half_angle),
        beam.range_m,
    )
    assert np.array_equal(gap <= 0, value <= 0)
    way, reach = fan(rng, beam, 3000)
    inside = beam.apex + way * (reach * rng.random(3000) ** (1 / 3))[:, None]
    nearest = np.linalg.norm(points[:, None] - inside[None], axis=2).min(axis=1)
    assert np.all(gap <= nearest + 1e-12)
    assert np.quantile((nearest - gap)[gap > 0], 0.9) < 0.1
    assert np.all(np.abs(gap - value) >= -1e-12)


@pytest.mark.slow
def test_the_blinded_distance_has_its_gradient():
    """By apex and axis, against central differences; where the beam is not just grazed."""
    rng = np.random.default_rng(5)
    apex, start, end, radius = drawn_capsules(rng, 300)
    n = len(apex)
    towards = (start + end) / 2 - apex + rng.normal(size=(n, 3)) * 0.1
    axis = towards / np.linalg.norm(towards, axis=1, keepdims=True)
    half, reach = rng.uniform(0.05, 0.4, n), np.full(n, 3.0)

    def distance(apex, axis):
        return capsule_in_beam(Beam(apex, axis, half, reach), start, end, radius)[0]

    at = apex, axis
    met = np.isfinite(distance(*at))
    assert met.mean() > 0.5

    def total(*at):
        found = distance(*at)
        return jnp.where(met, found, 0.0).sum(), found

    slopes, found = jax.jit(jax.grad(total, (0, 1), has_aux=True))(*at)
    assert np.allclose(found[met], distance(*at)[met], atol=1e-9)
    for which, slope in enumerate(slopes):
        for i in range(3):
            step = 1e-6 * np.eye(3)[i]
            ends = [
                distance(*(a + sign * step if j == which else a for j, a in enumerate(at)))
                for sign in (1, -1)
            ]
            central = (ends[0][met] - ends[1][met]) / 2e-6
            assert np.quantile(np.abs(central - np.asarray(slope)[met, i]), 0.95) < 1e-4


def test_what_spans_no_volume_is_refused():
    with pytest.raises(ValueError, match="volume"):
        hull(np.zeros((5, 3)))
    with pytest.raises(ValueError, match="box"):
        box((0, 0, 0), (1, 0, 1))
    assert len(hull(np.concatenate([np.eye(3), -np.eye(3)])).offset) == 8
