"""Answers of drawn searches against the rules of their scenes, by a judge of its own: it takes the
dimensions of a ring from the package, but neither its rules nor its distances.
"""

import itertools
import math
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from place_rings.coverage.rings.clamp import clamp_of
from place_rings.coverage.rings.ring_envelope import envelope_of
from place_rings.coverage.robots.built_in import ROBOTS
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.ring_section import surrounded
from place_rings.coverage.sensors.boards import NOMINAL
from place_rings.coverage.solids.polyhedra import box
from place_rings.objectives.mount_rules import Limits, Rules
from place_rings.objectives.named_layouts import ring_layout
from place_rings.objectives.obstacle import Obstacle
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.placement.search.schedule import Round
from place_rings.placement.space.design import Space
from place_rings.placement.space.feasible_set import InfeasibleError

from ..support.searching import search

SIZE = 0.2  # m, of the boxes that are obstacles
SHORT = (Round(1024, 3, 1, 4, 0.2, 4), Round(2048, 2, 1, 4, 0.05))
STEP, TURNS = 0.004, 120  # m along a section, and parts of a turn, between points of a ring
EPS = 2e-6  # of a link, m or rad: places and angles are rounded


def surface(ring):
    """Points (N, 3) m on a solid ring, in its frame: z along the link."""
    section = []
    for band in ring.bands:
        along = np.linspace(band.low, band.high, 2 + int((band.high - band.low) / STEP))
        off = np.linspace(ring.bore, band.outer, 2 + int((band.outer - ring.bore) / STEP))
        section += [*itertools.product((ring.bore, band.outer), along)]
        section += [*itertools.product(off, (band.low, band.high))]
    (r, z), turn = np.array(section).T[:, :, None], 2 * math.pi * np.arange(TURNS) / TURNS
    return np.stack(np.broadcast_arrays(r * np.cos(turn), r * np.sin(turn), z), -1).reshape(-1, 3)


def to_ring(points, ring):
    """Least distance, m, of points in a ring's frame from the solid ring."""
    off, z = np.hypot(points[:, 0], points[:, 1]), points[:, 2]
    across = (np.clip(off, ring.bore, b.outer) - off for b in ring.bands)
    along = (np.clip(z, b.low, b.high) - z for b in ring.bands)
    return min(np.hypot(*gap).min() for gap in zip(across, along, strict=True))


def to_segment(points, start, end):
    """Least distance, m, of points from a segment."""
    way = end - start
    share = np.clip((points - start) @ way / max(way @ way, 1e-12), 0, 1)
    return np.linalg.norm(points - start - share[:, None] * way, axis=1).min()


def moved(T, points):
    return points @ T[:3, :3].T + T[:3, 3]


def alone(scene, ring, body):
    """Whether a ring breaks each of the rules for one ring."""
    mount, limits, rules = scene.robot.mount(ring.link), scene.limits_of(ring.link), scene.rules
    half, least = (ring.sensor.board or NOMINAL).width / 2, surrounded(scene.robot, ring.link)
    yield "sensors", not rules.sensors[0] <= ring.count <= rules.sensors[1]
    yield "tilt", not limits.tilt[0] - EPS <= ring.tilt <= limits.tilt[1] + EPS
    yield "standoff", scene.real and ring.radius < least + rules.standoff - EPS
    yield "boards", scene.real and ring.radius * math.tan(math.pi / ring.count) < half
    if mount.length:
        low, high = limits.position
        margin, at = rules.from_joints / mount.length, ring.position
        yield "position", not max(low, margin) - EPS <= at <= min(high, 1 - margin) + EPS
        yield "keep-out", any(a + EPS < at < b - EPS for a, b in limits.keep_out)
        low, high = (at + end / mount.length for end in (body.low, body.high))
        yield "closed", scene.real and (low < mount.usable[0] - EPS or high > mount.usable[1] + EPS)


def together(scene, rings):
    """Whether rings break each of the rules for several."""
    tilts = [abs(ring.tilt) for ring in rings]
    yield "shared tilt", scene.rules.shared_tilt and np.ptp(tilts) > 2 * EPS
    for mount in scene.robot.mounts:
        along = sorted(r.position * mount.length for r in rings if r.link == mount.link)
        yield "rings", len(along) > (scene.rules.max_rings_per_link if mount.length else 1)
        yield "spacing", any(np.diff(along) < scene.rules.spacing - EPS)


def around(scene, q, rings, bodies, boxes):
    """Whether rings at a pose are too near to the robot, to obstacles or to each other."""
    frames, least = forward(scene.robot.chain, q), scene.rules.clearance - EPS
    mounts = [scene.robot.mount(ring.link) for ring in rings]
    T = [frames[m.frame] @ m.T_link_ring(r.position) for m, r in zip(mounts, rings, strict=True)]
    for i, ring in enumerate(bodies):
        skin = surface(ring)
        points = moved(T[i], skin)
        # what a ring surrounds need not keep the clearance, but must not touch the bore
        outer = points[np.hypot(*skin.T[:2]) >= ring.bore + least]
        for part in scene.robot.bodies:
            at, capsule = np.eye(4) if part.frame < 0 else frames[part.frame], part.capsule
            ends = moved(at, np.stack([capsule.start, capsule.end]))
            yield "body", to_segment(points, *ends) < capsule.radius - EPS
            yield "body", to_segment(outer, *ends) < capsule.radius + least
        for centre in boxes:
            gap = np.maximum(abs(points - centre) - SIZE / 2, 0)
            yield "obstacle", np.linalg.norm(gap, axis=1).min() < least
        for j in {*range(len(rings))} - {i}:
            yield "collision", to_ring(moved(np.linalg.inv(T[j]), points), bodies[j]) < least


def broken(scene, rings, boxes):
    """The rules that rings break; ``boxes`` are the centres of the scene's obstacles."""
    bodies = []
    for ring in rings:
        board, inside = ring.sensor.board or NOMINAL, surrounded(scene.robot, ring.link)
        clamp = clamp_of(inside, ring.radius, ring.tilt, board, scene.printing)
        bodies.append(envelope_of(clamp, ring.tilt < 0))
    each = [alone(scene, ring, body) for ring, body in zip(rings, bodies, strict=True)]
    if scene.real:
        each += [around(scene, pose.q, rings, bodies, boxes) for pose in scene.poses]
    return {rule for rule, wrong in itertools.chain(together(scene, rings), *each) if wrong}


def drawn(rng):
    """A scene with drawn rules, the centres of its obstacles, and a budget."""
    robot, limits, some = ROBOTS[str(rng.choice(list(ROBOTS)))], {}, rng.uniform
    poses = robot.rest + some(-0.7, 0.7, (rng.integers(1, 3), len(robot.chain)))
    for link in robot.links:
        low, a, b, high = np.sort(some(0, 1, 4))
        if rng.random() < 0.3:
            limits[link] = Limits((low, high), (some(-1.2, -0.1), some(0.1, 1.2)), ((a, b),))
    least, extra, most, sensors, rings = rng.integers((3, 0, 1, 8, 1), (7, 12, 9, 60, 9)).tolist()
    mount, shared = "real" if rng.random() < 0.75 else "free", bool(rng.random() < 0.2)
    rules = Rules(some(0, 0.08), some(0, 0.04), (least, least + extra), most, shared)
    rules = replace(rules, mount=mount, standoff=some(0.005, 0.02), clearance=some(0.001, 0.01))
    boxes = some((-0.8, -0.8, -0.3), (0.8, 0.8, 1.3), (rng.integers(3), 3))
    scene = Scene(robot, poses=tuple(map(Pose, poses)), mounts=limits, rules=rules)
    obstacles = (Obstacle(f"{i}", box(at, np.full(3, SIZE))) for i, at in enumerate(boxes))
    occlusion = str(rng.choice(["ignore", "shadow", "blind"]))
    scene = replace(scene, occlusion=occlusion, obstacles=tuple(obstacles))
    layout = ring_layout(scene, 1 + rings % 3, least + extra // 2)
    budgets = {"sensors": sensors}, {"sensors": sensors, "rings": rings}, {"layout": layout}
    return scene, boxes, budgets[rng.integers(3)]


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(40))  # all of 200 kept the rules once
def test_the_answer_of_a_search_keeps_all_rules(seed):
    rng, rings = np.random.default_rng(seed), ()
    while not rings:
        with suppress(InfeasibleError):
            scene, boxes, budget = drawn(rng)
            limit = {"cap": 0.2} if seed % 10 else {"schedule": SHORT}  # without and with nlopt
            found = search(Space(scene, **budget), seed=seed, voxel=0.1, **limit)
            rings = found.setup.rings
    given = budget.get("layout", found.setup)
    assert len(rings) == budget.get("rings", len(given.rings))
    assert found.setup.sensors == budget.get("sensors", given.sensors)
    assert sorted((r.link, r.count) for r in rings) == sorted(
        (r.link, r.count) for r in given.rings
    )
    assert broken(scene, rings, boxes) == set()
    # and the judge sees what breaks a rule
    wrong = [replace(rings[0], count=60, tilt=1.5), *rings]
    assert {"sensors", "tilt", "spacing"} <= broken(scene, wrong, boxes)
