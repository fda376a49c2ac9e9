"""The far side of a target in pictures: where rays leave it, by its implicit function alone."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from place_rings.coverage.solids.capsules import Capsules
from place_rings.reporting.rendering.canvas import Canvas
from place_rings.reporting.rendering.far_side import _farthest, add_far_side
from place_rings.reporting.rendering.meshes import convex_pieces

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
