"""Pictures of voxels: the faces that are drawn, which of them is seen, and the numbers beside
them.
"""

import numpy as np
import pytest
from PIL import Image
from place_rings.coverage.rings.ring import named_setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.solids.spheres import sphere
from place_rings.coverage.targets import Target
from place_rings.coverage.voxels.octree import count, voxels
from place_rings.coverage.voxels.voxel_set import VoxelSet
from place_rings.objectives.scene import paper_scene
from place_rings.objectives.verify import Verifier
from place_rings.reporting.rendering.canvas import Canvas
from place_rings.reporting.rendering.voxels import (
    add_skin,
    cut_open,
    holds,
    normals,
    openness,
    skin,
    voxel_set,
)
from place_rings.studies.paper import cone_figure, octree_panels
from place_rings.studies.paper.cone_figure import CONE_VOXELS, one_cone
from place_rings.studies.paper.octree_figures import four_panels, shells

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


def test_edges_of_voxels_lie_over_their_faces():
    canvas = canvas_from(-60, 20)
    s = skin(voxel_set(SIDE, np.zeros((1, 3), int)), canvas.rotation[2])
    add_skin(canvas, s, (0.0, 0.5, 1.0), line=3.0)
    image = canvas.image((-1.0, -1.0), 0.01, (200, 200), finer=1)
    blue = image[..., 2][image[..., 3] > 0]
    assert set(np.unique(blue.round(3))) == {np.float32(0.72), np.float32(1.0)}
    assert 0.05 < (blue < 1).mean() < 0.5


def test_a_near_eye_is_refused():
    canvas = canvas_from(20, 30, diagonals=4.0)
    with pytest.raises(ValueError, match="infinity"):
        add_skin(
            canvas, skin(voxel_set(SIDE, np.zeros((1, 3), int)), canvas.rotation[2]), "#0072B2"
        )


def test_a_cut_parts_a_set_in_two():
    ball = voxels(sphere(np.array([0.1, 0.2, 0.3]), 1.0), 0.1)
    for axis in range(3):
        far, near = (cut_open(ball, axis, 0.2, side) for side in (1, -1))
        assert len(far & near) == 0
        assert far | near == ball
        assert far.centres()[:, axis].max() < 0.2 < near.centres()[:, axis].min()


def test_normals_of_a_ball_point_away_from_its_middle():
    middle, ball = np.array([0.3, -0.1, 0.2]), sphere(np.array([0.3, -0.1, 0.2]), 0.8)
    s = skin(voxels(ball, 0.05), np.array([0.2, -0.7, 0.5]))
    way = s.centres - middle
    found = normals(ball, s.centres, 0.05)
    assert (np.sum(found * way, axis=1) > 0.999 * np.linalg.norm(way, axis=1)).all()


def test_flat_faces_are_open_and_the_floor_of_a_pit_is_not():
    block = np.argwhere(np.ones((30, 30, 12), bool)) - 15
    pit = (np.abs(block[:, :2]) < 2).all(axis=1) & (block[:, 2] > -10)
    up = np.array([0.1, 0.1, 1.0])
    flat, dug = (voxel_set(SIDE, b) for b in (block, block[~pit]))
    for voxel, low, high, in_pit in ((flat, 1, 1, False), (dug, 0, 0.9, True)):
        s = skin(voxel, up)
        top = s.exposed[:, 2] & (np.abs(s.numbers[:, :2]) < 2).all(axis=1)
        assert (s.numbers[top, 2] == (-10 if in_pit else -4)).all()
        value = openness(s, voxel)[top]
        assert low <= value.min()
        assert value.max() <= high
    assert holds(flat, np.array([[0, 0, -4], [0, 0, -3]])).tolist() == [True, False]


@pytest.fixture
def coarse(monkeypatch):
    """Pictures of few pixels, and volumes averaged over few places."""
    monkeypatch.setattr(octree_panels, "_DPI", 50)
    monkeypatch.setattr(cone_figure, "PLACES", 12)


def test_panels_show_what_the_octree_counts(coarse, tmp_path):
    scene, voxel, name = paper_scene(), 0.1, "n1_4_0"
    found = four_panels(tmp_path / "a.png", scene, name, 0.9, voxel)
    checked = Verifier(scene, voxel).verify(named_setup(name), Target("V_S", 0.9))
    assert found["shell_voxels"] == checked.target_voxels
    assert (
        found["covered_voxels"]
        == checked.covered_voxels
        == found["shell_voxels"] - found["left_voxels"]
    )
    assert found["zeta_percent"] == pytest.approx(100 * checked.zeta)
    cones = sensor_cones(scene.robot, named_setup(name), scene.poses[0].q)
    assert found["fov_voxels"] == count(cones, voxel)
    rows = shells(tmp_path / "shells.png", scene, name, (0.5, 0.9), voxel)
    assert rows == shells(tmp_path / "again.png", scene, name, (0.5, 0.9), voxel)
    assert (tmp_path / "shells.png").read_bytes() == (tmp_path / "again.png").read_bytes()
    assert rows[1] == found
    assert [row["radius"] for row in rows] == [0.5, 0.9]
    for file in ("a.png", "shells.png"):
        pixels = np.asarray(Image.open(tmp_path / file))
        assert 0.1 < (pixels.min(axis=2) < 250).mean() < 0.9, file


def test_the_cone_by_its_voxels(coarse, tmp_path):
    rows = one_cone(tmp_path / "cone.png")
    assert [(row["rule"], row["voxel"]) for row in rows] == [
        (r, v) for r in ("centre", "touch") for v in CONE_VOXELS
    ]
    for row in rows:
        assert row["closed_form_m3"] == pytest.approx(0.1737, abs=5e-5)
        assert row["volume_m3"] == pytest.approx(row["voxels"] * row["voxel"] ** 3)
        # the mean over all places is the volume; four deviations of a mean of 12
        if row["rule"] == "centre":
            assert abs(row["mean_m3"] - row["closed_form_m3"]) < 1.2 * row["deviation_m3"]
        else:
            assert row["volume_m3"] > row["closed_form_m3"]
    touched = [row["mean_m3"] for row in rows if row["rule"] == "touch"]
    assert touched == sorted(touched, reverse=True)


def test_an_empty_set_adds_nothing():
    canvas = canvas_from(-60, 20)
    s = skin(VoxelSet.empty(SIDE), canvas.rotation[2])
    assert s.faces == 0
    assert len(openness(s, VoxelSet.empty(SIDE))) == 0
    add_skin(canvas, s, (0.0, 0.45, 0.7), normals(sphere(np.zeros(3), 1.0), s.centres, SIDE))
    assert canvas.extent() is None
