"""The dossier: distances, access on the floor, inputs and their states."""

from collections import deque
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from place_rings.coverage.person_reach import Person
from place_rings.coverage.robots.separation_distance import Safety, approach_distance
from place_rings.coverage.robots.stop_times import StopTime
from place_rings.objectives.named_layouts import layout_in
from place_rings.objectives.obstacle import Obstacle
from place_rings.objectives.scene import Scene
from place_rings.simulation.dossier.dossier import distances
from place_rings.simulation.dossier.floor import (
    Floor,
    floor_grid,
    floor_record,
    largest_unseen,
    reached,
)
from place_rings.simulation.safety import motion_of
from place_rings.simulation.safety_options import SafetyOptions

LENGTH = st.floats(0, 3)
GRIDS = st.tuples(st.integers(3, 12), st.integers(3, 12)).flatmap(
    lambda shape: st.tuples(*[arrays(bool, shape)] * 2)
)


@given(LENGTH, LENGTH, LENGTH, LENGTH, LENGTH, LENGTH, LENGTH, st.integers(0, 5))
def test_distances_grow_with_every_term(reaction, intrusion, sensor, robot, stop, speed, more, key):
    """And walking never needs more than an upper limb; no distance is below 0.1 m."""

    def rows(*changes):
        terms = [reaction, intrusion, sensor, robot, stop, speed]
        for place, by in changes:
            terms[place] += by
        names = ("reaction", "intrusion", "sensor", "robot", "stopping")
        safety = Safety(**dict(zip(names, terms, strict=False)))
        return distances(safety, terms[5], terms[4], [1.0, 2.0])

    for before, after in zip(rows(), rows((key, more)), strict=True):
        for name in ("S_p_m", "S_m", "S_parallel_m"):
            assert getattr(after, name) >= getattr(before, name) - 1e-12
            assert getattr(before, name) >= (0.1 if name != "S_p_m" else 0)
        assert before.reached == (before.S_p_m <= 1) <= before.some_reach == (before.S_p_m <= 2)
    walking, limb = rows()
    assert walking.S_p_m <= limb.S_p_m
    assert walking.S_m <= limb.S_m


def test_the_least_distance_holds():
    assert approach_distance(1.6, 0.01, 0, 0) == 0.1
    assert approach_distance(1.6, 0.5, 0.2, 0.15) == pytest.approx(1.15)


@given(GRIDS)
def test_places_are_reached_as_by_a_search_from_square_to_square(grids):
    passable, start = grids
    todo, seen = deque(zip(*np.nonzero(passable & start), strict=True)), np.zeros_like(passable)
    while todo:
        i, j = todo.popleft()
        if seen[i, j]:
            continue
        seen[i, j] = True
        near = [(i + a, j + b) for a in (-1, 0, 1) for b in (-1, 0, 1)]
        todo.extend(p for p in near if min(p) >= 0 and np.all(np.less(p, passable.shape)))
        todo = deque(p for p in todo if passable[p])
    assert np.array_equal(reached(passable, start), seen)


@given(
    st.tuples(st.integers(3, 9), st.integers(3, 9)).flatmap(
        lambda shape: st.tuples(
            *[arrays(bool, shape)] * 2, arrays(bool, (2, *shape)), arrays(bool, (2, *shape))
        )
    )
)
def test_undetected_places_are_nested(grids):
    room, outside, unseen, within = grids
    axes = tuple(0.1 * np.arange(n) for n in room.shape)
    floor = Floor(*axes, 0.1, 0.0, Person(), np.arange(2), room, room & outside, unseen, within)
    assert not (floor.access & ~floor.possible_access).any()
    assert not (floor.possible_access & ~(floor.near & floor.at_times_unseen)).any()
    assert not (floor.never_seen & ~floor.at_times_unseen).any()
    assert not (floor.near_unseen & ~(floor.near & floor.at_times_unseen)).any()
    radius, place = largest_unseen(floor)
    assert (radius is None) == (not floor.near_unseen.any())
    if place is not None:
        i, j = (int(np.abs(axis - at).argmin()) for axis, at in zip(axes, place, strict=True))
        assert floor.near_unseen[i, j]
        blocked = ~(room & unseen)
        bare = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        clear = [
            np.linalg.norm(bare[b] - place, axis=1).min() if b.any() else np.inf for b in blocked
        ]
        assert radius <= floor.person.radius + max(clear) + 1e-9


def floor_of(scene, name="n3_16_55"):
    setup = layout_in(scene, name)
    motion = motion_of(setup, scene, None, SafetyOptions())
    return floor_grid(scene, setup, motion.full, "shadow"), motion


def test_longer_ranges_see_more_and_walls_keep_people_out():
    scene = Scene()
    near, motion = floor_of(scene)
    far, _ = floor_of(replace(scene, sensor=replace(scene.sensor, range_m=4.0)))
    assert near.never_seen.sum() > far.never_seen.sum()
    assert not (far.unseen & ~near.unseen).any()
    assert near.near.sum() == far.near.sum() > 0
    required = float(motion.full.required.max())
    corner = np.hypot(*np.meshgrid(near.x, near.y)) < 0.3
    assert near.near[corner & near.room].all()
    assert near.x[-1] > required
    walls = tuple(
        Obstacle(name=f"wall {i}", centre=centre, size=size)
        for i, (centre, size) in enumerate(
            (
                ((2.0, 0.0, 0.5), (0.2, 4.2, 3.0)),
                ((-2.0, 0.0, 0.5), (0.2, 4.2, 3.0)),
                ((0.0, 2.0, 0.5), (4.2, 0.2, 3.0)),
                ((0.0, -2.0, 0.5), (4.2, 0.2, 3.0)),
            )
        )
    )
    inside = np.abs(np.stack(np.meshgrid(near.x, near.y))).max(axis=0) < 1.6
    fenced, _ = floor_of(replace(scene, obstacles=walls))
    assert fenced.near[inside].any()
    assert not (fenced.possible_access & inside).any()
    record = floor_record(near, 1)
    assert record.never_seen_m2 == pytest.approx(near.never_seen.sum() * near.side**2)


def test_people_come_from_the_edge_of_the_walkable_areas():
    area = ((0.6, -1.0), (1.6, -1.0), (1.6, 1.0), (0.6, 1.0))
    floor, _ = floor_of(Scene(person=Person(floor=-0.75, areas=[area])), "n1_8_0")
    assert floor.room.any()
    assert (floor.outside & floor.room).sum() < floor.room.sum()
    assert floor.outside.any()
    assert not floor.room[floor.x < 0.3].any()


def test_measured_stops_change_the_distances_of_the_simulation():
    stops = tuple(
        StopTime(
            joint="elbow",
            extension_percent=100,
            load_percent=100,
            speed_percent=100,
            stop_s=1.0,
            stop_rad=0.3,
            repeat=n,
        )
        for n in (1, 2)
    )
    scene = Scene()
    setup = layout_in(scene, "n1_8_0")
    slow = replace(scene, safety=Safety(stop_times=stops))
    before, after = (
        motion_of(setup, s, None, SafetyOptions()).full.required for s in (scene, slow)
    )
    np.testing.assert_allclose(after - before, 1.6 * (1.0 - 0.45), atol=1e-9)
