"""The renderer: what hides what, which pixels a triangle covers, light, and translucent layers."""

import math

import numpy as np
import pytest
from hypothesis import given
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from place_rings.coverage.solids.polyhedra import box
from place_rings.reporting.rendering.canvas import Canvas
from place_rings.reporting.rendering.colours import rgb
from place_rings.reporting.rendering.figures import write_png
from place_rings.reporting.rendering.meshes import ball, capsule, closed, cone, faces_within, tube
from place_rings.reporting.rendering.rasterizer import UNLIT, DepthBuffer, Triangles, shaded

from ..support import drawing

CUBE = np.array([[-1.0, -1, -1], [1, 1, 1]])
RED, BLUE, GREEN = np.eye(3)[[0, 2, 1]]
UP = np.eye(3)[2]


def picture(canvas, pixels=200, finer=1, **how):
    """The picture of all between -1 m and 1 m."""
    return canvas.image((-1.0, -1.0), 2 / pixels, (pixels, pixels), finer, **how)


def square(depth, half=0.5, middle=(0.0, 0.0)):
    """A face (1, 4, 3) across z."""
    corners = np.array([(-half, -half), (half, -half), (half, half), (-half, half)]) + middle
    return np.column_stack([corners, np.full(4, depth)])[None]


def above(diagonals=np.inf):
    """A canvas seen from above, x to the right and y up."""
    return Canvas(None, CUBE, -90.0, 90.0, diagonals)


def triangles(rng, count, size=40.0, alpha=1.0):
    """Unlit triangles of drawn colours, some of them outside of a picture of 60 by 60."""
    corners = rng.uniform(-10, 70, (count, 1, 3)) + rng.uniform(-size, size, (count, 3, 3))
    unlit = np.full((count, 3), UNLIT)
    return Triangles(corners, rng.uniform(size=(count, 3)), unlit, np.full(count, alpha))


def slow_depths(some, shape):
    """Depth (N, H, W) of each triangle at the centre of each pixel, -inf where it is not."""
    y, x = (np.mgrid[: shape[0], : shape[1]] + 0.5).reshape(2, -1)
    out = np.full((len(some), x.size), -np.inf)
    for k, (a, b, c) in enumerate(some.corners):
        share = np.linalg.solve(
            np.vstack([np.stack([a, b, c])[:, :2].T, np.ones(3)]), [x, y, 1 + 0 * x]
        )
        inside = (share >= 0).all(axis=0)
        out[k, inside] = share.T[inside] @ [a[2], b[2], c[2]]
    return out.reshape(len(some), *shape)


@given(drawing.seeds)
def test_each_pixel_shows_the_nearest_triangle(seed):
    """Against every triangle solved for at every pixel."""
    some = triangles(np.random.default_rng(seed), 8)
    buffer = DepthBuffer((60, 60))
    buffer.opaque(some)
    depth = slow_depths(some, (60, 60))
    nearest = depth.max(axis=0).ravel()
    np.testing.assert_array_equal(buffer.alpha > 0, np.isfinite(nearest))
    shown = np.isfinite(nearest)
    np.testing.assert_allclose(buffer.depth[shown], nearest[shown], rtol=1e-4, atol=1e-3)
    order = np.sort(depth.reshape(8, -1), axis=0)
    clear = shown & (order[-1] > np.where(np.isfinite(order[-2]), order[-2], -1e9) + 0.01)
    winner = depth.reshape(8, -1).argmax(axis=0)
    np.testing.assert_allclose(buffer.colour[clear], some.colour[winner[clear]], atol=1e-6)


@given(drawing.seeds)
def test_the_order_of_triangles_does_not_matter(seed):
    rng = np.random.default_rng(seed)
    some, order = triangles(rng, 12), rng.permutation(12)
    one, other = DepthBuffer((60, 60)), DepthBuffer((60, 60))
    one.opaque(some)
    for k in order:  # one by one
        one_of = (some.corners, some.colour, some.light, some.alpha)
        other.opaque(Triangles(*(value[k : k + 1] for value in one_of)))
    np.testing.assert_array_equal(one.colour, other.colour)
    np.testing.assert_array_equal(one.depth, other.depth)


@given(drawing.seeds)
def test_triangles_side_by_side_leave_no_gap_and_share_no_pixel(seed):
    """A convex polygon cut into a fan from a point inside: each pixel of it belongs to one."""
    rng = np.random.default_rng(seed)
    turn = np.sort(rng.uniform(0, 2 * np.pi, 9))
    rim = 30 + 25 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    middle = rim.mean(axis=0)
    fan = np.stack([np.broadcast_to(middle, rim.shape), rim, np.roll(rim, -1, axis=0)], axis=1)
    count = np.zeros(3600)
    for corners in fan:
        buffer = DepthBuffer((60, 60))
        buffer.opaque(Triangles(corners[None], RED[None], np.full((1, 3), UNLIT), np.ones(1)))
        row = buffer.alpha.reshape(60, 60)
        for line in row:  # convex: each row is one run
            assert (np.diff(line, prepend=0, append=0) != 0).sum() in (0, 2)
        count += buffer.alpha
    assert count.max() == 1
    edge = np.roll(rim, -1, axis=0) - rim
    y, x = np.mgrid[:60, :60].reshape(2, -1) + 0.5
    inside = np.all(
        [(x - p[0]) * e[1] - (y - p[1]) * e[0] < -1e-9 for p, e in zip(rim, edge, strict=True)],
        axis=0,
    )
    assert (count[inside] == 1).all()


@pytest.mark.parametrize("diagonals", [np.inf, 3.0])
def test_a_nearer_face_hides_a_farther_one(diagonals):
    for swap in (False, True):
        canvas = above(diagonals)
        for depth, colour in sorted([(0.3, RED), (-0.3, BLUE)], key=lambda v: v[0], reverse=swap):
            canvas.faces(square(depth), colour, lit=False)
        canvas.lines(np.array([[[-0.9, 0, 0.0], [0.9, 0, 0]]]), GREEN, 3.0)
        canvas.points(np.array([[0, 0.2, 0.0], [0, -0.2, 0.6]]), GREEN, 0.05)
        shown = picture(canvas)[..., :3]
        np.testing.assert_allclose(shown[130, 100], RED)  # before the line
        np.testing.assert_allclose(shown[100, 20], GREEN)  # beside the faces the line is seen
        np.testing.assert_allclose(shown[120, 100], RED)  # a spot behind
        np.testing.assert_allclose(shown[76 if diagonals > 9 else 75, 100], GREEN)  # and before


@pytest.mark.parametrize("solid", ["ball", "capsule", "cone"])
def test_silhouettes_have_the_area_of_their_formula(solid):
    """In parallel projection from the side: a disc, a stadium, a triangle."""
    a, b = -0.4 * UP, 0.3 * UP
    shape, area = {
        "ball": (tube(ball(np.zeros(3), 0.7, 61)), math.pi * 0.49),
        "capsule": (closed(capsule(a, b, 0.25)), math.pi * 0.25**2 + 0.7 * 0.5),
        "cone": (cone(a, UP, math.atan(0.5), 1.0), 0.5),
    }[solid]
    for is_closed in (False, True):
        canvas = Canvas(None, CUBE, 20.0, 0.0)
        canvas.mesh(shape, RED, closed=is_closed)
        assert picture(canvas, 400)[..., 3].sum() * 0.005**2 == pytest.approx(area, rel=0.006)
        ragged = picture(canvas, 100, finer=4)[..., 3]
        assert ragged.sum() * 0.02**2 == pytest.approx(area, rel=0.006)
        assert ((ragged > 0) & (ragged < 1)).any()  # its edge is smoothed


@given(drawing.seeds)
def test_translucent_layers_compose_from_near_to_far(seed):
    """Against one layer after the other, painted from the farthest."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 8))
    depth, alpha = rng.permutation(np.linspace(-0.9, 0.9, n)), rng.uniform(0.05, 0.95, n)
    colour, wall = rng.uniform(size=(n, 3)), float(rng.uniform(-1, 1))
    canvas = above()
    for d, a, c in zip(depth, alpha, colour, strict=True):
        canvas.faces(square(d), c, a, lit=False)
    canvas.faces(square(wall, 0.25, (0.25, 0)), GREEN, lit=False)
    shown = picture(canvas, 40)
    for column, back in ((15, None), (25, wall)):
        rgba = np.array([0.0, 0, 0, 0]) if back is None else np.array([*GREEN, 1.0])
        for k in np.argsort(depth):
            if back is None or depth[k] > back:
                rgba = (1 - alpha[k]) * rgba + alpha[k] * np.array([*colour[k], 1.0])
        seen = shown[20, column]
        assert seen[3] == pytest.approx(rgba[3], abs=1e-5)
        np.testing.assert_allclose(seen[:3] * seen[3], rgba[:3], atol=1e-5)


def test_light_is_half_ambient_half_diffuse_and_the_same_from_both_sides():
    canvas = above()
    way = np.array([-0.45, 0.6, 0.66])
    assert canvas.light(way / np.linalg.norm(way)) == pytest.approx(np.linalg.norm(way))
    np.testing.assert_allclose(canvas.light(-np.eye(3)), canvas.light(np.eye(3)))
    colour = np.array([[0.2, 0.4, 0.6]])
    np.testing.assert_allclose(shaded(colour, np.zeros(1)), 0.5 * colour)
    np.testing.assert_allclose(shaded(colour, np.full(1, UNLIT)), colour)
    assert (np.diff(shaded(np.repeat(colour, 9, axis=0), np.linspace(0, 1, 9)), axis=0) > 0).all()
    lit = canvas.lit("#336699", UP[None])[0]
    for turned in (square(0.0), square(0.0)[:, ::-1]):
        canvas = above()
        canvas.faces(turned, "#336699")
        np.testing.assert_allclose(picture(canvas, 20)[10, 10, :3], lit, atol=1e-6)


def test_a_ball_is_shaded_by_its_normals():
    """A mesh of few triangles, at each pixel by the normal of the ball there."""
    canvas = above()
    canvas.mesh(tube(ball(np.zeros(3), 0.9, 25)), "#808080", closed=True)
    shown = picture(canvas, 101)[..., 0]
    y, x = (np.mgrid[:101, :101] - 50) * (2 / 101)
    inner = np.hypot(x, y) < 0.8
    normal = np.stack([x, y, np.sqrt(np.maximum(0.81 - x**2 - y**2, 0))], axis=-1)[inner] / 0.9
    np.testing.assert_allclose(shown[inner], canvas.lit("#808080", normal)[:, 0], atol=0.02)


def test_how_a_flat_face_is_cut_does_not_show():
    """A tube of two circles, whose quadrangles are cut along one diagonal, is as light at both
    ends."""
    canvas = Canvas(None, CUBE, 0.0, 0.0)
    canvas.mesh(tube(np.stack([ball(z * UP, 0.6, 3)[1] for z in (-0.8, 0.8)])), RED, closed=True)
    shown = picture(canvas, 100)[..., 0]
    np.testing.assert_allclose(shown[15], shown[84], atol=1e-5)


def test_an_outline_is_where_depth_jumps():
    canvas = above()
    canvas.faces(square(-0.5, 0.8), RED, lit=False)
    canvas.faces(square(0.5, 0.4), RED, lit=False)
    shown = picture(canvas, 100, outline=0.3)[50, :, 0]
    assert sorted(np.flatnonzero((shown > 0) & (shown < 1))) == [10, 30, 70]
    assert shown[50] == shown[15] == 1


def test_what_lies_in_the_axes_lies_where_they_say(tmp_path):
    """Into a figure: a face fills the pixels that its coordinates say, over a ruler of the axes."""
    figure = Figure(figsize=(2, 2), dpi=100)
    ax = figure.add_axes((0, 0, 1, 1))
    canvas = Canvas(ax, CUBE, -90.0, 90.0)
    canvas.faces(square(0.0, 0.25, (0.5, -0.25)), RED, lit=False)
    ax.axhline(-0.25, color="black", zorder=1)
    np.testing.assert_allclose(canvas.extent(), [[0.25, -0.5], [0.75, 0.0]], atol=1e-12)
    canvas.draw()
    assert canvas.extent() is None
    np.testing.assert_allclose(ax.dataLim.get_points()[:, 1], [-0.5, 0.0], atol=1e-12)
    ax.set(xlim=(-1, 1), ylim=(-1, 1))
    agg = FigureCanvasAgg(figure)
    agg.draw()
    pixels = np.asarray(agg.buffer_rgba())[::-1, :, :3]
    red = (pixels == [255, 0, 0]).all(axis=2)
    rows, columns = np.nonzero(red)
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (50, 99, 125, 174)
    assert red.sum() == 50 * 50
    write_png(tmp_path / "a.png", figure)
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


def test_of_nothing_there_is_an_empty_picture():
    canvas = above()
    for add in (canvas.faces, canvas.lines):
        add(np.zeros((0, 4, 3)), RED, 1.0)
    canvas.points(np.zeros((0, 3)), RED, 0.1)
    canvas.draw()
    assert canvas.extent() is None
    assert (picture(canvas, 10) == 0).all()
    assert rgb("#ff0080").tolist() == [1.0, 0.0, 128 / 255]


def test_a_box_in_a_room_has_twelve_triangles_that_enclose_it():
    inside = box(np.array([0.2, 0.1, 0.0]), np.array([0.4, 0.6, 4.0]))
    faces = faces_within(inside, CUBE)
    assert faces.shape == (12, 3, 3)
    area = 0.5 * np.linalg.norm(
        np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0]), axis=1
    )
    assert area.sum() == pytest.approx(2 * (0.4 * 0.6 + 0.4 * 2 + 0.6 * 2))
    assert faces_within(box(np.full(3, 5.0), np.ones(3)), CUBE).shape == (0, 3, 3)


@given(drawing.seeds)
def test_each_pixel_shows_the_nearest_spot(seed):
    rng = np.random.default_rng(seed)
    shape, count = (12, 17), 20
    centre, radius = rng.uniform(-6, 22, (count, 3)), rng.uniform(0, 9, count)
    centre[::2] = np.round(
        centre[::2]
    )  # some through the centres of pixels, some as near as others
    colour = rng.uniform(size=(count, 3))
    y, x = np.mgrid[: shape[0], : shape[1]] + 0.5
    depth, expected = np.full(shape, -np.inf), np.zeros((*shape, 3))
    for (cx, cy, z), r, c in zip(centre, radius, colour, strict=True):
        gap = ((y - cy) ** 2).astype(np.float32) + ((x - cx) ** 2).astype(np.float32)
        mine = (gap <= r**2) & (np.float32(z) >= depth)
        depth[mine], expected[mine] = np.float32(z), c
    buffer = DepthBuffer(shape)
    buffer.stamp(centre, radius, colour)
    np.testing.assert_array_equal(buffer.depth.reshape(shape), depth)
    np.testing.assert_array_equal(buffer.colour.reshape(*shape, 3), expected.astype(np.float32))


def test_spots_far_off_or_wide_or_no_numbers_leave_the_picture_whole():
    canvas, plain = above(), above()
    for one in (canvas, plain):
        one.points(np.zeros((1, 3)), GREEN, 0.1)
    for far in (np.nan, np.inf, 1e15, -1e300):
        canvas.points(np.array([[far, 0.0, 0.0], [0.0, far, 0.0]]), RED, 0.1)
    canvas.points(np.zeros((1, 3)), RED, np.nan)
    canvas.points(np.full((3, 3), np.nan), RED, 0.1)
    np.testing.assert_array_equal(picture(canvas), picture(plain))
    buffer = DepthBuffer((8, 8))  # without a canvas before it
    nan, one = np.nan, np.ones(4)
    buffer.stamp(
        np.array([[nan, 1, 1], [1, nan, 1], [1, 1, nan], [1, 1, 1]]), nan * one, np.eye(4, 3)
    )
    assert not buffer.alpha.any()
    for radius in (1e4, 1e200, np.inf):
        wide = above()
        wide.points(np.array([[0.0, 0, -0.5]]), RED, 0.0)
        wide.points(np.array([[0.0, 0, -0.9]]), BLUE, radius)
        shown = picture(wide, 20)
        assert shown.shape == (20, 20, 4)
        assert (shown[..., 3] == 1).all() == np.isfinite(radius)
