"""Real mounts: what is drawn or varied keeps clear of all things at all poses; what cannot be is
refused.
"""

import math
from dataclasses import replace
from functools import cache
from unittest.mock import Mock

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.definitions.errors import UserError
from place_rings.coverage.rings.convex_extents import extents
from place_rings.coverage.rings.envelope_clearance import (
    blocked_by_capsules,
    blocked_by_polyhedra,
    least_distance,
    surface_points,
)
from place_rings.coverage.rings.ring import Ring, Setup, named_setup
from place_rings.coverage.rings.ring_envelope import Band, Envelope
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.rings.rounding import rounded
from place_rings.coverage.robots.attached import Attached
from place_rings.coverage.robots.built_in import ROBOTS, UR10
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.link_bodies import carried_polyhedra, robot_capsules
from place_rings.coverage.robots.ring_section import axes_of, tube_of
from place_rings.coverage.robots.robot import Body
from place_rings.coverage.sensors.boards import VL53L5CX
from place_rings.coverage.solids.capsules import Capsules
from place_rings.coverage.solids.polyhedra import box
from place_rings.coverage.solids.segments import point_to_segment
from place_rings.formats.loader import read_scene
from place_rings.objectives.feasibility.clearance import MountClearance
from place_rings.objectives.feasibility.mounting import alone, meeting
from place_rings.objectives.feasibility.ring_envelopes import envelope
from place_rings.objectives.feasibility.violations import faults, otherwise_tilted
from place_rings.objectives.link_segments import GRAIN, TILTS, segments
from place_rings.objectives.mount_rules import Limits, Rules
from place_rings.objectives.named_layouts import ring_layout
from place_rings.objectives.obstacle import Obstacle
from place_rings.objectives.occlusion import occluders
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.placement.redesign.problem import RedesignProblem
from place_rings.placement.space import starts
from place_rings.placement.space.design import Space
from place_rings.placement.space.feasible_set import InfeasibleError
from place_rings.placement.space.starts import _drawn, feasible, fresh
from place_rings.reporting.lines.occlusion import shared_tilt_line
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

from ..support import drawing
from ..support.scene_tables import reread

TABLE = Obstacle("table", centre=(0.5, 0.0, 0.3), size=(0.4, 0.8, 0.05))


def drawn_scene(rng: np.random.Generator, obstacles: tuple[Obstacle, ...] = ()) -> Scene:
    """A real mount of any robot with up to two attached solids, at one to four poses."""
    robot = ROBOTS[str(rng.choice(list(ROBOTS)))]
    poses = [
        robot.rest + rng.normal(0, 0.2, len(robot.rest)) * i for i in range(rng.integers(1, 5))
    ]
    if robot.limits is not None:
        poses = [np.clip(q, robot.limits[:, 0], robot.limits[:, 1]) for q in poses]
    centre, *ends = rng.uniform(-0.3, 0.3, (3, 3))
    solids = box(centre, rng.uniform(0.04, 0.3, 3)), Capsules(*ends, float(rng.uniform(0.02, 0.1)))
    links = rng.choice(["tcp", "forearm", "upper_arm", "base"], 2).tolist()
    each = [Attached(f"on {k}", *one) for k, one in enumerate(zip(links, solids, strict=True))]
    robot = robot.with_attached(tuple(each[: rng.integers(3)]))
    return Scene(
        robot=robot, poses=tuple(Pose(q) for q in poses), occlusion="shadow", obstacles=obstacles
    )


def drawn_envelope(rng: np.random.Generator) -> Envelope:
    """Two bands of a ring from 2 to 20 cm wide."""
    bore = float(rng.uniform(0.01, 0.1))
    bands = []
    for _ in range(2):
        low, high = np.sort(rng.uniform(-0.03, 0.03, 2))
        bands.append(Band(float(low), float(high), bore + float(rng.uniform(0.001, 0.1))))
    return Envelope(bore, tuple(bands))


def solid_points(envelope: Envelope, at: float, rng: np.random.Generator, n: int) -> np.ndarray:
    """Points (n, 3) in the material of an envelope at a position, in axis coordinates."""
    points = []
    for band in envelope.bands:
        off = np.sqrt(rng.uniform(envelope.bore**2, band.outer**2, n))
        angle, along = rng.uniform(0, 2 * np.pi, n), rng.uniform(band.low, band.high, n)
        points.append(np.stack([at + along, off * np.cos(angle), off * np.sin(angle)], axis=1))
    return np.concatenate(points)


def blocks(cuts: list[tuple[float, float, int]], at: float) -> bool:
    return any(a <= at <= b for a, b, _ in cuts)


@given(drawing.seeds)
def test_an_envelope_meets_no_capsule_where_it_is_not_blocked(seed):
    rng = np.random.default_rng(seed)
    around = drawn_envelope(rng)
    start, end = rng.uniform(-0.2, 0.2, (2, 1, 3))
    thick = rng.uniform(0.005, 0.1, 1)
    cuts = blocked_by_capsules(around, start, end, thick)
    for at in rng.uniform(-0.3, 0.3, 20):
        some = solid_points(around, at, rng, 400)
        depth = (point_to_segment(some, start, end) - thick).min()
        if depth < 0:
            assert blocks(cuts, at)


@given(drawing.seeds)
def test_an_envelope_is_blocked_only_where_it_is_within_a_millimetre_of_a_capsule(seed):
    rng = np.random.default_rng(seed)
    around = drawn_envelope(rng)
    start, end = rng.uniform(-0.15, 0.15, (2, 1, 3))
    thick = rng.uniform(0.01, 0.1, 1)
    cuts = blocked_by_capsules(around, start, end, thick)
    axis = start + np.linspace(0, 1, 4001)[:, None] * (end - start)
    for a, b, _ in cuts:
        for at in (a + 2e-3, (a + b) / 2, b - 2e-3):
            if a < at < b:
                assert least_distance(around, [axis], at)[0] <= thick[0] + 1e-3


def test_a_ball_blocks_the_interval_of_its_closed_form():
    around = Envelope(0.05, (Band(-0.01, 0.02, 0.08),))
    ball = np.array([[0.3, 0.1, 0.0]])  # 20 mm from the ring's outer wall
    cuts = blocked_by_capsules(around, ball, ball, np.array([0.025]))
    reach = math.sqrt(0.025**2 - 0.02**2)
    assert [(round(a, 9), round(b, 9)) for a, b, _ in cuts] == [
        (round(0.3 - 0.02 - reach, 9), round(0.3 + 0.01 + reach, 9))
    ]


def test_what_stays_inside_the_bore_blocks_nothing():
    around = Envelope(0.05, (Band(-0.01, 0.02, 0.08),))
    tube = np.array([[-1.0, 0.0, 0.0]]), np.array([[1.0, 0.0, 0.0]])
    assert blocked_by_capsules(around, *tube, np.array([0.0499])) == []
    assert blocks(blocked_by_capsules(around, *tube, np.array([0.0501])), 0.0)


@settings(max_examples=20)
@given(drawing.seeds)
def test_an_envelope_meets_no_box_where_it_is_not_blocked(seed):
    rng = np.random.default_rng(seed)
    around = drawn_envelope(rng)
    centre, size = rng.uniform(-0.2, 0.2, 3), rng.uniform(0.01, 0.3, 3)
    solid, span = box(centre, size), (-0.3, 0.3)
    cuts = blocked_by_polyhedra(around, solid.normal[None], solid.offset[None], span)
    for at in rng.uniform(*span, 20):
        some = solid_points(around, at, rng, 400)
        if np.any(solid(some) < 0):
            assert blocks(cuts, at)
    for a, b, _ in cuts:
        # the box reaches into the disc on whose surface the interval ends
        inside = centre + rng.uniform(-0.5, 0.5, (20000, 3)) * size
        near = inside[np.hypot(inside[:, 1], inside[:, 2]) < around.outer]
        if len(near) > 1000:
            assert a >= near[:, 0].min() - around.high - 0.03
            assert b <= near[:, 0].max() - around.low + 0.03


def drawn_body(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Normals and offsets of a turned box, a hull of few points, or one to three planes."""
    match rng.integers(3):
        case 0:
            turn, centre = np.linalg.qr(rng.normal(size=(3, 3)))[0], rng.uniform(-0.2, 0.2, 3)
            normal, size = np.concatenate([turn, -turn]), rng.uniform(0.005, 0.2, 3)
            return normal, normal @ centre + np.tile(size, 2)
        case 1:
            some = rng.uniform(-0.2, 0.2, 3) + 0.08 * rng.normal(size=(rng.integers(4, 8), 3))
            faces = ConvexHull(some).equations
            return faces[:, :3], -faces[:, 3]
    normal = rng.normal(size=(rng.integers(1, 4), 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return normal, rng.uniform(-0.2, 0.2, len(normal))


@given(drawing.seeds)
def test_the_extent_of_a_body_in_a_cylinder_lies_between_those_in_two_polygons(seed):
    """The polygons are taken as further faces of the body, which many faces leave to programmes."""
    rng = np.random.default_rng(seed)
    (normal, offset), outer, within = drawn_body(rng), float(rng.uniform(0.03, 0.15)), (-0.4, 0.5)
    low, high = extents(normal[None], offset[None], outer, within)
    angle = np.arange(64) * math.pi / 32
    sides = np.stack([0 * angle, np.cos(angle), np.sin(angle)], axis=1)
    for share, sign in ((1.0, 1), (math.cos(math.pi / 64), -1)):
        n = np.concatenate([normal, sides])[None]
        o = np.concatenate([offset, np.full(64, share * outer)])[None]
        least, most = extents(n, o, 2 * outer, within)
        if np.isfinite(least[0] if sign < 0 else low[0]):
            assert sign * (low[0] - least[0]) >= -1e-5
            assert sign * (most[0] - high[0]) >= -1e-5


def test_boxes_at_many_poses_are_compared_with_a_ring_at_once(monkeypatch):
    """Two linear programmes a box and pose took half a minute to find no radius for a ring."""
    monkeypatch.setattr("scipy.optimize.linprog", Mock(spec=linprog, side_effect=AssertionError))
    poses = tuple(Pose(UR10.rest + 0.25 * np.sin(0.0314 * i + np.arange(6))) for i in range(200))
    around = 0.6 * np.arange(10)
    boxes = tuple(
        Obstacle(
            f"{k}", box((0.9 * math.cos(a), 0.9 * math.sin(a), 0.1 * (k + 1)), (0.3, 0.3, 0.4))
        )
        for k, a in enumerate(around)
    )
    scene = Scene(poses=poses, occlusion="shadow", obstacles=boxes)
    assert MountClearance(scene).stretches("tool", 0.08) == []


def test_a_floor_blocks_all_below_it():
    around = Envelope(0.05, (Band(-0.01, 0.02, 0.08),))
    floor = np.array([[[1.0, 0.0, 0.0]]]), np.array([[-0.1]])
    ((a, b, _),) = blocked_by_polyhedra(around, *floor, (-0.3, 0.3))
    assert a < -0.3
    assert b == pytest.approx(-0.1 + 0.01)


@given(drawing.seeds)
def test_points_on_an_envelope_are_as_dense_as_stated(seed):
    rng = np.random.default_rng(seed)
    around, spacing = drawn_envelope(rng), float(rng.uniform(0.004, 0.02))
    points = surface_points(around, spacing)
    # outwards from a point in the material until it ends
    inside, way = solid_points(around, 0.0, rng, 5), rng.normal(size=(10, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    steps = np.arange(0, 0.5, 2e-4)[:, None, None] * way + inside
    material = around(steps) <= 0
    for k in range(10):
        out = np.flatnonzero(~material[:, k])
        last = steps[out[0] - 1, k]
        if np.hypot(*last[1:]) > around.bore + 1e-3:
            assert np.linalg.norm(points - last, axis=1).min() <= spacing + 3e-4


def test_rings_of_a_layout_with_another_board_are_clear():
    """As the viewer searches from them: places were those of the scene's smaller board."""
    scene = Scene(occlusion="shadow")
    limits = {link: Limits(tilt=(-0.2, 0.2)) for link in scene.robot.links}
    scene, sensor = replace(scene, mounts=limits), replace(scene.sensor, board=VL53L5CX)
    places = (("upper_arm", 0.2), ("upper_arm", 0.5), ("forearm", 0.3))
    layout = Setup(tuple(Ring(link, at, 4, 0.0, 0.0, 0.11, sensor) for link, at in places))
    space, rng = Space(scene, layout), np.random.default_rng(0)
    c = fresh(space, rng)
    low, high = (edge[:, : space.places] for edge in space.box(c))
    for _ in range(5):
        ends = replace(c, values=np.where(rng.uniform(size=c.values.shape) < 0.5, low, high))
        rings = rounded(space.setup(ends), scene.sensor).rings
        found = faults(scene, rings, space.clear)
        assert not [f for f in found if len({rings[i].link for i in f.rings}) == 1]


@pytest.mark.slow
@settings(max_examples=4)
@given(drawing.seeds, st.booleans())
def test_all_that_is_drawn_and_varied_is_clear_at_all_poses(seed, cluttered):
    rng = np.random.default_rng(seed)
    scene = drawn_scene(rng, (TABLE,) if cluttered else ())
    try:
        space = Space(scene, sensors=30)
    except InfeasibleError:
        return
    c = fresh(space, rng)
    for _ in range(2):
        low, high = (edge[:, : space.places] for edge in space.box(c))
        ends = replace(c, values=np.where(rng.uniform(size=c.values.shape) < 0.5, low, high))
        for setup in (rounded(space.setup(one), scene.sensor) for one in (c, ends)):
            on_one_link = [
                f
                for f in faults(scene, setup.rings, space.clear)
                if len({setup.rings[i].link for i in f.rings}) == 1
            ]
            assert on_one_link == []
            for ring in setup.rings:
                assert_clear(scene, space.clear.frames, ring, rng)
            for pose in scene.poses:
                apex = np.asarray(sensor_cones(scene.robot, setup, pose.q).apex)
                assert np.all(occluders(scene, pose.q).holds(apex)[0] < 0)
        c = fresh(space, rng)


def assert_clear(scene: Scene, frames: np.ndarray, ring: Ring, rng: np.random.Generator) -> None:
    """Compare points drawn in a ring's envelope with all bodies and obstacles."""
    mount, around = scene.robot.mount(ring.link), envelope(scene, ring)
    at = ring.position * mount.length
    if mount.length > 0:
        assert mount.usable[0] * mount.length <= at + around.low + 1e-8
        assert at + around.high <= mount.usable[1] * mount.length + 1e-8
    assert ring.radius >= mount.section + scene.rules.standoff - 1e-9
    here = solid_points(around, at, rng, 400) @ axes_of(mount) + mount.start
    T = frames[:, mount.frame]
    points = np.einsum("pij,nj->pni", T[:, :3, :3], here) + T[:, None, :3, 3]
    bodies = robot_capsules(scene.robot, frames)
    away = point_to_segment(points[:, :, None], bodies.start[:, None], bodies.end[:, None])
    assert (away - bodies.radius).min() >= 0
    for p, pose in enumerate(scene.poses):
        for solid in carried_polyhedra(scene.robot, pose.q):
            assert solid(points[p]).min() >= -1e-9
    assert all(o.body(points).min() >= scene.rules.clearance - 1e-6 for o in scene.obstacles)


@pytest.mark.slow
@pytest.mark.parametrize("name", list(ROBOTS))
def test_every_robot_has_room_for_real_rings_at_its_own_pose(name):
    scene = Scene(robot=ROBOTS[name], poses=(Pose(ROBOTS[name].rest),), occlusion="blind")
    space = Space(scene, ring_layout(scene, 1, 8))
    setup = space.setup(fresh(space, np.random.default_rng(0)))
    assert len(setup.rings) >= 2
    assert [f for f in faults(scene, setup.rings) if len(f.rings) == 1] == []


def test_real_is_what_goes_with_occlusion_unless_something_is_said():
    assert not Scene.paper().real
    assert Scene(occlusion="shadow").real
    assert Scene(occlusion="blind").real
    assert Scene(rules=Rules(mount="real"), occlusion="ignore").real
    assert not Scene(occlusion="shadow", rules=Rules(mount="free")).real
    free = Scene(occlusion="shadow", rules=Rules(mount="free"))
    assert segments(free) == segments(Scene.paper())
    assert Space(free, sensors=40).radii == Space(Scene.paper(), sensors=40).radii


def test_a_real_ring_goes_around_the_tube_itself():
    """The UR10's upper arm is 46 mm beside the line between its joints."""
    scene = Scene(occlusion="shadow")
    assert scene.least_radius("upper_arm") == pytest.approx(0.0556 + 0.012, abs=1e-3)
    assert Space(scene, sensors=40).radii == {"upper_arm": 0.08, "forearm": 0.08, "tool": 0.08}
    start, joint = (
        scene.robot.mount("upper_arm").start,
        Scene.paper().robot.mount("upper_arm").start,
    )
    assert np.linalg.norm((start - joint)[:2]) == pytest.approx(0.0457, abs=1e-3)


def test_what_cannot_be_mounted_is_refused_with_key_link_and_values():
    stated = Scene(occlusion="shadow", ring_radius=0.06)
    limits = {"upper_arm": Limits(radius=0.06), "forearm": Limits(radius=0.07)}
    wall = Obstacle("wall", box((0, 0, 0.5), (4, 4, 2)))
    for scene, says in (
        (stated, r"ring_radius: 0.06 m .*upper_arm .*0.068 m"),
        (replace(Scene(), mounts=limits), r"mounts.upper_arm.ring_radius: 0.06 m .*0.068 m"),
        (Scene(obstacles=(wall,)), r"rules.mount .*wall"),
    ):
        with pytest.raises(InfeasibleError, match=says):
            Space(scene, sensors=40)
    kept_out = replace(stated, mounts={"upper_arm": Limits(keep_out=((0.0, 1.0),))})
    assert "upper_arm" not in {s.link for s in Space(kept_out, sensors=40).segments}
    short = Scene(mounts={"upper_arm": Limits((0.0, 0.03))})
    with pytest.raises(InfeasibleError, match="upper_arm"):
        Space(short, Setup((Ring("upper_arm", 0.5, 8),)))


def test_the_papers_rings_are_named_where_they_cannot_be_mounted():
    found = faults(Scene(occlusion="shadow"), named_setup("n2_16_25").rings)
    texts = [f.text for f in found if f.rule == "mount"]
    assert any("0.000" in t for t in texts)
    assert any("upper_arm_0" in t for t in texts)
    assert faults(Scene.paper(rules=Rules(mount="free")), named_setup("n2_16_25").rings) == []


def test_rings_of_two_links_that_meet_are_named():
    robot = ROBOTS["ur3e"]
    # the elbow folds
    poses = tuple(Pose(robot.rest + math.radians(a) * np.eye(6)[2]) for a in range(-60, 120, 5))
    scene = Scene(robot=robot, poses=poses, occlusion="shadow")
    rings = (Ring("upper_arm", 0.5, 8, radius=0.2), Ring("forearm", 0.5, 8, radius=0.2))
    (found,) = (f for f in faults(scene, rings) if f.rings == (0, 1))
    assert all(part in found.text for part in ("ring 0 (upper_arm)", "ring 1 (forearm)", "pose "))
    apart = (rings[0], Ring("tool", 0.0, 8, radius=0.05))
    found = faults(replace(scene, poses=(Pose(robot.rest),)), apart)
    assert not [f for f in found if len(f.rings) == 2]


def test_changes_to_what_is_mounted_stand_where_rings_are_clear():
    scene = Scene(occlusion="shadow")
    work = RedesignProblem(scene, named_setup("n2_16_25"), 1)
    assert {s.link for s in work.segments((0,))} == {"upper_arm", "forearm"}
    assert work.radii["upper_arm"] == 0.08
    for s in work.segments((0, 1, 2, 3)):
        ((low, high),) = work.clear.stretches(s.link, work.radii[s.link])
        assert s.low <= low + GRAIN
        assert high - GRAIN <= s.high
        for tilt, ends in zip(TILTS[10:-10:5], s.by_tilt[:2, 10:-10:5].T, strict=True):
            for end in ends:
                ring = Ring(s.link, float(end), 16, float(tilt), 0.0, work.radii[s.link])
                closes = work.clear.closed(ring)
                assert closes[0] <= end <= closes[1]
                assert work.clear.within(ring) == []


def test_a_link_can_have_a_ring_radius_of_its_own(tmp_path):
    (tmp_path / "scene.toml").write_text(
        "ring_radius = 0.09\n[mounts.forearm]\nring_radius = 0.07\n"
    )
    scene = read_scene(tmp_path / "scene.toml")
    assert Space(scene, sensors=40).radii == {"upper_arm": 0.09, "forearm": 0.07, "tool": 0.09}
    assert [r.radius for r in ring_layout(scene, 1, 4).rings] == [0.09, 0.07, 0.09]
    assert reread(scene).mounts == scene.mounts
    real = replace(scene, occlusion="shadow", ring_radius=None)
    # meant, and not raised as the others are
    assert Space(real, sensors=40).radii["forearm"] == 0.07
    assert Space(real, sensors=40).radii["upper_arm"] == 0.08


def test_a_refusal_names_the_scenes_file(run, tmp_path):
    (tmp_path / "cell.toml").write_text('occlusion = "shadow"\nring_radius = 0.06\n')
    for asked in (("--sensors", "40"), ("--reach", "50")):
        code, _, err = run("--scene", "cell.toml", *asked)
        assert (code, err.count("\n")) == (2, 1)
        assert all(part in err for part in ("cell.toml: ring_radius: 0.06 m", "upper_arm"))
        assert not list((tmp_path / "place-rings-out").glob("*"))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[rules]\nmount = 'glued'", "rules.mount: found"),
        ("[rules]\nclearance = -1", "rules.clearance: found -1"),
    ],
)
def test_wrong_keys_are_one_line(tmp_path, text, says):
    path = tmp_path / "scene.toml"
    path.write_text(text)
    with pytest.raises(UserError, match=f"scene.toml: {says}"):
        read_scene(path)


def test_a_real_mount_is_read_back_from_its_file():
    rules = Rules(mount="real", standoff=0.02, clearance=0.003, spacing=0.01)
    for scene in (
        Scene.paper(rules=rules),
        Scene.paper(rules=rules, ring_radius=0.12),
        Scene.paper(),
    ):
        again = reread(scene)
        assert (again.rules, again.ring_radius) == (
            scene.rules,
            scene.ring_radius,
        )
    assert forward(UR10.chain, Scene.paper().poses[0].q).ndim == 3


@pytest.mark.parametrize("position", [0.0, 0.5, 1.0])
def test_a_position_on_a_mount_without_length_hides_nothing(position):
    at = forward(UR10.chain, Scene.paper().poses[0].q)[-1, :3, 3]
    wall = Obstacle("wall", box(at, (0.01, 0.5, 0.01)))
    clear, ring = (
        MountClearance(Scene(occlusion="shadow", obstacles=(wall,))),
        Ring("tool", position, 8),
    )
    assert clear.within(ring)
    assert any("wall" in f.text for f in alone(clear, 0, ring))


@cache
def folded(**limits: Limits) -> Space:
    """Two rings on a UR5 whose elbow folds until they may meet."""
    robot = ROBOTS["ur5"]
    poses = tuple(Pose(robot.rest + math.radians(a) * np.eye(6)[2]) for a in (0, 90))
    scene = Scene(robot=robot, poses=poses, occlusion="shadow", mounts=limits)
    return Space(scene, Setup((Ring("upper_arm", 0.5, 8), Ring("forearm", 0.5, 8))))


@settings(max_examples=6)
@given(drawing.seeds)
def test_only_starts_without_collisions_are_drawn_and_others_moved_apart(seed):
    space, rng = folded(), np.random.default_rng(seed)
    for _ in range(4):
        for c in (_drawn(space, rng), fresh(space, rng)):
            rings = rounded(space.setup(c), space.scene.sensor).rings
            assert space.apart(c) == (not meeting(space.clear, rings))
            moved = feasible(space, c, rng)
            if moved is not None:
                assert (
                    faults(space.scene, rounded(space.setup(moved), space.scene.sensor).rings) == []
                )
                assert np.array_equal(moved.count, c.count)
                # what is good is left as it is
                assert not space.apart(c) or np.array_equal(moved.values, c.values)
        assert space.apart(c)


def test_rings_that_cannot_be_moved_apart_are_refused(monkeypatch):
    monkeypatch.setattr(starts, "_DRAWS", 10)
    narrow = {
        "upper_arm": Limits((0.75, 0.8), (0.0, 0.0)),
        "forearm": Limits((0.38, 0.42), (0.0, 0.0)),
    }
    space, rng = folded(**narrow), np.random.default_rng(0)
    with pytest.raises(InfeasibleError, match=r"ring 0 \(upper_arm.*ring 1 \(forearm.*pose 1"):
        fresh(space, rng)
    drawn = space.setup(_drawn(space, rng)).rings
    held = replace(space.scene, rules=Rules(fixed=drawn), mounts={})
    fixed = Space(held, sensors=drawn[0].count + drawn[1].count + 8)
    assert fresh(fixed, rng)  # fixed rings are there, whatever they do


@settings(max_examples=5)
@given(
    name=st.sampled_from(["ur5e", "panda", "iiwa14"]),
    gap=st.floats(1e-4, 0.006),
    along=st.floats(0.2, 0.8),
    turn=st.floats(0.0, 6.2),
)
def test_within_the_bore_only_the_own_tube_is_exempt(name, gap, along, turn):
    """A ball of another body, ``gap`` m inside of the bore, keeps a ring away that is nearer to it
    than the clearance; the tube is nearer, and does not."""
    bare = Scene(robot=ROBOTS[name], poses=(Pose(ROBOTS[name].rest),), occlusion="shadow")
    mount, least = bare.robot.mount("forearm"), bare.smallest_radius("forearm")
    ring = Ring("forearm", along, 3, radius=max(least, 0.08))
    bore, axes = envelope(bare, ring).bore, axes_of(mount)
    aside = np.cos(turn) * axes[1] + np.sin(turn) * axes[2]
    centre = mount.start + along * mount.length * mount.axis + (bore - 0.002 - gap) * aside
    cable = Body("cable", mount.frame, Capsules(centre, centre, 0.002))
    scene = replace(bare, robot=replace(bare.robot, bodies=(*bare.robot.bodies, cable)))
    assert tube_of(scene.robot, mount) == tube_of(bare.robot, mount)
    if abs(gap - scene.rules.clearance) > 1e-4:
        assert ("cable" in MountClearance(scene).within(ring)) == (gap < scene.rules.clearance)


@given(
    tilts=st.lists(st.sampled_from([0.0, 0.1, -0.1, 0.3]), min_size=1, max_size=3),
    shared=st.sampled_from([0.0, 0.1, 0.2]),
)
def test_fixed_rings_with_another_tilt_than_the_shared_one_are_named(tilts, shared):
    fixed = tuple(Ring("forearm", 0.1 + 0.2 * i, 3, tilt) for i, tilt in enumerate(tilts))
    own = Ring("upper_arm", 0.5, 3, shared)
    scene = replace(Scene.paper(), rules=Rules(mount="free", shared_tilt=True, fixed=fixed))
    named = otherwise_tilted(scene, (own, *fixed))
    assert named == [1 + i for i, tilt in enumerate(tilts) if abs(tilt) != shared]
    line = shared_tilt_line(scene, Setup((own, *fixed)))
    assert (line is None) == (named == [])
    assert all(f"ring {i} " in (line or "") for i in named)
    free = replace(scene, rules=replace(scene.rules, shared_tilt=False))
    assert otherwise_tilted(free, (own, *fixed)) == []
