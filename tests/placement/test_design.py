"""Every candidate of a search keeps every rule, whatever is drawn, varied or climbed to."""

import math
import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from place_rings.coverage.rings.ring import Ring, Setup, named_setup
from place_rings.coverage.rings.rounding import rounded
from place_rings.coverage.sensors.boards import VL53L1X
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.objectives.feasibility.violations import faults
from place_rings.objectives.link_segments import GRAIN, segments
from place_rings.objectives.mount_rules import Limits, Rules
from place_rings.objectives.named_layouts import ring_layout
from place_rings.objectives.parameterization import decode
from place_rings.objectives.scene import Scene
from place_rings.placement.space.design import Candidate, Space
from place_rings.placement.space.feasible_set import InfeasibleError, refusal
from place_rings.placement.space.starts import fitted, fresh, papers

from ..support import drawing
from ..support.ring_rules import check_ring
from ..support.searching import search

RNG = np.random.default_rng(0)
LINKS = ("upper_arm", "forearm", "tool")


def drawn_scene(rng: np.random.Generator) -> Scene:
    """A scene with limits, keep-outs, spacing, margins, fixed rings, a shared tilt."""

    def interval(low=0.0, high=1.0):
        a, b = sorted(rng.uniform(low, high, 2).tolist())
        return (a, b)

    limits = {
        link: Limits(
            interval(),
            (float(rng.uniform(-1.2, 0.1)), float(rng.uniform(0.1, 1.2))),
            tuple(interval() for _ in range(rng.integers(3))),
        )
        for link in LINKS[:2]
    }
    fixed = tuple(
        Ring(str(rng.choice(LINKS[:2])), float(rng.uniform()), int(rng.integers(1, 9)))
        for _ in range(rng.integers(3))
    )
    least = int(rng.integers(1, 7))
    sensors = (least, int(rng.integers(least, 25)))
    spacing, margin = float(rng.uniform(0, 0.2)), float(rng.uniform(0, 0.1))
    return Scene.paper(
        mounts=limits,
        rules=Rules(
            spacing, margin, sensors, int(rng.integers(1, 7)), bool(rng.integers(2)), fixed
        ),
    )


def check(space: Space, setup: Setup, sensors: int) -> None:
    """The setup keeps all rules, as a file holds it."""
    scene, rules = space.scene, space.scene.rules
    rings = list(rounded(setup, scene.sensor).rings)
    assert sum(ring.count for ring in rings) == sensors
    own = list(rings)
    for ring in rounded(Setup(rules.fixed), scene.sensor).rings:
        own.remove(ring)
    for ring in own:
        check_ring(scene, ring, rings, 1e-9, 1e-5)
        assert space.layout or rules.sensors[0] <= ring.count <= rules.sensors[1]
    for link in LINKS:
        new, held = (sum(ring.link == link for ring in some) for some in (own, rules.fixed))
        assert new == 0 or new + held <= rules.max_rings_per_link
    if rules.shared_tilt and own:
        tilts = [abs(ring.tilt) for ring in own]
        assert max(tilts) == pytest.approx(min(tilts), abs=1e-5)


@given(st.integers(1, 60), drawing.seeds)
def test_all_that_is_drawn_keeps_the_rules(sensors, seed):
    rng = np.random.default_rng(seed)
    try:
        space = Space(drawn_scene(rng), sensors=sensors)
    except InfeasibleError:
        return
    try:
        c = fresh(space, rng)
    except InfeasibleError:
        return
    assert faults(space.scene, rounded(space.setup(c), space.scene.sensor).rings) == []
    for _ in range(6):
        check(space, space.setup(c), sensors)
        low, high = (edge[:, : space.places] for edge in space.box(c))
        assert np.all((low - 1e-9 <= c.values) & (c.values <= high + 1e-9))
        ends = replace(c, values=np.where(rng.uniform(size=c.values.shape) < 0.5, low, high))
        check(space, space.setup(ends), sensors)
        c = fresh(space, rng)


@given(st.integers(1, 60), st.integers(1, 9), st.none() | st.integers(1, 20), drawing.seeds)
def test_all_that_is_drawn_has_the_stated_number_of_rings(sensors, rings, each, seed):
    rng = np.random.default_rng(seed)
    scene = drawn_scene(rng)
    try:
        if each is None:
            space = Space(scene, sensors=sensors, rings=rings)
        else:
            space = Space(scene, rings=rings, each=each)
    except InfeasibleError:
        return
    c = fresh(space, rng)
    for _ in range(6):
        setup = space.setup(c)
        assert len(setup.rings) == rings
        if each is None:
            check(space, setup, sensors)
        else:
            assert {ring.count for ring in setup.rings if ring not in scene.rules.fixed} <= {each}
        again = space.candidate(rounded(setup, scene.sensor))
        assert again is None or len(space.setup(again).rings) == rings
        c = fresh(space, rng)


@given(
    st.integers(1, 6),
    st.lists(st.integers(0, 9), max_size=5),
    st.integers(1, 8),
    st.integers(0, 3),
    st.integers(0, 9),
    st.integers(0, 60),
)
def test_rings_are_refused_exactly_where_no_division_of_the_sensors_fits(
    least, more, rings, fixed, held, sensors
):
    """By all sums of sizes of rings, one after the other."""
    largest, held = sorted((least + n for n in more), reverse=True), held if fixed else 0
    sums, new = {held}, rings - fixed
    for most in largest[: max(new, 0)]:
        sums = {total + n for total in sums for n in range(least, most + 1)}
    can = 0 <= new <= len(largest) and sensors in sums
    reason = refusal(rings, fixed, sensors, held, least, largest)
    assert (reason is None) == can
    assert reason is None or "\n" not in reason


HELD = Ring("forearm", 0.5, 5)


@pytest.mark.parametrize(
    ("rules", "wanted", "numbers"),
    [
        (Rules(max_rings_per_link=2, fixed=(HELD,)), {"rings": 6, "sensors": 40}, "6 .*3 .*4 .*1"),
        (Rules(), {"rings": 3, "sensors": 8}, "8 .*3"),
        (Rules(), {"rings": 2, "sensors": 49}, "49 .*2"),
        (
            Rules(max_rings_per_link=64, spacing=0.005),
            {"rings": 65, "sensors": 260},
            "65 .*64",
        ),
        (Rules(), {"rings": 18, "sensors": 60}, "18 .*3"),
        (
            Rules(fixed=(HELD, replace(HELD, position=0.9))),
            {"rings": 1, "sensors": 40},
            "1 .*2",
        ),
        (Rules(sensors=(6, 8)), {"sensors": 5}, "5 .*6"),
        (Rules(sensors=(6, 8)), {"sensors": 5000}, "5000"),
        (Rules(fixed=(Ring("forearm", 0.5, 30),)), {"sensors": 20}, "20"),
        (Rules(spacing=10.0), {"sensors": 90}, "90"),
        (
            Rules(max_rings_per_link=1, sensors=(3, 8), fixed=(HELD,)),
            {"sensors": 36},
            "36 .*2 .*8 .*5",
        ),
        (Rules(fixed=(HELD,)), {"sensors": 7}, "7 .*2 .*5"),
        (
            Rules(max_rings_per_link=1, sensors=(6, 8), fixed=(Ring("tool", 0.0, 5),)),
            {"sensors": 15},
            "15 .*6 .*8 .*5",
        ),
    ],
)
def test_what_cannot_be_is_refused_with_the_numbers(rules, wanted, numbers):
    with pytest.raises(InfeasibleError, match=numbers):
        Space(Scene.paper(rules=rules), **wanted)


def test_equal_rings_whose_boards_do_not_fit_are_refused_with_the_number_that_does():
    scene = Scene(sensor=Sensor(board=VL53L1X), occlusion="shadow", rules=Rules(mount="real"))
    with pytest.raises(InfeasibleError, match=r"4 .*24 ") as error:
        Space(scene, rings=4, each=24)
    most = int(re.findall(r"\d+", str(error.value))[-1])
    assert Space(scene, rings=4, each=most).sensors == 4 * most
    with pytest.raises(InfeasibleError, match=f"4 .*{most + 1} "):
        Space(scene, rings=4, each=most + 1)


def test_of_two_places_too_near_for_two_rings_either_holds_one():
    limits = {"forearm": Limits(position=(0.3, 0.7), keep_out=((0.35, 0.65),))}
    scene = Scene.paper(mounts=limits, rules=Rules(spacing=0.3))
    there = [(s.low, s.high, s.room) for s in segments(scene) if s.link == "forearm"]
    assert there == [
        (pytest.approx(0.3), pytest.approx(0.35), 1),
        (pytest.approx(0.65), pytest.approx(0.7), 1),
    ]
    space = Space(scene, ring_layout(scene, 1, 8))
    assert space.places == 3
    either = [i for i, s in enumerate(space.segments) if s.link == "forearm"]
    assert space.room([], "forearm") == either
    assert space.room(either[:1], "forearm") == space.room(either[1:], "forearm") == []


def test_a_narrow_keep_out_costs_no_more_than_its_own_width():
    """A ring reaches both ends of a keep-out of 6 mm between rings 60 mm apart; two rings on either
    side keep their spacing."""
    narrow = Scene.paper(
        mounts={"forearm": Limits(keep_out=((0.5, 0.51),))}, rules=Rules(spacing=0.06)
    )
    space = Space(narrow, sensors=8)
    left, right = (i for i, s in enumerate(space.segments) if s.link == "forearm")
    ends = {(s.low, s.high) for s in space.segments if s.link == "forearm"}
    assert ends == {(0.0, 0.5), (0.51, 1.0)}
    reached = []
    for segment, along in ((left, 0.0), (left, 1.0), (right, 0.0), (right, 1.0)):
        n = space.places
        c = Candidate(np.full(n, -1), np.zeros(n, int), np.zeros((3, n)), np.ones(n))
        c.segment[0], c.count[0], c.values[0, 0] = segment, 8, along
        reached.append(space.setup(c).rings[0].position)
    assert reached == pytest.approx([0.0, 0.5, 0.51, 1.0], abs=1e-9)


@given(drawing.seeds)
def test_any_legal_place_can_hold_a_ring_and_any_rings_keep_the_spacing(seed):
    rng = np.random.default_rng(seed)
    cuts = tuple(
        (float(a), float(a + rng.uniform(0, 0.1))) for a in rng.uniform(0, 0.9, rng.integers(1, 5))
    )
    rules = Rules(spacing=float(rng.uniform(0.01, 0.2)))
    scene = Scene.paper(mounts={"forearm": Limits(keep_out=cuts)}, rules=rules)
    space, length = Space(scene, sensors=80), scene.robot.mount("forearm").length
    legal = [p for p in np.linspace(0, 1, 101) if not any(a < p < b for a, b in cuts)]
    for place in legal:
        c = space.candidate(Setup((Ring("forearm", float(place), 8),)))
        position = space.setup(c).rings[0].position
        assert position == pytest.approx(place, abs=2 * GRAIN)
    segment: list[int] = []
    while free := space.room(segment, "forearm"):
        segment.append(int(rng.choice(free)))
    assert 1 <= len(segment) <= space._rooms()["forearm"]
    c = fresh(space, rng)
    spare = space.places - len(segment)
    if spare < 0:
        return
    c = replace(
        c,
        segment=np.array([*segment, *[-1] * spare]),
        count=np.array([*[3] * len(segment), *[0] * spare]),
        values=rng.choice([0.0, 0.3, 1.0], (3, space.places)),
    )
    places = sorted(ring.position for ring in space.setup(c).rings)
    assert all((b - a) * length >= rules.spacing - 1e-9 for a, b in pairwise(places))
    assert not any(a + 1e-9 < p < b - 1e-9 for p in places for a, b in cuts)


@pytest.mark.parametrize(("least", "upper_arm"), [(3, 0.1), (10, 0.12)])
def test_sensors_are_taken_where_they_are_a_sum_of_rings_and_refused_elsewhere(least, upper_arm):
    """Boards leave the upper arm room for larger rings than the other links, of which there is one
    each.
    """
    limits = {
        "upper_arm": Limits(radius=upper_arm),
        "forearm": Limits(radius=0.075),
        "tool": Limits(radius=0.075),
    }
    rules = Rules(sensors=(least, 24), max_rings_per_link=1)
    scene = Scene(sensor=Sensor(board=VL53L1X), mounts=limits, rules=rules, ring_radius=0.08)
    first = Space(scene, sensors=least)
    assert len({*first.largest()}) > 1
    most = sum(first.largest())
    for sensors in sorted({*range(1, most, 25), least - 1, most, most + 1}):
        if sensors in first.totals:
            space = Space(scene, sensors=sensors)
            assert space.setup(fresh(space, RNG)).sensors == sensors
        else:
            with pytest.raises(InfeasibleError, match=f"rules: {sensors} "):
                Space(scene, sensors=sensors)


@given(drawing.seeds, st.integers(10, 90))
def test_a_candidate_is_found_again_from_its_setup(seed, sensors):
    space = Space(Scene.paper(), sensors=sensors)
    c = fresh(space, np.random.default_rng(seed))
    setup = space.setup(c)
    again = space.candidate(setup)
    assert again is not None
    for a, b in zip(space.setup(again).rings, setup.rings, strict=True):
        assert (a.link, a.count) == (b.link, b.count)
        assert (a.position, a.tilt, a.phase) == pytest.approx(
            (b.position, b.tilt, b.phase), abs=1e-9
        )


@given(drawing.seeds, st.integers(8, 90), st.integers(8, 90))
def test_a_setup_is_fitted_to_another_number_of_sensors(seed, before, after):
    setup = Space(Scene.paper(), sensors=before).setup(
        fresh(Space(Scene.paper(), sensors=before), np.random.default_rng(seed))
    )
    space = Space(Scene.paper(), sensors=after)
    c = fitted(space, setup)
    assume(c is not None)
    check(space, space.setup(c), after)


def test_segments_of_a_scene_with_everything():
    scene = Scene.paper(
        mounts={
            "forearm": Limits((0.1, 0.9), (-1, 1), ((0.4, 0.5),)),
            "tool": Limits(keep_out=((0.0, 1.0),)),
        },
        rules=Rules(spacing=0.05723, from_joints=0.0, fixed=(Ring("forearm", 0.7, 8),)),
    )
    found = [s for s in segments(scene) if s.link == "forearm"]
    np.testing.assert_allclose(
        [(s.low, s.high) for s in found], [(0.1, 0.4), (0.5, 0.6), (0.8, 0.9)], atol=2e-6
    )
    # 0.3 of the link holds four rings 0.1 apart, but for rounding
    assert [s.room for s in found] == [3, 1, 1]
    assert not [s for s in segments(scene) if s.link == "tool"]


def test_values_reach_any_placement_that_keeps_the_spacing():
    space = Space(Scene.paper(rules=Rules(spacing=0.06)), named_setup("n3_16_55"))
    c = space.candidate(named_setup("n3_16_55"))
    position = decode(space.arrays(c)[1], space.values(c))[0]
    np.testing.assert_allclose(position, [0, 0.5, 1, 0, 0.5, 1, 0], atol=GRAIN)


def test_the_papers_setups_are_among_the_starts():
    space = Space(Scene.paper(), ring_layout(Scene.paper(), 3, 16))
    for ring, paper in zip(
        space.setup(papers(space)[0]).rings, named_setup("n3_16_55").rings, strict=True
    ):
        assert (ring.position, ring.tilt) == pytest.approx((paper.position, paper.tilt), abs=1e-6)


def test_a_fixed_ring_takes_the_layouts_place_where_the_link_has_no_other():
    on_tool = Scene.paper(rules=Rules(fixed=(Ring("tool", 0.0, 8),)))
    layout = ring_layout(on_tool, 2, 16)
    assert [ring.link for ring in layout.rings] == ["upper_arm"] * 2 + ["forearm"] * 2
    setup = Space(on_tool, layout).setup(papers(Space(on_tool, layout))[0])
    assert [(r.link, r.count) for r in setup.rings][-1] == ("tool", 8)
    assert setup.sensors == 72
    on_arm = Scene.paper(rules=Rules(max_rings_per_link=2, fixed=(Ring("forearm", 0.3, 8),)))
    there = [ring.link for ring in ring_layout(on_arm, 2, 16).rings]
    assert there == ["upper_arm", "upper_arm", "forearm", "tool"]
    Space(on_arm, ring_layout(on_arm, 2, 16))


def test_a_search_whose_layout_is_all_fixed_counts_the_fixed_rings():
    fixed = (Ring("upper_arm", 0.5, 4), Ring("forearm", 0.5, 4), Ring("tool", 0.0, 4))
    scene = Scene.paper(rules=Rules(max_rings_per_link=1, fixed=fixed))
    result = search(Space(scene, ring_layout(scene, 1, 16)), voxel=0.1)
    assert result.setup.rings == fixed
    assert 0 < result.exact < 1


def test_a_layout_without_room_is_refused():
    scene = Scene.paper(mounts={"forearm": Limits((0.5, 0.51))}, rules=Rules(spacing=0.05))
    with pytest.raises(InfeasibleError, match=r"2 .*forearm"):
        Space(scene, ring_layout(scene, 2, 16))
    assert math.isfinite(
        fresh(Space(scene, ring_layout(scene, 1, 16)), np.random.default_rng(0)).values.sum()
    )
