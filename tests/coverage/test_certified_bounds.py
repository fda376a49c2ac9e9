"""The guaranteed interval: it holds the truth, always, and is as narrow as asked."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from place_rings.coverage.rings.ring import named_setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.robots.built_in import UR10
from place_rings.coverage.robots.pose_curve import pose_curve
from place_rings.coverage.soft.sampling import EmptySolidError, sample
from place_rings.coverage.solids.base import Difference
from place_rings.coverage.solids.capsules import Capsules
from place_rings.coverage.solids.cones import Cones
from place_rings.coverage.solids.pyramids import Pyramids
from place_rings.coverage.solids.spheres import Spheres, sphere
from place_rings.coverage.solids.volume_fraction import VolumeFraction
from place_rings.coverage.targets.named import Shell
from place_rings.coverage.targets.solid import target_solid
from place_rings.coverage.voxels import certified_bounds as certified
from place_rings.coverage.voxels.certified_bounds import bracket
from place_rings.coverage.voxels.octree import count, voxels
from place_rings.coverage.voxels.volume_tally import Bracket, VolumeTally
from place_rings.objectives import verify as exact
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import Verifier

from ..strategies.scenes import scenes
from ..strategies.units import GENERATORS


def one_cone(apex, axis, half, range_m):
    return Cones(
        np.array([apex], float),
        np.array([axis], float),
        np.array([half]),
        np.array([float(range_m)]),
    )


@settings(max_examples=3)
@given(scenes(), GENERATORS)
def test_holds_the_share_of_many_points(scene, rng):
    """Hoeffding: n points are off by more than the noise once in 10^7."""
    solid, cones = scene.solid, scene.cones
    low, high = solid.bounds()
    n = 20_000
    p = rng.uniform(low, high, (n, 3))
    p = p[solid(p) <= 0]
    share = float((cones(p) <= 0).mean())
    noise, noise_of_box = (math.sqrt(math.log(2e7) / (2 * number)) for number in (len(p), n))
    box = float(np.prod(high - low))
    wide, narrow = bracket(solid, cones, voxel=0.15), bracket(solid, cones, width=0.02)
    assert narrow.reached
    assert narrow.width <= 0.02
    for b in (wide, narrow):
        assert b.low - noise <= share <= b.high + noise
        assert b.volume_low <= (len(p) / n + noise_of_box) * box
        assert b.volume_high >= (len(p) / n - noise_of_box) * box
    assert max(wide.low, narrow.low) <= min(wide.high, narrow.high)


def test_holds_the_share_of_points_and_voxels_of_the_reference_scene(reference_pose):
    """Every point is evaluated against every cone and slab; the voxels are finer than the
    interval.
    """
    target = target_solid(Shell(0.5), UR10, reference_pose)
    cones = sensor_cones(UR10, named_setup("n3_16_55"), reference_pose)
    low, high = target.bounds()
    points = np.random.default_rng(0).uniform(low, high, (30_000, 3))
    points = points[target(points) <= 0]
    share, noise = (cones(points) <= 0).mean(), math.sqrt(math.log(2e7) / (2 * len(points)))
    b = bracket(target, cones, width=2e-3)
    assert b.reached
    assert b.low - noise <= share <= b.high + noise
    ball = voxels(target, 0.015)
    assert count(cones, 0.015, within=ball) / len(ball) == pytest.approx(
        (b.low + b.high) / 2, abs=2e-3
    )


def closed_forms():
    half, r = 0.4, 0.7
    cone = one_cone((0, 0, 0), (0.6, 0, 0.8), half, 2)
    ball = 4 / 3 * math.pi
    lens = math.pi / 12 * (1 + r - 0.9) ** 2 * (0.9**2 + 2 * 0.9 * (1 + r) - 3 * (1 - r) ** 2) / 0.9
    disc = np.array([0.0, 0.6, 0.8])
    ends = np.array([[-0.2, 0.1, 0.0], [0.3, -0.1, 0.2]])
    tube = pose_curve(np.array([[0.0, 0, 0], disc])).tube(0.3, 20)
    narrow = pose_curve(np.array([[0.0, 0, 0], disc])).tube(0.1, 20)
    return {
        "a cone from the centre of a ball": (
            sphere(np.zeros(3), 1.0),
            cone,
            (1 - math.cos(half)) / 2,
            ball,
        ),
        "a cone with its base in a ball": (
            sphere(np.zeros(3), 1.0),
            one_cone((-0.3, 0, 0), (1, 0, 0), 0.5, 0.6),
            0.6**3 * math.tan(0.5) ** 2 / 4,
            ball,
        ),
        "two balls": (sphere(np.zeros(3), 1.0), sphere((0, 0.9, 0), r), lens / ball, ball),
        "a ball in a shell": (
            Difference(sphere(np.zeros(3), 1.0), sphere(np.zeros(3), 0.5)),
            sphere(np.zeros(3), 0.8),
            (0.8**3 - 0.5**3) / (1 - 0.5**3),
            ball * (1 - 0.5**3),
        ),
        "a capsule in a ball": (
            sphere(np.zeros(3), 0.6),
            Capsules(ends[:1], ends[1:], np.array([0.15])),
            (math.pi * 0.15**2 * math.dist(*ends) + ball * 0.15**3) / (ball * 0.6**3),
            ball * 0.6**3,
        ),
        "a pyramid from the centre of a ball": (
            sphere(np.zeros(3), 1.0),
            Pyramids(
                np.zeros((1, 3)),
                np.array([[0.6, 0, 0.8]]),
                np.array([0.3]),
                np.array([0.7]),
                np.array([[0.48, 0.8, -0.36]]),
                np.array([0.5]),
            ),
            4 / 3 * 0.7**3 * math.tan(0.3) * math.tan(0.5) / ball,
            ball,
        ),
        "two tubes": (tube, narrow, 1 / 9, math.pi * 0.09),
        "the same ball twice": (
            sphere(np.zeros(3), 1.0),
            Spheres(np.zeros((2, 3)), np.array([0.5, 0.5])),
            1 / 8,
            ball,
        ),
    }


CHEAP = ("two balls", "a cone with its base in a ball")


@pytest.mark.parametrize("name", closed_forms())
def test_holds_closed_forms(name):
    """To a tenth of a point, and to a hundredth where few cells reach it."""
    target, seen, share, volume = closed_forms()[name]
    for width in (1e-2, 1e-3, 1e-4) if name in CHEAP else (1e-2, 1e-3):
        b = bracket(target, seen, width)
        assert b.reached
        assert b.low <= share <= b.high
        assert b.high - b.low <= width
        assert b.volume_low <= volume <= b.volume_high


def test_cells_of_one_size_are_second_order():
    """What cells of side s leave open falls with s^2, and with s^2 only where edges lie."""
    target, seen, _, _ = closed_forms()["a cone from the centre of a ball"]
    widths = [bracket(target, seen, voxel=voxel).width for voxel in (0.1, 0.05, 0.025, 0.0125)]
    assert all(a / b > 3 for a, b in pairwise(widths))


def test_wholly_seen_and_wholly_unseen():
    ball = sphere([0.0, 0, 0], 0.3)
    around, away = one_cone((0, 0, -5), (0, 0, 1), 0.5, 10), one_cone((0, 0, 5), (0, 0, 1), 0.5, 1)
    for how in ({"voxel": 0.05}, {"width": 1e-3}):
        assert bracket(ball, around, **how).low >= 1 - 1e-11
        assert bracket(ball, around, **how).high == 1
        assert bracket(ball, away, **how).low == bracket(ball, away, **how).high == 0


def test_a_small_target_far_from_the_origin():
    """The lattice is about the origin: what is far from it has larger units."""
    for centre in ((0.5, 0, 0), (5.0, -3, 4), (100.0, 0, 0)):
        b = bracket(sphere(centre, 0.5), sphere(centre, 0.25), 1e-3)
        assert b.reached
        assert b.low <= 1 / 8 <= b.high


def test_without_cones_nothing_is_seen():
    none = Cones(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0))
    assert bracket(sphere([0.0, 0, 0], 0.3), none, 1e-3).high == 0


def test_an_empty_target_is_refused():
    for radius in (0.3, 0.6, 2.0):
        nothing = Difference(sphere([0.0, 0, 0], 0.3), sphere([0.0, 0, 0], radius))
        assert len(voxels(nothing, 0.05)) == 0
        with pytest.raises(ValueError, match="empty"):
            bracket(nothing, sphere([0.0, 0, 0], 1.0), 0.01)
        with pytest.raises(EmptySolidError):
            sample(nothing, 10, 0)
    with pytest.raises(ValueError, match="width"):
        bracket(sphere([0.0, 0, 0], 0.3), sphere([0.0, 0, 0], 1.0))


@pytest.mark.parametrize("radius", [0.03, 0.05, 0.08])
def test_a_thin_target_is_not_empty(radius):
    """A rod across its box, no part of which is certain in the first, large cells."""
    ends = np.array([[-0.5] * 3]), np.array([[0.5] * 3])
    volume = math.pi * radius**2 * (math.sqrt(3) + 4 / 3 * radius)
    for width in (0.01, 0.005):
        b = bracket(Capsules(*ends, np.array([radius])), sphere([0.3, 0.2, 0.3], 0.5), width)
        assert b.reached
        assert b.volume_low <= volume <= b.volume_high


def test_sums_of_many_cells_hold_their_rounding():
    """Adding less than half a unit in the last place, over and over, changes nothing; the bounds
    allow for it.
    """
    tally, one = VolumeTally(), np.ones(1)
    for volume in (1.0, *[2.0**-53] * 8_000):
        tally.add(VolumeFraction(one, one), VolumeFraction(0 * one, 0 * one), volume, 0)
    b = tally.bracket(1, 1.0, 0.1)
    assert b.volume_low <= 1 + 8_000 * 2.0**-53 <= b.volume_high


def test_the_mean_over_poses_holds_its_rounding(monkeypatch):
    """Of 49 poses, 49 times the float nearest to 1/49 is less than 1."""
    scene = Scene.paper(poses=(Scene.paper().poses[0],) * 49)
    whole = Bracket(1 - 1e-12, 1.0, 1.0, 1.0, 1, 1, 1.0, True)
    monkeypatch.setattr(exact, "bracket", lambda *args: whole)
    verified = Verifier(scene, rule="certified", width=1e-3).verify(
        named_setup("n1_1_0"), Shell(0.5)
    )
    assert verified.low <= whole.low
    assert verified.high == 1


def test_the_interval_is_the_same_on_any_number_of_processors(monkeypatch):
    target, seen, _, _ = closed_forms()["two balls"]
    found = []
    for threads in (1, 3):
        monkeypatch.setattr(certified, "processors", lambda threads=threads: threads)
        found.append(bracket(target, seen, 1e-3))
    assert found[0] == found[1]


def test_ctrl_c_leaves_the_last_interval():
    target, seen, share, _ = closed_forms()["a cone from the centre of a ball"]
    told = []

    def stop(b):
        told.append(b)
        raise KeyboardInterrupt

    b = bracket(target, seen, 1e-4, tell=stop)
    assert told == [b]
    assert not b.reached
    assert b.low <= share <= b.high
