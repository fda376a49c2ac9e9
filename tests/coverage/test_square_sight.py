"""Square beams past bodies and obstacles: lines of sight, and where they end."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.occlusion.occluders import Occluders, beams
from place_rings.coverage.rings.ring import Ring, Setup, named_setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.sensors.effective_range import Use
from place_rings.coverage.sensors.sensor import Sensor, effective
from place_rings.coverage.solids.cones import Cones, around
from place_rings.coverage.solids.polyhedra import box
from place_rings.coverage.solids.segments import segment_to_segment
from place_rings.coverage.solids.sensor_beams import MixedBeams
from place_rings.objectives.obstacle import Obstacle
from place_rings.objectives.occlusion import unseeing
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import Verifier

from ..strategies.solids import some_beams, some_capsules
from ..strategies.units import (
    FACINGS,
    GENERATORS,
    directions,
    failures,
    metres,
    points_mm,
    uniform_directions,
)

MODELS = ("shadow", "blind")


def inward(
    places: list[tuple[tuple[int, int], int, tuple[int, int, int]]], shapes: MixedBeams
) -> MixedBeams:
    """Beams of these shapes, turned towards the middle. The last has one zone.

    Args:
        places: of each beam the direction of its apex from the middle, degrees, its distance, mm,
            and where it aims beside the middle, mm.
        shapes: the beams; their apexes and directions are replaced.
    """
    facing, distance, aside = zip(*places, strict=True)
    apex = directions(facing) * metres(distance)[:, None]
    axis = metres(aside) - apex
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    up = np.cross(axis, np.cross(shapes.up, axis) + 1e-3 * np.cross(shapes.axis, axis))
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    zoned = shapes.zoned & (np.arange(len(shapes)) < len(shapes) - 1)
    return replace(shapes, apex=apex, axis=axis, up=up, zoned=zoned)


PLACES = st.lists(st.tuples(FACINGS, st.integers(250, 350), points_mm(150)), min_size=6, max_size=6)
BEAMS = st.builds(inward, PLACES, some_beams(3, 3))
BODIES = some_capsules(3, 3, 150, (20, 60))


def round_ones(b):
    k = len(b) // 2
    return Cones(b.apex[:k], b.axis[:k], b.half_angle[:k], b.range_m[:k])


@given(BEAMS, BODIES, GENERATORS)
@settings(max_examples=5)
def test_a_square_beam_holds_what_lines_of_sight_leave_blinded_or_not(b, bodies, rng):
    points = rng.uniform(-0.7, 0.7, (2000, 3))
    shadowed, blinded = (beams(b, Occluders(bodies), how) for how in MODELS)
    cones, alone = around(b), beams(round_ones(b), Occluders(bodies), "blind")
    blind_around = beams(cones, Occluders(bodies), "blind")
    for k in range(len(b)):
        value, within = shadowed.part(points, k), b.part(points, k) <= 0
        assert np.all(cones.part(points[within], k) <= 1e-12)
        gap = segment_to_segment(
            b.apex[k][None, None], points[:, None], bodies.start[None], bodies.end[None]
        )
        clear = (gap >= bodies.radius).all(axis=1)
        sure = within & (np.abs(value) > 1e-9) & (shadowed.cones.range_m[k] > 0)
        assert failures(points, ~sure | ((value < 0) == clear)) == []
        if k == 5:
            past = np.linalg.norm(points - b.apex[k], axis=1) - blind_around.dark[k, 0, 0]
            value = np.maximum(blinded.cones.part(points, k), past)
        np.testing.assert_array_equal(
            blinded.part(points, k), value if k >= 3 else alone.part(points, k)
        )
    assert np.all(np.isinf(blinded.dark[3:5, :, 0]))


@pytest.mark.parametrize(
    ("zones", "named"), [(8, [(0, 0, None)]), (1, [(0, 0, None), (1, 0, None)])]
)
def test_a_square_beam_with_a_box_before_it_is_named(zones, named):
    """A box 4 to 6 cm away leaves less than a hundredth of a narrow beam of 30 cm, and more of a
    wide one, but for one zone nothing further than the box."""
    narrow, wide = (Sensor(0.1, 0.3, None, up, zones) for up in (0.1, 2.0))
    setup = Setup((Ring("forearm", 0.3, 2, sensor=narrow), Ring("forearm", 0.9, 2, sensor=wide)))
    scene = Scene(occlusion="blind")
    optics = sensor_cones(scene.robot, setup, scene.poses[0].q)
    boxes = tuple(
        Obstacle(f"box {k}", box(optics.apex[k] + 0.08 * optics.axis[k], (0.05,) * 3))
        for k in (0, 2)
    )
    found = unseeing(replace(scene, obstacles=boxes), setup)
    assert [(u.ring, u.sensor, u.within) for u in found] == named


def test_a_one_zone_square_beam_sees_less_blinded_than_shadowed():
    scene, setup = Scene.paper(), named_setup("n2_16_25", effective(Use("vl53l1x")).sensor)
    many = replace(
        setup, rings=tuple(replace(r, sensor=replace(r.sensor, zones=8)) for r in setup.rings)
    )
    target, verifiers = (
        scene.targets[0].target,
        {how: Verifier(replace(scene, occlusion=how), 0.05) for how in MODELS},
    )
    zeta = {how: v.verify(setup, target).zeta for how, v in verifiers.items()}
    assert zeta["blind"] < 0.95 * zeta["shadow"]
    assert [v.verify(many, target).zeta for v in verifiers.values()] == [zeta["shadow"]] * 2


@given(BEAMS, BODIES, GENERATORS)
@settings(max_examples=5)
def test_a_one_zone_square_beam_ends_before_all_that_stands_in_it(b, bodies, rng):
    """Against points of the bodies' surfaces; its end is that of a cone around it."""
    stop = beams(b, Occluders(bodies), "blind", bracketed=True).dark[5, 0, 0]
    share = rng.random((20_000, 1))
    which = rng.integers(3, size=len(share))
    on = bodies.start[which] + share * (bodies.end - bodies.start)[which]
    on += bodies.radius[which][:, None] * uniform_directions(rng, len(on))
    within = on[b.part(on, 5) <= 0]
    assert np.all(np.linalg.norm(within - b.apex[5], axis=1) >= stop - 1e-9)
