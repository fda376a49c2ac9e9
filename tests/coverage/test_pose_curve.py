"""The pose curve and the tube it sweeps: lengths, volumes in closed form, what the shell holds."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.robots.built_in import ROBOTS
from place_rings.coverage.robots.pose_curve import pose_curve
from place_rings.coverage.soft.sampling import sample
from place_rings.coverage.solids.base import Parts
from place_rings.coverage.targets.named import Shell, named_target
from place_rings.coverage.targets.posed_robot import Shape, robot_curve
from place_rings.coverage.targets.solid import target_solid
from place_rings.coverage.voxels.octree import count

from ..strategies.solids import curve_points, some_tubes
from ..strategies.units import GENERATORS, failures, metres

STRAIGHT = np.array([[0.0, 0, 0], [0, 0, 0.4], [0, 0, 1.0]])


@pytest.mark.parametrize(("name", "length"), [("ur10", 1.753), ("ur10_dh", 1.604)])
def test_arc_length_of_the_reference_pose(name, length, reference_pose):
    assert robot_curve(ROBOTS[name], reference_pose, Shape()).arc_length() == pytest.approx(
        length, abs=6e-4
    )


@given(curve_points(2, 5), st.integers(5, 100))
def test_arc_length_is_that_of_many_chords(points_mm, blend_percent):
    points = metres(points_mm)
    curve = pose_curve(points, blend_percent / 100)
    t = np.linspace(0, 1, 4001)
    chords = sum(
        np.linalg.norm(np.diff(piece.point(t), axis=0), axis=1).sum() for piece in curve.pieces
    )
    assert curve.arc_length() == pytest.approx(chords, rel=1e-5)
    ends = [
        (piece.point(np.array([0.0]))[0], piece.point(np.array([1.0]))[0]) for piece in curve.pieces
    ]
    assert np.allclose(ends[0][0], points[0])
    assert np.allclose(ends[-1][1], points[-1])
    assert all(np.allclose(a[1], b[0]) for a, b in itertools.pairwise(ends))


def test_without_blend_the_curve_is_the_polyline():
    points = np.random.default_rng(0).uniform(-1, 1, (6, 3))
    polyline = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    assert pose_curve(points, 1e-6).arc_length() == pytest.approx(polyline, rel=1e-5)
    assert all(not piece.bend for piece in pose_curve(STRAIGHT).pieces)


def test_straight_tube_converges_to_pappus():
    curve = pose_curve(np.array([[0.01, 0.02, 0.03], [0.21, 0.33, 0.65], [0.41, 0.64, 1.27]]))
    # true where the tube never meets itself
    tube, volume = curve.tube(0.3, 20), math.pi * 0.3**2 * curve.arc_length()
    for voxel, allowed in ((0.1, 0.03), (0.05, 0.01), (0.025, 0.003), (0.0125, 0.001)):  # order 3/2
        assert count(tube, voxel) * voxel**3 == pytest.approx(volume, rel=allowed)


@given(some_tubes(), GENERATORS)
def test_tube_is_what_its_definition_says(tube, rng):
    """Between two neighbouring discs: plane functions of opposite sign, within r of the segment
    between the centres.
    """
    p = rng.uniform(-1.5, 1.5, (500, 3))
    inside = np.zeros(len(p), bool)
    for i in tube.first:
        a, b = tube.centre[i], tube.centre[i + 1]
        signs = ((p - a) @ tube.normal[i]) * ((p - b) @ tube.normal[i + 1]) <= 0
        t = np.clip((p - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        inside |= signs & (np.linalg.norm(p - a - t[:, None] * (b - a), axis=1) <= tube.radius)
    assert failures(p, (tube(p) <= 0) == inside) == []
    assert failures(p, tube.holds(p) == Parts.holds(tube, p)) == []
    assert np.all(tube(sample(tube, 100, 0)) <= 0)


@given(
    GENERATORS,
    st.floats(0.2, 1),
    st.sampled_from([0.5, 1.0, 2.0]),
    st.sampled_from([2, 3, 4, 19, 20]),
)
def test_an_arm_folded_back_is_the_limit_of_a_sharp_bend(rng, blend, ratio, points_per_bend):
    """Whichever way the arm comes to lie on itself, also where a disc falls on the turning point
    (an odd number of points, segments of one length).
    """
    along, aside = np.linalg.qr(rng.normal(size=(3, 2)))[0].T
    joint, p = 1.3 * along, rng.uniform(-0.8, 1.6, (2000, 3))

    def curve(off):  # the last segment turns back, off the first one by ``off``, rad
        back = -math.cos(off) * along + math.sin(off) * aside
        return pose_curve(np.array([np.zeros(3), 0.3 * along, joint, joint + ratio * back]), blend)

    folded, nearly = curve(0.0), curve(1e-7)
    assert folded.arc_length() == pytest.approx(nearly.arc_length(), abs=1e-5)
    tubes = [one.tube(0.4, points_per_bend)(p) for one in (folded, nearly)]
    clear = np.abs(tubes[1]) > 1e-5  # elsewhere 1e-7 rad may move a point across the surface
    assert np.array_equal(tubes[0][clear] <= 0, tubes[1][clear] <= 0)


def test_the_shell_is_continuous_where_the_elbow_folds(reference_pose):
    counts = []
    for elbow in (180.0, 179.9999):
        q = reference_pose.copy()
        q[2] = math.radians(elbow)
        counts.append(count(target_solid(Shell(0.5), ROBOTS["ur10_dh"], q), 0.05))
    assert counts[0] == pytest.approx(counts[1], rel=1e-3)


def test_impossible_curves_and_targets_are_refused(reference_pose):
    for blend in (0, -1, 1.5, math.nan):
        with pytest.raises(ValueError, match="blend"):
            pose_curve(STRAIGHT, blend)
    for name, radius in (
        ("V_X", None),
        ("V_S", None),
        ("V_O", 0.5),
    ):
        with pytest.raises(ValueError, match=name):
            named_target(name, radius)
    for radius in (-1.0, math.nan):
        with pytest.raises(ValueError, match="radius"):
            named_target("V_S", radius)
    with pytest.raises(ValueError, match="V_R"):
        target_solid(Shell(0.15), ROBOTS["ur10"], reference_pose)
