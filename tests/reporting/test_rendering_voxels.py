"""Pictures of voxels: the faces that are drawn, and which of them is seen."""

import numpy as np
import pytest
from place_rings.coverage.voxels.voxel_set import VoxelSet
from place_rings.reporting.rendering.canvas import Canvas
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
