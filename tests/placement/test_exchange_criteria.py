"""The criteria of the exchange against direct evaluations: by sensors drawn at random, and by beams
one by one with occluders and mounting errors.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.rings.mounted_sensor import MountedSensor
from place_rings.coverage.rings.mounting_errors import Misplaced, MountingErrors, misplaced
from place_rings.coverage.rings.ring import Ring
from place_rings.coverage.rings.ring_kinematics import ring_arrays, seen_from, sensor_poses
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.coverage.solids.polyhedra import box
from place_rings.coverage.targets import Target
from place_rings.objectives.criterion import Criterion
from place_rings.objectives.occlusion import sight
from place_rings.objectives.parameterization import decode
from place_rings.objectives.scene import CoreScene, Goal, Obstacle, Pose, Rules, paper_scene
from place_rings.objectives.target_points import TargetPoints
from place_rings.placement.search.design import Space
from place_rings.placement.search.exchange import Exchange
from place_rings.placement.search.exchange_criteria import Tally, criterion_by_counts
from place_rings.placement.search.exchange_points import Field, Fields
from place_rings.placement.search.held_views import HeldViews
from place_rings.placement.search.layout import ring_layout
from place_rings.placement.search.moves import fresh
from place_rings.placement.search.ring_views import Views

POSES = (Pose(np.radians([0.0, -45.0, 60.0, -105.0, -90.0, 0.0])), Pose(np.full(6, -0.9), 2.0))
TWO = paper_scene(poses=POSES, goals=(Goal(Target("V_S", 0.5), 0.7), Goal(Target("V_S", 1.0), 0.3)))
AIMS = {
    "zeta": Criterion(),
    "twice": Criterion(2),
    "thrice": Criterion(3),
    "without a ring": Criterion(losing="ring"),
    "without a sensor": Criterion(losing="sensor"),
}
RINGS, EACH, HELD, POINTS = 3, 4, 2, 60


def _direct(scene, aim, field, each, cell):
    """By definition, from which of the sensors (Q, J, N) and of the cell's (N,) see a point."""
    part = field.part.astype(float)
    total = each.sum(axis=(0, 1)) + cell

    def zeta(covered):
        return float((covered @ part) @ scene.goal_weights)

    if aim.losing == "ring":
        return min(zeta(total - group.sum(axis=0) > 0) for group in each)
    if aim.losing:
        return min(zeta(total - one > 0) for group in each for one in group)
    if scene.over_poses == "worst":
        weight = field.in_pose.astype(float)
        return min(float(weight[here] @ (total[here] > 0)) for here in _at_poses(field))
    return zeta(total >= aim.seen)


def _at_poses(field):
    return [field.pose == p for p in np.unique(field.pose)]


def _tally(each, most, named):
    """Sensors (Q, J, N) as counts, and as the number of the last one that sees a point."""
    last = each.shape[1] - 1 - each[:, ::-1].argmax(axis=1)
    return Tally(
        tuple(np.minimum(each.sum(axis=1), most).astype(np.uint8)),
        tuple(last.astype(np.uint16)) if named else None,
    )


@pytest.mark.parametrize("name", [*AIMS, "worst pose"])
@given(st.integers(0, 2**31), st.floats(0.05, 0.6), st.sampled_from([0.0, 0.01]))
def test_a_criterion_by_counts_is_its_definition_and_a_move_changes_it_as_told(name, seed, p, soft):
    scene = replace(TWO, over_poses="worst") if name == "worst pose" else TWO
    aim, rng = AIMS.get(name, Criterion()), np.random.default_rng(seed)
    criterion = criterion_by_counts(scene, aim)
    goal, pose = rng.integers(2, size=POINTS), np.sort(rng.integers(2, size=POINTS))
    part = scene.pose_weights[pose][:, None] * (goal[:, None] == np.arange(2)) / POINTS
    in_pose = scene.goal_weights[goal] / POINTS
    each = rng.random((RINGS + HELD, EACH, POINTS)) < p
    cell = (rng.random(POINTS) < 0.1).astype(np.uint8)
    tally = _tally(each, criterion.most, criterion.named)
    assert criterion.named == (tally.sensor is not None)
    sensor = np.zeros((HELD, POINTS), np.uint16)
    held = HeldViews(np.stack(tally.count[RINGS:]), sensor, cell)
    field = Field(part.astype(np.float32), in_pose.astype(np.float32), {}, {}, None, held, pose, {})
    direct = _direct(scene, aim, field, each, cell)
    assert criterion.value(field, tally, 0.0) == pytest.approx(direct, abs=1e-6)

    ring, places = int(rng.integers(RINGS)), 5
    rest = criterion.rest(field, tally, ring, soft)
    criterion.value(field, tally, soft)
    moved = rng.random((places, EACH, POINTS)) < p
    views = _tally(moved, criterion.most, criterion.named)
    counts, sensors = np.stack(views.count), np.stack(views.sensor) if views.sensor else None
    seen = Views(counts[:, rest.index], None if sensors is None else sensors[:, rest.index])
    values = rest.values(seen)
    for i, (value, new) in enumerate(zip(values, moved, strict=True)):
        there = each.copy()
        there[ring] = new
        after = _tally(there, criterion.most, criterion.named)
        assert value == pytest.approx(criterion.value(field, after, soft), abs=1e-6)
        alone = Views(counts[i : i + 1], None if sensors is None else sensors[i : i + 1])
        same = tally.changed({ring: alone})
        assert (same.total == after.total).all()
        assert (same.owner == after.owner).all()


ERRORS = Criterion(errors=MountingErrors(0.01, math.radians(3.0)), draws=3)
TABLE = Obstacle("table", box([0.5, 0.3, 0.0], [0.6, 0.4, 0.5]))
SQUARE = Sensor(math.radians(45), 1.2, None, math.radians(30), 8)
SKIN = MountedSensor("forearm", (0.0, 0.08, 0.2), (0, 1, 0), Sensor(math.radians(60), 0.8))
CEILING = MountedSensor("base", (0.5, 0, 1.5), (0, 0, -1), Sensor(0.7, 1.2))
SCENES = {
    "cones": (TWO, Criterion()),
    "shadows": (CoreScene(poses=POSES, obstacles=(TABLE,)), Criterion(2)),
    "first returns": (CoreScene(poses=POSES, obstacles=(TABLE,), occlusion="blind"), Criterion()),
    "squares in shadows": (CoreScene(poses=POSES, sensor=SQUARE), Criterion(losing="sensor")),
    "errors": (TWO, ERRORS),
    "errors in shadows": (CoreScene(obstacles=(TABLE,)), ERRORS),
    "errors of squares": (paper_scene(sensor=SQUARE), ERRORS),
    "beside what stays": (
        paper_scene(
            rules=Rules(fixed=(Ring("forearm", 0.5, 4),), fixed_sensors=(SKIN,)),
            cell_sensors=(CEILING,),
        ),
        ERRORS,
    ),
}


def _beams(space, c, pose, drawn, mounting):
    """Beams of the rings at their places, of what stays, and of the cell, at a pose."""
    scene, R = space.scene, space.places
    position, tilt, phase = decode(space.stretch(c), space.values(c))
    links = [space.segments[s].link for s in c.segment]
    rings = tuple(space.ring(link, int(n)) for link, n in zip(links, c.count, strict=True))
    groups = (*rings, *space.held)
    arrays = ring_arrays(scene.robot, groups)
    seats = sensor_poses(arrays, position, tilt, phase)
    seats = type(seats)(*(v[None] for v in seats))
    if drawn is not None:
        own, most = len(groups) - len(scene.cell_sensors), space.most
        first = [*(i * most for i in range(R)), *(R * most + np.cumsum([0, 4, 1])[:2])]
        columns = [a + k for a, g in zip(first, groups[:own], strict=False) for k in range(g.count)]
        errors = Misplaced(drawn.slip[:, :own], drawn.turn[:, :own], drawn.seat[:, columns])
        still = len(scene.cell_sensors)
        meant = type(seats)(*(v[0] for v in seats))
        seats = misplaced(arrays, meant, errors.beside(still))
    else:
        mounting = 0
    frames = forward(scene.robot.chain, scene.poses[pose].q)
    cones = arrays.beams.solids(*(v[mounting] for v in seen_from(arrays, seats, frames, up=True)))
    bare = replace(scene, cell_sensors=())
    return sight(bare, cones, scene.poses[pose].q), np.repeat(
        np.arange(len(groups)), [g.count for g in groups]
    )


@pytest.mark.long
@pytest.mark.parametrize("name", SCENES)
def test_what_rings_see_in_the_exchange_is_what_their_beams_hold(name):
    scene, aim = SCENES[name]
    space, n = Space(scene, ring_layout(scene, 2, 8)), 300
    points = TargetPoints(scene, n, 0, aim.mountings)
    fields, criterion = Fields(space, points, aim), criterion_by_counts(scene, aim)
    own = len(scene.rules.fixed) + len(scene.rules.fixed_sensors)
    drawn = aim.drawn(space.places + own, space.places * space.most + 5 * (own > 0))
    same = total = hidden = 0
    for seed in range(3):
        c = fresh(space, np.random.default_rng(seed))
        here = Exchange(space, c, np.random.default_rng(seed), criterion)
        here.look(fields.all)
        for t, ((_, pose), some) in enumerate(zip(points.terms, points.points, strict=True)):
            mounting = t // (len(points.terms) // points.mountings)
            beams, group = _beams(space, c, pose, drawn, mounting)
            each = np.stack([beams.part(some, np.full(n, k)) for k in range(len(group))])
            clear = (np.abs(each) > 1e-4).all(axis=0)
            mine = slice(t * n, (t + 1) * n)
            for g in range(space.places + own):
                expected = np.minimum((each[group == g] <= 0).sum(axis=0), criterion.most)
                right = here._tally.count[g][mine] == expected
                same, total = same + (right & clear).sum(), total + clear.sum()
                if name != "first returns":
                    assert right[clear].all(), (seed, t, g)
            cell = (each[group >= space.places + own] <= 0).sum(axis=0)
            assert np.array_equal(fields.all.held.cell[mine][clear], cell[clear])
            hidden += (each <= 0).sum()
    # the first return of a body that grazes a beam differs
    assert same >= 0.995 * total
    assert hidden > 100
