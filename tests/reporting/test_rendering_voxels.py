"""Voxels, the far side of a solid, and obstacles in pictures."""

import numpy as np
import place_rings as pr
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure
from place_rings.coverage.solids.capsules import Capsules
from place_rings.coverage.voxels.voxel_set import VoxelSet
from place_rings.reporting.rendering.canvas import Canvas
from place_rings.reporting.rendering.far_side import _farthest, add_far_side
from place_rings.reporting.rendering.meshes import convex_pieces, faces_within, sharp_edges
from place_rings.reporting.rendering.robot import add_obstacles, with_obstacles
from place_rings.reporting.rendering.voxels import add_skin, skin, voxel_set

SIDE = 0.25


def drawn(rng, reach=3, most=40):
    """Lattice numbers (N, 3) of a few voxels about the origin, each once."""
    return np.unique(rng.integers(-reach, reach, (int(rng.integers(1, most)), 3)), axis=0)


def canvas_from(azimuth_deg, elevation_deg, diagonals=np.inf):
    made = Canvas(
        None, np.array([[-1.0, -1, -1], [1, 1, 1]]), azimuth_deg, elevation_deg, diagonals
    )
    # unlit colours tell the voxels apart
    made.lit = lambda colour, normal: np.broadcast_to(colour, (len(normal), 3))
    return made


def slow_faces(numbers, eye):
    """Pairs of a voxel and a way out of it, towards the eye and with nothing behind."""
    present = set(map(tuple, numbers.tolist()))
    ways = [
        np.sign(eye[i]).astype(int) * np.eye(3, dtype=int)[i]
        for i in range(3)
        if abs(eye[i]) > 1e-9
    ]
    return {(v, tuple(w)) for v in present for w in ways if tuple(np.add(v, w)) not in present}


@pytest.mark.parametrize("eye", [(0.3, -0.8, 0.4), (-1, 1, -2), (0, 0, 1), (0, -1, 0.5)])
def test_exposed_faces_are_those_of_a_slow_count(eye):
    for seed in range(40):
        numbers = drawn(np.random.default_rng(seed))
        shown = skin(
            voxel_set(SIDE, np.random.default_rng(seed).permutation(numbers)), np.array(eye, float)
        )
        wanted = slow_faces(numbers, np.array(eye, float))
        assert shown.faces == len(wanted), f"seed {seed}"
        voxel, axis = np.nonzero(shown.exposed)
        found = zip(
            shown.numbers[voxel].tolist(),
            (shown.side * np.eye(3, dtype=int))[axis].tolist(),
            strict=True,
        )
        assert {(tuple(v), tuple(w)) for v, w in found} == wanted, f"seed {seed}"


def nearest(numbers, canvas, xy):
    """Index of the first voxel that a ray from the eye through ``xy`` meets, None if it meets none:
    box by box.
    """
    start = canvas.box.mean(axis=0) + xy @ canvas.rotation[:2]
    with np.errstate(divide="ignore"):
        ends = (np.stack([numbers, numbers + 1]) * SIDE - start) / canvas.rotation[2]
    enter, leave = ends.min(axis=0).max(axis=1), ends.max(axis=0).min(axis=1)
    met = leave > enter + 1e-9
    return int(np.argmax(np.where(met, leave, -np.inf))) if met.any() else None


def test_each_pixel_shows_the_voxel_that_a_ray_meets_first():
    """Of two sets on one canvas, from anywhere."""
    pixels = 24
    for seed in range(12):
        rng = np.random.default_rng(seed)
        numbers = drawn(rng)
        canvas = canvas_from(rng.uniform(-180, 180), rng.uniform(-85, 85))
        which = rng.integers(0, 2, len(numbers)).astype(bool)
        for part in (which, ~which):
            if part.any():
                s = skin(voxel_set(SIDE, numbers[part]), canvas.rotation[2])
                add_skin(canvas, s, (s.numbers + 8) / 16)
        image = canvas.image((-1.0, -1.0), 2 / pixels, (pixels, pixels), finer=1)
        wrong = 0
        for row, column in np.ndindex(pixels, pixels):
            first = nearest(numbers, canvas, (np.array([column, row]) + 0.5) * 2 / pixels - 1)
            *shown, alpha = image[row, column]
            if first is None:
                wrong += alpha > 0
            else:
                wrong += not np.allclose(np.array(shown) * 16 - 8, numbers[first], atol=1e-3)
        assert wrong <= 1, f"seed {seed}"  # a ray along an edge, by rounding


def test_a_near_eye_is_refused():
    canvas = canvas_from(20, 30, diagonals=4.0)
    s = skin(voxel_set(SIDE, np.zeros((1, 3), int)), canvas.rotation[2])
    with pytest.raises(ValueError, match="infinity"):
        add_skin(canvas, s, "#0072B2")


def test_an_empty_set_adds_nothing():
    canvas = canvas_from(-60, 20)
    s = skin(VoxelSet.empty(SIDE), canvas.rotation[2])
    assert s.faces == 0
    add_skin(canvas, s, (0.0, 0.45, 0.7))
    assert canvas.extent() is None


CORNERS = np.array([[0.0, 0, 0], [0.6, 0.2, 0.5], [1.0, -0.3, 0.1]])
OUTER = Capsules(CORNERS[:-1], CORNERS[1:], np.array([0.3, 0.2]))
BOX = np.array([[-0.4, -0.6, -0.4], [1.3, 0.6, 0.9]])


def view(diagonals):
    figure = Figure(figsize=(4, 3))
    return Canvas(figure.add_axes((0, 0, 1, 1), aspect="equal"), BOX, -58.0, 22.0, diagonals)


@pytest.mark.parametrize("diagonals", [4.0, np.inf])
def test_points_project_to_where_they_come_from(diagonals):
    canvas, points = view(diagonals), np.random.default_rng(1).uniform(*BOX, (50, 3))
    np.testing.assert_allclose(canvas.unproject(*canvas.project(points)), points, atol=1e-12)


@pytest.mark.parametrize("diagonals", [4.0, np.inf])
def test_rays_leave_where_the_implicit_function_says(diagonals):
    """To what the corners of the pieces cut off its round surface."""
    canvas, pieces = view(diagonals), convex_pieces(OUTER)
    xy = np.random.default_rng(2).uniform([-0.9, -0.6], [0.9, 0.6], (300, 2))
    depth, normal = _farthest(canvas, pieces, [canvas.hull(p) for p in pieces], xy)
    along = np.linspace(-1.2, 1.2, 2401)
    rays = canvas.unproject(np.repeat(xy[:, None], 2401, axis=1), np.tile(along, (300, 1)))
    value = OUTER(rays.reshape(-1, 3)).reshape(rays.shape[:2])
    inside = value <= 0
    clear = value.min(axis=1) < -0.05
    right = along[inside.argmax(axis=1)]
    assert np.isfinite(depth[clear]).all()
    assert not np.isfinite(depth[~inside.any(axis=1)]).any()
    assert clear.sum() > 50
    np.testing.assert_allclose(depth[clear], right[clear], atol=0.03)
    away = canvas.unproject(xy, -np.ones(300)) - canvas.unproject(xy, np.zeros(300))
    assert ((normal * away).sum(axis=1)[clear] > 0).all()


def test_the_image_keeps_the_view_and_shows_each_colour():
    canvas, pieces = view(4.0), convex_pieces(OUTER)
    canvas.ax.plot([-2, 2], [-1, 1])
    before = canvas.ax.get_xlim(), canvas.ax.get_ylim()

    def colours(points):
        return np.where(points[:, :1] > 0.5, [[1.0, 0, 0]], [[0, 0, 1.0]])

    add_far_side(canvas, pieces, [canvas.hull(p) for p in pieces], colours, 1.5)
    assert (canvas.ax.get_xlim(), canvas.ax.get_ylim()) == before
    (image,) = canvas.ax.images
    red, _, blue = np.moveaxis(np.asarray(image.get_array()), -1, 0)
    assert ((red > 0.2) & (blue < 0.2)).any()
    assert ((blue > 0.2) & (red < 0.2)).any()


PART = np.array([[-0.5, -0.5, -0.5], [0.5, 0.5, 0.5]])
ROOM = 3.0 * PART
sides = st.tuples(*[st.floats(0.05, 0.4)] * 3)
angles = st.tuples(*[st.floats(-180.0, 180.0)] * 3)


def cell(*obstacles):
    return pr.Scene(obstacles=obstacles, base="base_link")


@given(sides, angles)
def test_a_turned_box_has_its_twelve_edges(size, rpy_deg):
    (one,) = cell(pr.Obstacle("box", size=size, rpy_deg=rpy_deg)).obstacles
    edges = sharp_edges(faces_within(one.body, ROOM))
    lengths = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)
    assert np.allclose(np.sort(lengths), np.sort(np.repeat(size, 4)), atol=1e-5)


@given(st.integers(0, 2), st.sampled_from([-1, 1]))
def test_a_wall_beside_the_box_is_drawn_and_a_far_one_is_not(axis, side):
    size, near, far = np.ones(3), np.zeros(3), np.zeros(3)
    size[axis], near[axis], far[axis] = 0.1, 0.6 * side, 1.6 * side
    box = with_obstacles(PART, cell(pr.Obstacle("wall", size=size, centre=near)))
    assert np.abs(box[:, axis]).max() > 0.64
    assert np.allclose(with_obstacles(PART, cell(pr.Obstacle("wall", size=size, centre=far))), PART)
    assert np.allclose(with_obstacles(PART, cell(pr.Obstacle("floor", floor=-0.6))), PART)


def test_a_table_hides_nothing_from_above():
    ground = np.array(
        [[[-0.4, -0.4, -0.4], [0.4, -0.4, -0.4], [0.4, 0.4, -0.4], [-0.4, 0.4, -0.4]]]
    )
    table = pr.Obstacle("table", size=(0.7, 0.7, 0.05))

    def picture(*obstacles):
        canvas = Canvas(None, PART, -90.0, 89.99)
        canvas.faces(ground, "#009E73")
        add_obstacles(canvas, cell(*obstacles))
        return canvas.image(np.array([-0.3, -0.3]), 0.01, (60, 60))[..., :3]

    assert np.abs(picture(table) - picture()).max() < 0.2
