"""Rings on real mounts use the whole room that the envelopes of their own tilts leave."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.rings.rounding import rounded
from place_rings.objectives.feasibility.ring_envelopes import envelope, spacing
from place_rings.objectives.feasibility.violations import faults
from place_rings.objectives.link_segments import ABOVE, BELOW, GRAIN, HIGH, LOW, TILTS
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.scene import Scene
from place_rings.placement.space.design import Space
from place_rings.placement.space.starts import fresh

from ..support import drawing

SCENE = Scene(occlusion="shadow", rules=Rules(mount="real"))
SPACE = Space(SCENE, sensors=48)
LONG = [s for s in SPACE.segments if s.high > s.low]
ERROR = 0.001  # m, by which ends and spacings err at most on the safe side
tilts = st.floats(-math.radians(70), math.radians(70))


def ring(link: str, position: float, tilt: float) -> Ring:
    return Ring(link, position, 8, tilt, 0.1, SPACE.radii[link])


@given(st.sampled_from(LONG), tilts)
def test_a_table_holds_the_envelope_of_every_tilt_and_little_more(segment, tilt):
    table = [np.interp(tilt, TILTS, row) for row in segment.by_tilt]
    around = envelope(SCENE, ring(segment.link, 0.5, tilt))
    length = SCENE.robot.mount(segment.link).length
    assert around.high + SCENE.rules.clearance <= table[ABOVE] * length
    assert -around.low <= table[BELOW] * length
    if abs(tilt) > math.radians(2.5):  # at 0 the ears change sides
        assert table[ABOVE] * length <= around.high + SCENE.rules.clearance + ERROR
        assert table[BELOW] * length <= -around.low + ERROR
    assert table[LOW] <= segment.low
    assert table[HIGH] >= segment.high
    for end in (table[LOW], table[HIGH]):
        alone = (ring(segment.link, float(np.clip(end, 0, 1)), tilt),)
        assert faults(SCENE, alone, SPACE.clear) == []


@given(drawing.seeds)
def test_all_placements_that_real_rings_allow_are_reached(seed):
    """Rings with a little more than the room that they need stay where they are."""
    rng = np.random.default_rng(seed)
    segment = LONG[int(rng.integers(len(LONG)))]
    length = SCENE.robot.mount(segment.link).length
    tilt = [float(rng.choice([-1, 1]) * rng.uniform(0.1, 1.2)) for _ in range(4)]
    ends = [np.interp(tilt[0], TILTS, segment.by_tilt[LOW])]
    for a, b in pairwise(tilt):
        pair = [envelope(SCENE, ring(segment.link, 0.5, t)) for t in (a, b)]
        more = float(rng.choice([2 * ERROR, rng.uniform(2 * ERROR, 0.08)]))
        ends.append(ends[-1] + (spacing(SCENE, *pair) + more) / length)
    rings = tuple(ring(segment.link, float(p), t) for p, t in zip(ends, tilt, strict=True))
    if faults(SCENE, rings, SPACE.clear):  # beyond the end of the link
        return
    c = SPACE.candidate(Setup(rings))
    again = SPACE.setup(c).rings
    assert [r.position for r in again] == pytest.approx([r.position for r in rings], abs=GRAIN)
    assert [r.tilt for r in again] == pytest.approx(tilt, abs=1e-12)


def test_two_steep_rings_stand_nearer_to_a_joint_and_to_each_other_than_any_two_may():
    some = tuple(ring("upper_arm", p, math.radians(t)) for p, t in ((0.05, 66), (0.122, 41)))
    assert faults(SCENE, some, SPACE.clear) == []
    segment = next(s for s in LONG if s.link == "upper_arm")
    assert some[0].position < segment.low
    assert some[1].position - some[0].position < segment.gap
    again = SPACE.setup(SPACE.candidate(Setup(some))).rings
    assert [r.position for r in again] == pytest.approx([0.05, 0.122], abs=GRAIN)


@given(drawing.seeds)
def test_rings_keep_the_rules_at_the_ends_of_all_values(seed):
    rng = np.random.default_rng(seed)
    c = fresh(SPACE, rng)
    low, high = (edge[:, : SPACE.places] for edge in SPACE.box(c))
    within = rng.uniform(low, high)
    pick = rng.integers(3, size=within.shape)
    values = np.where(pick == 0, low, np.where(pick == 1, high, within))
    rings = rounded(SPACE.setup(replace(c, values=values)), SCENE.sensor).rings
    broken = faults(SCENE, rings, SPACE.clear)
    assert [f for f in broken if len({rings[i].link for i in f.rings}) == 1] == []
