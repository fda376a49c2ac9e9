"""Searches with dozens of rings: they keep all rules, and what saves time and memory changes no
result.
"""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.rings.ring import Ring
from place_rings.objectives.criterion import Criterion
from place_rings.objectives.feasibility import mounting
from place_rings.objectives.feasibility.clearance import MountClearance
from place_rings.objectives.feasibility.ring_envelopes import envelope
from place_rings.objectives.feasibility.violations import faults
from place_rings.objectives.link_segments import ABOVE, BELOW, HIGH, LOW, TILTS
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.parameterization import decode, encode, positions
from place_rings.objectives.scene import Pose, Scene
from place_rings.objectives.target_points import TargetPoints
from place_rings.placement.search import exchange, exchange_points, ring_library
from place_rings.placement.search.exchange_criteria import criterion_by_counts
from place_rings.placement.search.exchange_points import Fields
from place_rings.placement.search.schedule import Round
from place_rings.placement.space.design import Space
from place_rings.placement.space.ring_places import places_of
from place_rings.placement.space.starts import fresh
from place_rings.placement.stop_token import StopToken

from ..support.searching import search

CLOSE = Rules(mount="free", spacing=0.02, sensors=(3, 24), max_rings_per_link=32)
FREE = Scene(rules=CLOSE)
REAL = Scene(rules=replace(CLOSE, mount="real"))
SPACES = {"free": Space(FREE, sensors=240), "real": Space(REAL, sensors=240)}
SHORT = (
    Round(128, 2, 0, 0, 0.0, trials=5, library=400),
    Round(128, 1, 1, 4, 0.1, 2, 2, trials=5, library=200, beside=2),
)
SEEDS = st.integers(0, 2**31)


@pytest.mark.parametrize(
    ("scene", "rings", "sensors"),
    [pytest.param(FREE, 40, 400, marks=pytest.mark.slow), (REAL, 18, 300)],
)
def test_a_search_with_dozens_of_rings_keeps_all_rules(scene, rings, sensors):
    result = search(Space(scene, sensors=sensors, rings=rings), schedule=SHORT, voxel=0.1)
    assert len(result.setup.rings) == rings
    assert sum(ring.count for ring in result.setup.rings) == sensors
    assert not faults(scene, result.setup.rings)


def test_up_to_64_free_rings_fit_and_2000_sensors():
    scene = replace(
        FREE, rules=replace(CLOSE, spacing=0.01, max_rings_per_link=64, sensors=(3, 40))
    )
    assert Space(scene, sensors=2000).places == 64
    assert Space(scene, sensors=200, rings=64).places == 64


def _direct(where, along, tilt):
    """Positions of rings, from the definition: every ring beside all others of its segment."""
    n = len(along)
    at = np.clip((tilt - TILTS[0]) / (TILTS[1] - TILTS[0]), 0, len(TILTS) - 1)
    rows = np.array(
        [
            [np.interp(at[k], range(len(TILTS)), where.by_tilt[k, r]) for r in range(4)]
            for k in range(n)
        ]
    )
    position = np.zeros(n)
    for k in range(n):
        same = [j for j in range(n) if where.segment[j] == where.segment[k]]
        same.sort(key=lambda j: (along[j], j))
        offset = {same[0]: 0.0}
        for a, b in itertools.pairwise(same):
            step = max(rows[a, ABOVE] + rows[b, BELOW], where.least[b])
            offset[b] = offset[a] + step
        i = same.index(k)
        low = max(rows[j, LOW] - offset[j] for j in same[: i + 1])
        high = min(rows[j, HIGH] - offset[j] for j in same[i:])
        position[k] = offset[k] + low + along[k] * max(high - low, 0.0)
    return position


@pytest.mark.parametrize("name", SPACES)
@settings(max_examples=10)
@given(SEEDS, st.booleans())
def test_positions_of_many_rings_are_those_of_their_definition(name, seed, equal):
    space, rng = SPACES[name], np.random.default_rng(seed)
    c = fresh(space, rng)
    where, values = space.stretch(c), space.values(c)
    if equal:
        values[0] = np.round(values[0], 1)
    expected = _direct(where, values[0], values[1])
    assert positions(where, values[0], values[1]) == pytest.approx(expected, abs=1e-9)
    each = positions(where, np.stack([values[0], 1 - values[0]]), np.stack([values[1]] * 2))
    assert each[0] == pytest.approx(expected, abs=1e-12)
    again = values.copy()
    again[0] = encode(where, values, expected)
    assert decode(where, again)[0] == pytest.approx(expected, abs=1e-9)


@pytest.fixture(scope="module")
def fields():
    return {n: Fields(s, TargetPoints(s.scene, 64, 0)) for n, s in SPACES.items()}


def _library(name, fields, seed, anywhere=300, beside=5):
    space, rng = SPACES[name], np.random.default_rng(seed)
    known = [fresh(space, rng) for _ in range(2)]
    field = fields[name].all
    wanted = Round(0, 0, 0, 0, 0.1, library=anywhere, beside=beside)
    return known, ring_library.ring_library(
        space, field, 1, rng, StopToken(math.inf), wanted, known
    )


@pytest.mark.parametrize("name", SPACES)
@pytest.mark.parametrize("seed", [0, 1])
def test_the_spacing_from_many_rings_is_that_from_each(name, seed, fields):
    _, library = _library(name, fields, seed)
    for own in library.own:
        each = [library.spans.apart(own[i : i + 1]) for i in range(len(own))]
        assert (library.spans.apart(own) == np.all(each, axis=0)).all()
    assert library.spans.apart(np.zeros(0, int)).all()


def test_a_library_in_small_parts_or_in_little_memory_is_the_same_or_holds_its_rings(
    fields, monkeypatch
):
    _, whole = _library("free", fields, 0)
    monkeypatch.setattr(ring_library, "_AT_ONCE", 100)
    _, parts = _library("free", fields, 0)
    assert (whole.words == parts.words).all()
    monkeypatch.setattr(ring_library, "_BYTES", 1000)
    known, small = _library("free", fields, 0)
    assert len(small.places.sensors) < len(whole.places.sensors) / 2
    for c, own in zip(known, small.own, strict=True):
        rings = places_of(SPACES["free"], c)
        assert all((a[own] == b).all() for a, b in zip(small.places, rings, strict=True))


def test_an_exchange_that_keeps_one_segment_table_at_a_time_ends_the_same(fields, monkeypatch):
    space, values = SPACES["real"], []
    for kept in (16, 1):
        monkeypatch.setattr(exchange, "_STRETCHES", kept)
        rng = np.random.default_rng(0)
        one = exchange.Exchange(
            space, fresh(space, rng), rng, criterion_by_counts(REAL, Criterion())
        )
        one.look(fields["real"].all)
        for i in one.candidate.rings[:4]:
            one.put(int(i), Round(0, 0, 0, 4, 0.1, 2))
        values.append((one.value, one.candidate.values.tolist()))
        assert len(one._stretches) <= kept
    assert values[0] == values[1]


def test_a_setup_without_any_sensor_has_a_value():
    space = Space(FREE, sensors=0)
    one = exchange.Exchange(
        space,
        fresh(space, np.random.default_rng(0)),
        np.random.default_rng(0),
        criterion_by_counts(FREE, Criterion()),
    )
    one.look(Fields(space, TargetPoints(FREE, 16, 0)).all)
    assert one.value == 0


def test_points_of_many_poses_do_not_fill_the_memory(monkeypatch):
    poses = tuple(Pose(FREE.poses[0].q + 0.01 * i) for i in range(4))
    space = Space(replace(FREE, poses=poses), sensors=12)
    for many, each in ((1 << 19, 256), (100, 32)):  # 128 points are 32 at each pose
        monkeypatch.setattr(exchange_points, "_MANY", many)
        fields = Fields.drawn(space, Criterion(), 128, 0)
        assert len(fields.all.part) == 4 * each


@settings(max_examples=4)
@given(SEEDS)
def test_collisions_of_rings_are_those_of_all_pairs(seed):
    rng = np.random.default_rng(seed)
    poses = [Pose(REAL.poses[0].q + rng.uniform(-1, 1, 6)) for _ in range(3)]
    scene = replace(REAL, poses=tuple(poses))
    clear = MountClearance(scene)
    links = rng.choice(scene.robot.links, 8)
    rings = [
        Ring(str(link), float(rng.uniform(0.0, 1.0)), 4, float(rng.uniform(-1, 1)), 0.0, 0.1)
        for link in links
    ]
    expected, every = set(), np.arange(len(poses))
    for (i, a), (j, b) in itertools.combinations(enumerate(rings), 2):
        pair = envelope(scene, a), envelope(scene, b)
        if a.link != b.link and len(mounting._near(clear, a, b, pair, every)):
            expected.add((i, j))
    assert {found.rings for found in mounting.meeting(clear, rings)} == expected
