"""Combinations of rings from a library against counts point by point, the rules, and all others;
guessed lines of sight against exact ones.
"""

import itertools
import math
from copy import copy
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from place_rings.coverage.rings.mounting_errors import MountingErrors
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.sensors.effective_range import Use
from place_rings.coverage.sensors.sensor import effective
from place_rings.coverage.targets.named import ReachAndToolSpheres, Shell
from place_rings.objectives.criterion import Criterion
from place_rings.objectives.feasibility.violations import faults
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.named_layouts import ring_layout
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.objectives.target_points import TargetPoints
from place_rings.placement.search.exchange import Exchange
from place_rings.placement.search.exchange_criteria import criterion_by_counts
from place_rings.placement.search.exchange_points import Fields
from place_rings.placement.search.ring_library import ring_library
from place_rings.placement.search.ruin_recreate import Gains, RuinRecreate, gains, joined
from place_rings.placement.search.schedule import Round, any_rings, given_rings, usual
from place_rings.placement.space.design import Space
from place_rings.placement.space.ring_places import (
    _room,
    places_anywhere,
    places_near,
    places_of,
)
from place_rings.placement.space.starts import fresh
from place_rings.placement.stop_token import StopToken

from ..strategies.units import GENERATORS

Q = np.radians([-20.0, -60.0, 80.0, -110.0, -90.0, 10.0])
PLAIN = Scene.paper(poses=(Pose(Q),), targets=(Shell(1.0),))
TWO = Scene.paper(
    poses=(Pose(Q, 1.0), Pose(np.radians([10.0, -80.0, 60.0, -70.0, -90.0, 0.0]), 3.0)),
    targets=(Shell(0.5, weight=0.7), ReachAndToolSpheres(weight=0.3)),
)
FIXED = replace(PLAIN, rules=Rules(fixed=(Ring("forearm", 0.4, 8, 0.3, 0.1),), sensors=(4, 24)))
REAL = Scene(poses=(Pose(Q),), targets=(Shell(1.0),))
SCENES = {"plain": PLAIN, "two goals": TWO, "fixed rings": FIXED, "real mounts": REAL}
KINDS = ["free", "six rings", "equal"]
NEVER = StopToken(math.inf)


def _round(library, beside=0):
    """A round with places of a library, and of some beside each ring."""
    return Round(0, 0, 0, 0, 0.1, library=library, beside=beside)


TWO_RINGS = Space(PLAIN, rings=2, each=8)


def _space(scene, kind):
    return {
        "free": lambda: Space(scene, sensors=40),
        "six rings": lambda: Space(scene, sensors=40, rings=6),
        "equal": lambda: Space(scene, rings=5, each=6),
    }[kind]()


@cache
def _drawn(name, kind, seen=1):
    space = _space(SCENES[name], kind)
    fields = Fields(space, TargetPoints(space.scene, 512, 0), Criterion(seen=seen))
    rng, known = np.random.default_rng(0), [fresh(space, np.random.default_rng(i)) for i in (1, 2)]
    field = fields.first(1024)
    library = ring_library(space, field, seen, rng, NEVER, _round(400, 12), known)
    return library, field, known


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("kind", KINDS)
def test_a_combination_keeps_the_rules_and_covers_what_its_value_says(name, kind):
    library, field, known = _drawn(name, kind)
    space, criterion = library.space, criterion_by_counts(library.space.scene, Criterion())
    for start, own in zip(known, library.own, strict=True):
        ruin = RuinRecreate(library, np.random.default_rng(3))
        best = ruin.improved(own.tolist(), 30, NEVER)
        c = library.candidate(best.chosen)
        setup = space.setup(c)
        assert not faults(space.scene, setup.rings)
        assert setup.sensors == space.sensors
        if space.rings is not None:
            assert len(c.rings) == space.rings
        here = Exchange(space, c, np.random.default_rng(0), criterion)
        here.look(field)
        # points of unequal weight are drawn by their weights
        assert here.value == pytest.approx(
            best.value / library.points, abs=0.03 if name == "two goals" else 0.01
        )
        there = Exchange(space, start, np.random.default_rng(0), criterion)
        there.look(field)
        assert best.value / library.points >= there.value - 0.03


def test_the_rings_of_a_candidate_are_in_its_library():
    for kind in KINDS:
        library, _, known = _drawn("plain", kind)
        for c, own in zip(known, library.own, strict=True):
            same = library.space.setup(library.candidate(own.tolist()))
            for ring, other in zip(same.rings, library.space.setup(c).rings, strict=True):
                assert ring.position == pytest.approx(other.position, abs=1e-5)
                assert (ring.link, ring.count) == (other.link, other.count)
                assert ring.tilt == pytest.approx(other.tilt)


@pytest.mark.parametrize("seen", [1, 2, 3])
def test_the_bits_of_a_place_are_the_points_that_its_sensors_see(seen):
    library, _, _ = _drawn("plain", "free", seen)
    scene = library.space.scene
    points = TargetPoints(scene, 512, 0).points[0]
    bits = np.unpackbits(library.words.view(np.uint8), axis=-1)[..., : library.points]
    for k in range(0, len(library.places.sensors), 97):
        s = library.places
        ring = replace(
            library.space.ring(library.space.segments[s.segment[k]].link, int(s.sensors[k])),
            position=float(s.position[k]),
            tilt=float(s.tilt[k]),
            phase=float(s.phase[k]),
        )
        cones = sensor_cones(scene.robot, Setup((ring,)), Q)
        part = np.stack(
            [cones.part(points, np.full(len(points), i)) for i in range(ring.count)]
        )  # (sensors, N)
        count, clear = (part <= 0).sum(axis=0), (np.abs(part) > 1e-5).all(axis=0)
        for j in range(seen):
            assert np.array_equal(bits[j, k][clear], (count > j)[clear])


@given(st.integers(1, 4), st.integers(0, 2**31))
def test_bits_of_counts_add_like_counts(seen, seed):
    rng = np.random.default_rng(seed)
    a, b = rng.integers(0, seen + 2, (2, 128))

    def planes(count):
        each = [np.packbits(count > j).view(np.uint64) for j in range(seen)]
        return np.stack(each)

    together = planes(a + b)
    assert np.array_equal(joined(planes(a), planes(b)), together)
    gain = gains(planes(a), planes(b)[:, None])[0]
    more = [int((a + b > j).sum() - (a > j).sum()) for j in range(seen)]
    assert gain == pytest.approx(sum(0.5 ** (seen - 1 - j) * n for j, n in enumerate(more)))


@pytest.mark.parametrize("seen", [1, 2])
@given(rng=GENERATORS)
def test_bounds_of_gains_lead_to_the_best_place(seen, rng):
    words = rng.integers(0, 1 << 63, (3, seen, 40, 3), dtype=np.uint64)
    words = np.bitwise_and.reduce(words, axis=0)  # few bits, so that gains differ
    here = Gains(words)
    cover = np.zeros((seen, 3), np.uint64)
    costs, free = rng.uniform(0, 20, 40), rng.uniform(size=40) < 0.7
    for _ in range(4):
        free[0] = True
        best = here.best(cover, costs, free)
        scores = gains(cover, words) - costs
        assert free[best]
        assert scores[best] == scores[free].max()
        cover = joined(cover, words[:, best])
        free &= rng.uniform(size=40) < 0.8


@given(st.sampled_from([None, "ring"]), st.integers(0, 1000))
@example("ring", 1)
@example("ring", 38)
@example("ring", 474)
@example(None, 168)
def test_no_exchange_of_one_ring_betters_a_combination_of_a_small_library(losing, seed):
    space = TWO_RINGS
    fields = Fields(space, TargetPoints(PLAIN, 256, 0))
    rng = np.random.default_rng(seed)
    library = ring_library(space, fields.all, 1, rng, NEVER, _round(22), [fresh(space, rng)])
    ruin = RuinRecreate(library, np.random.default_rng(0), losing)
    segment, room = library.places.segment, [s.room for s in space.segments]
    values = {
        pair: ruin._value(library, pair)
        for pair in itertools.combinations(range(24), 2)
        if segment[pair[0]] != segment[pair[1]] or room[segment[pair[0]]] > 1
        if library.spans.apart(np.array(pair[:1]))[pair[1]]
    }
    best = ruin.improved(library.own[0].tolist(), 60, NEVER)
    assert best.value == values[tuple(sorted(best.chosen))]
    assert best.value >= max(v for pair, v in values.items() if {*pair} & {*best.chosen})
    if not losing:  # what a greedy choice of two sets reaches (Nemhauser et al., 1978)
        assert best.value >= 0.75 * max(values.values())


def _value_by_sets(library, chosen, losing):
    """Return what a combination is worth from the sets of points of its rings."""
    bits = np.unpackbits(library.words[0].view(np.uint8), axis=-1).astype(bool)
    held = np.unpackbits(library.held[0].view(np.uint8)).astype(bool)
    sets = [{*np.flatnonzero(bits[j] & ~held)} for j in chosen]
    every = set().union(*sets)
    alone = [len(s - set().union(*sets[:i], *sets[i + 1 :])) for i, s in enumerate(sets)]
    if losing == "sensor":
        alone = [n / library.places.sensors[j] for n, j in zip(alone, chosen, strict=True)]
    return held.sum() + len(every) - (max(alone) if losing else 0)


@given(st.sampled_from([None, "ring", "sensor"]), GENERATORS, st.integers(0, 5))
def test_the_value_of_a_combination_is_that_of_its_sets_of_points(losing, rng, rings):
    library, _, _ = _drawn("plain", "free")
    chosen = rng.choice(len(library.places.sensors), rings + 1, replace=False).tolist()
    ruin = RuinRecreate(library, np.random.default_rng(0), losing)
    assert ruin._value(library, chosen) == pytest.approx(_value_by_sets(library, chosen, losing))


def test_places_near_rings_let_two_rings_change_places():
    library, _, known = _drawn("plain", "equal")
    space, rng = library.space, np.random.default_rng(3)
    rings = places_of(space, known[0])
    near = places_near(space, rng, rings, 200, 0.0)
    size = len(near.sensors) // len(rings.sensors)
    for i, segment in enumerate(rings.segment):
        there = set(np.round(near.position[i * size : (i + 1) * size], 9))
        others = rings.position[rings.segment == segment]
        first, last, _ = _room(
            space, rings.segment[[i] * len(others)], rings.tilt[[i] * len(others)]
        )
        assert set(np.round(np.clip(others, first, last), 9)) <= there


def test_many_places_anywhere_lie_some_spacings_from_an_end():
    space = _space(REAL, "free")
    places = places_anywhere(space, np.random.default_rng(0), 2000)
    first, last, spacing = _room(space, places.segment, places.tilt)
    assert (places.position >= first).all()
    assert (places.position <= last).all()
    assert (spacing[last > first] > 0).all()
    steps = np.minimum(places.position - first, last - places.position)[last > first]
    steps /= spacing[last > first]
    assert 0.15 < np.mean(np.abs(steps - np.round(steps)) < 1e-9) < 0.4


def test_a_stop_ends_the_trials():
    library, _, _ = _drawn("plain", "free")
    stopped = StopToken(math.inf)
    stopped.pulled.set()
    start = library.own[0].tolist()
    best = RuinRecreate(library, np.random.default_rng(0)).improved(start, 10**9, stopped)
    assert best.chosen == tuple(start)


def test_a_stop_ends_the_tests_of_a_library():
    space = _space(REAL, "free")
    fields, rng = Fields(space, TargetPoints(REAL, 256, 0)), np.random.default_rng(0)
    times = iter(range(100))
    late = StopToken(9.0, lambda: float(next(times)))
    known = [fresh(space, rng)]
    library = ring_library(space, fields.all, 1, rng, late, _round(2000), known)
    unseen = ring_library(space, fields.all, 1, rng, late, _round(2000), known)
    seen = library.words[0].any(axis=1)
    assert 0 < seen.mean() < 0.5  # only the places of a few batches
    assert not unseen.words.any()
    start = library.own[0].tolist()
    best = RuinRecreate(library, np.random.default_rng(0)).improved(start, 8, NEVER)
    assert best.value > 0
    assert not faults(REAL, space.setup(library.candidate(best.chosen)).rings)


TARGETS = {"near": Shell(0.5), "far": Shell(1.5), "tool": ReachAndToolSpheres()}


AIMS = {
    "mean": Criterion(),
    "two": Criterion(seen=2),
    "ring": Criterion(losing="ring"),
    "sensor": Criterion(losing="sensor"),
    "errors": Criterion(errors=MountingErrors(), draws=4),
}


@cache
def fields(name, aim=None, **options):
    """Return fields of a scene in which the robot hides points: of 48 sensors in any rings, or with
    a criterion of given rings."""
    scene = Scene(targets=(TARGETS[name],), **options)
    criterion = AIMS[aim or "mean"]
    space = Space(scene, ring_layout(scene, 2, 8)) if aim else Space(scene, sensors=48)
    return Fields(space, TargetPoints(scene, 256, 0, criterion.mountings), criterion)


def words(of, seed):
    """Return the bits of the points that rings see at 200 places."""
    rng = np.random.default_rng(seed)
    return ring_library(of.space, of.all, 1, rng, NEVER, _round(200)).words[0]


def exactly(of):
    """Return fields whose lines of sight are not guessed."""
    exact = copy(of)
    exact.all = replace(of.all, outlook={})
    return exact


@settings(max_examples=4)
@given(st.sampled_from(sorted(TARGETS)), st.integers(0, 2**31))
def test_a_guess_ranks_places_as_exact_lines_of_sight_do(name, seed):
    exact, guessed = (words(of, seed) for of in (exactly(fields(name)), fields(name)))
    seen, wrong = (np.bitwise_count(w).sum(axis=1) for w in (exact, exact ^ guessed))
    assert wrong.sum() < 0.03 * seen.sum()
    assert np.corrcoef(seen, np.bitwise_count(guessed).sum(axis=1))[0, 1] > 0.995


@settings(max_examples=5)
@given(st.sampled_from(sorted(AIMS)), st.sampled_from(["shadow", "blind"]), st.integers(0, 2**31))
def test_where_guesses_rank_places_exact_lines_of_sight_decide(aim, occlusion, seed):
    of = fields("near", aim, occlusion=occlusion)
    criterion = criterion_by_counts(of.scene, of.aim)
    rng = np.random.default_rng(seed)
    here = Exchange(of.space, fresh(of.space, rng), rng, criterion)
    here.look(of.all)
    start = here.value
    here.sweep(Round(0, 0, 0, 4, 0.2, 4, pairs=1), NEVER)
    anew = Exchange(of.space, here.candidate, rng, criterion)
    anew.look(of.all)
    assert here.value == anew.value > start


def test_a_guess_without_occluders_or_with_blinded_sensors_is_exact():
    for options in ({"occlusion": "ignore"}, {"occlusion": "blind"}):
        assert not fields("near", **options).all.outlook


def test_a_schedule_follows_what_costs_time_and_ends_with_few_candidates_on_many_points():
    paper, shadow = Scene.paper(), Scene(rules=Rules(mount="free"))
    square = replace(shadow, sensor=effective(Use("vl53l5cx")).sensor)
    blind, many = replace(shadow, occlusion="blind"), (Pose(Q),) * 20
    worst = replace(shadow, poses=many, over_poses="worst")

    def given(scene, aim="mean", rings=2):
        return given_rings(scene, Space(scene, ring_layout(scene, rings, 6)), AIMS[aim])

    free = [any_rings(scene, Space(scene, sensors=40)) for scene in (paper, shadow)]
    dear = [given(blind), *(given(shadow, aim) for aim in AIMS if aim != "mean")]
    for rounds in (given(paper), given(shadow), given(worst), given(square), *dear, *free):
        each = [(r.points, r.keep, r.scale, r.anywhere) for r in rounds]
        for (n, keep, scale, others), (more, fewer, nearer, less) in itertools.pairwise(each):
            assert more == 2 * n
            assert fewer <= keep
            assert nearer < scale
            assert less <= others
        assert rounds[-1].keep <= 6
    assert all(rounds[0].keep < given(shadow)[0].keep for rounds in dear)
    assert given(square)[0].anywhere > given(shadow)[0].anywhere
    assert len(given(paper)) > len(given(shadow))
    assert given(shadow, rings=4)[0].pairs > given(shadow)[0].pairs
    assert all(r.trials for r in free[0][:-1])
    space = Space(paper, sensors=40)
    assert usual(paper, space, AIMS["mean"]) == free[0]
    known = usual(paper, space, AIMS["mean"], known=True)
    assert known == free[0][-len(known) :]
