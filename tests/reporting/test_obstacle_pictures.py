"""Obstacles in pictures: what lies near is drawn, by its edges, and hides nothing."""

import numpy as np
import place_rings as pr
from hypothesis import given
from hypothesis import strategies as st
from place_rings.reporting.rendering.canvas import Canvas
from place_rings.reporting.rendering.meshes import faces_within, sharp_edges
from place_rings.reporting.rendering.robot import add_obstacles, with_obstacles

BOX = np.array([[-0.5, -0.5, -0.5], [0.5, 0.5, 0.5]])
ROOM = 3.0 * BOX
sides = st.tuples(*[st.floats(0.05, 0.4)] * 3)
angles = st.tuples(*[st.floats(-180.0, 180.0)] * 3)


def cell(*obstacles):
    return pr.Scene(obstacles=obstacles, base="base_link").core


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
    box = with_obstacles(BOX, cell(pr.Obstacle("wall", size=size, centre=near)))
    assert np.abs(box[:, axis]).max() > 0.64
    assert np.allclose(with_obstacles(BOX, cell(pr.Obstacle("wall", size=size, centre=far))), BOX)
    assert np.allclose(with_obstacles(BOX, cell(pr.Obstacle("floor", floor=-0.6))), BOX)


def test_a_table_hides_nothing_from_above():
    ground = np.array(
        [[[-0.4, -0.4, -0.4], [0.4, -0.4, -0.4], [0.4, 0.4, -0.4], [-0.4, 0.4, -0.4]]]
    )
    table = pr.Obstacle("table", size=(0.7, 0.7, 0.05))

    def picture(*obstacles):
        canvas = Canvas(None, BOX, -90.0, 89.99)
        canvas.faces(ground, "#009E73")
        add_obstacles(canvas, cell(*obstacles))
        return canvas.image(np.array([-0.3, -0.3]), 0.01, (60, 60))[..., :3]

    assert np.abs(picture(table) - picture()).max() < 0.2
