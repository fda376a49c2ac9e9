"""The setups that touched rings make: every rule kept, broken ones named, changes and their work by
a second count.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from place_rings._change_text import instruction
from place_rings.coverage.rings.ring import Ring, Setup, named_setup
from place_rings.coverage.rings.rounding import rounded
from place_rings.objectives.feasibility.violations import faults
from place_rings.objectives.mount_rules import Limits, Rules
from place_rings.objectives.scene import CoreScene, paper_scene
from place_rings.placement.redesign.changes import ChangeKind, Touched, changes, work
from place_rings.placement.redesign.moves import touched
from place_rings.placement.redesign.problem import RedesignProblem
from place_rings.placement.search.design import Space
from place_rings.placement.search.feasible_set import InfeasibleError
from place_rings.placement.search.moves import fresh

from ..support import drawing
from .test_design import drawn_scene

PLACE, ANGLE = 1e-8, 1e-6  # what files round positions (inward) and angles to


def check_changes(
    before: tuple[Ring, ...], after: tuple[Ring, ...], most: int
) -> tuple[list[Ring], list[Ring]]:
    """The rings that are no more and those that are new, of which at most so many stand for one
    change each: all others are there as they were, and in their order."""
    gone, new = [r for r in before if r not in after], [r for r in after if r not in before]
    assert [r for r in before if r not in gone] == [r for r in after if r not in new]
    assert max(len(gone), len(new)) <= most
    return gone, new


def check_rules(
    scene: CoreScene, before: tuple[Ring, ...], after: tuple[Ring, ...], new: list[Ring]
) -> None:
    """All new rings keep all rules against all rings."""
    rules, counts = scene.rules, [r.count for r in before]
    fixed = rounded(Setup(rules.fixed), scene.sensor).rings
    own = [r for r in after if r not in fixed]
    for ring in new:
        limits, length = scene.limits_of(ring.link), scene.robot.mount(ring.link).length
        assert limits.tilt[0] - ANGLE <= ring.tilt <= limits.tilt[1] + ANGLE
        assert rules.sensors[0] <= ring.count <= rules.sensors[1] or ring.count in counts
        margin = rules.from_joints / length if length else 0.0
        if length:
            assert (
                max(limits.position[0], margin) - PLACE
                <= ring.position
                <= min(limits.position[1], 1 - margin) + PLACE
            )
            assert not any(
                low + PLACE < ring.position < high - PLACE for low, high in limits.keep_out
            )
        for other in (*after, *fixed):
            if other is not ring and other.link == ring.link:
                assert length > 0
                assert abs(other.position - ring.position) * length >= rules.spacing - PLACE
        assert sum(r.link == ring.link for r in after) <= rules.max_rings_per_link
        if rules.shared_tilt:  # as many of the others have it as have any other
            tilts = [round(abs(r.tilt), 5) for r in own]
            assert tilts.count(round(abs(ring.tilt), 5)) == max(map(tilts.count, tilts))


@given(drawing.seeds)
def test_touched_rings_keep_every_rule_whatever_the_climb_says(seed):
    """Mounted setups of another scene, which break rules of this one; values anywhere in the
    box.
    """
    rng = np.random.default_rng(seed)
    scene, elsewhere = drawn_scene(rng), drawn_scene(rng)
    assume(
        not scene.rules.fixed or len(scene.rules.fixed) < 2 or not faults(scene, scene.rules.fixed)
    )
    try:
        space = Space(replace(elsewhere, rules=replace(elsewhere.rules, fixed=())), sensors=30)
        mounted = Setup(
            (*space.setup(fresh(space, rng)).rings, *scene.rules.fixed[: rng.integers(3)])
        )
    except InfeasibleError:
        return
    more = int(rng.integers(0, 20))
    rework = RedesignProblem(scene, mounted, 2, more)
    t = rework.start
    for _ in range(3):
        may = rework.may_touch(t)
        trial = touched(rework, t, int(rng.choice(may)), rng) if may else None
        placed = rework.placed(trial) if trial is not None else None
        if placed is None:
            continue
        assert np.all((placed.low <= placed.values) & (placed.values <= placed.high))
        ends = np.where(rng.uniform(size=placed.low.shape) < 0.5, placed.low, placed.high)
        inside = rng.uniform(placed.low, placed.high)
        t = rework.read(placed, (ends, inside, placed.values)[int(rng.integers(3))])
        held = rework.rounded(t)
        assert rework.keeps_rules(held)
        after = rounded(held.setup, scene.sensor).rings
        _, new = check_changes(rework.mounted.rings, after, len(t.free))
        check_rules(scene, rework.mounted.rings, after, new)
        assert held.setup.sensors <= mounted.sensors + more


@given(drawing.seeds)
def test_what_a_search_draws_has_no_fault(seed):
    rng = np.random.default_rng(seed)
    scene = drawn_scene(rng)
    try:
        space = Space(scene, sensors=int(rng.integers(1, 60)))
        setup = rounded(space.setup(fresh(space, rng)), scene.sensor)
    except InfeasibleError:
        return
    assert faults(scene, setup.rings) == []


BROKEN = {
    "position": (Ring("forearm", 0.95, 8), Rules()),
    "tilt_deg": (Ring("forearm", 0.2, 8, 0.8), Rules()),
    "keep_out": (Ring("forearm", 0.55, 8), Rules()),
    "sensors_per_ring": (Ring("forearm", 0.2, 30), Rules()),
    "spacing": (Ring("forearm", 0.41, 8), Rules()),
    "max_rings_per_link": (Ring("forearm", 0.2, 8), Rules(max_rings_per_link=1)),
    "shared_tilt": (Ring("forearm", 0.2, 8, 0.3), Rules(shared_tilt=True)),
    "fixed": (Ring("upper_arm", 0.2, 8), Rules(fixed=(Ring("upper_arm", 0.7, 8),))),
}


@pytest.mark.parametrize(
    ("rule", "ring", "rules"), [(k, *v) for k, v in BROKEN.items()], ids=BROKEN.keys()
)
def test_a_broken_rule_is_named(rule, ring, rules):
    scene = paper_scene(
        limits={"forearm": Limits((0.0, 0.9), (-0.5, 0.5), ((0.5, 0.6),))}, rules=rules
    )
    (fault,) = faults(scene, [Ring("forearm", 0.4, 8), ring])
    assert fault.rule == rule
    assert not faults(scene, [Ring("forearm", 0.4, 8), *rules.fixed])


def recount(scene, before, after):
    """Work between two setups of which each ring that was touched stands in its place."""
    moved = tilted = turned = carried = 0.0
    for a, b in zip(before, after, strict=True):
        if a is not None and b is not None:
            same = a.link == b.link
            carried += not same
            moved += (
                abs(a.position - b.position) * scene.robot.mount(a.link).length if same else 0.0
            )
            tilted += abs(a.tilt - b.tilt)
            sensors = 2 * math.pi * np.arange(-2 * b.count, 2 * b.count + 1) / b.count
            turned += np.abs(b.phase + sensors - a.phase).min()
    sensors = sum(r.count for r in after if r) - sum(r.count for r in before if r)
    return carried, sensors, moved, tilted, turned


@given(drawing.seeds)
def test_costs_equal_a_recount(seed):
    rng = np.random.default_rng(seed)
    rework = RedesignProblem(paper_scene(), drawing.setup(rng), 2, 9)
    t = rework.start
    for _ in range(3):
        trial = touched(rework, t, int(rng.choice(rework.may_touch(t))), rng)
        t = t if trial is None else trial
    some = changes(rework.scene.robot, rework.before, t.rings)
    total = work(some)
    expected = recount(rework.scene, rework.before, t.rings)
    assert (total.carried, total.sensors, total.moved, total.tilted, total.turned) == pytest.approx(
        expected, abs=1e-9
    )
    assert (
        total.rings
        == sum(a != b for a, b in zip(rework.before, t.rings, strict=True))
        <= len(t.free)
    )


def test_kinds_of_changes():
    a, b = Ring("forearm", 0.5, 8, 0.1, 0.2), Ring("upper_arm", 0.5, 8, 0.1, 0.2)
    kinds = [
        c.kind
        for c in changes(
            paper_scene().robot, (a, a, a, None, a), (replace(a, count=9), b, None, b, a)
        )
    ]
    assert kinds == [ChangeKind.SET, ChangeKind.CARRIED, ChangeKind.TAKEN, ChangeKind.ADDED]


def test_what_became_as_it_was_is_touched_no_more():
    rework = RedesignProblem(paper_scene(), named_setup("n2_16_25"), 1)
    almost = replace(rework.mounted.rings[1], phase=1e-9)
    rings = (rework.mounted.rings[0], almost, *rework.before[2:])
    assert rework.rounded(Touched(rings, (1,))).free == ()


@given(drawing.seeds)
def test_every_change_has_an_instruction(seed):
    """In one line, with the ring's name; a new ring has no number."""
    rng = np.random.default_rng(seed)
    rework = RedesignProblem(paper_scene(), drawing.setup(rng), 2, 9)
    t = rework.start
    for _ in range(3):
        trial = touched(rework, t, int(rng.choice(rework.may_touch(t))), rng)
        t = t if trial is None else trial
    mounted = len(rework.mounted.rings)
    for change in changes(rework.scene.robot, rework.before, t.rings):
        line = instruction(change, mounted, rework.scene.robot)
        assert line.startswith(f"ring {change.place}" if change.place < mounted else "new ring")
        assert line.isprintable()
        assert ("remove" in line) == (change.kind is ChangeKind.TAKEN)
