"""Real mounts: what is drawn or varied keeps clear of all things at all poses; what cannot be is
refused.
"""

import math
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.cli import app as command_line
from place_rings.coverage.occlusion.circle_clearance import blocked, capsule_gap, circle, plane_gap
from place_rings.coverage.rings.ring import Ring, Setup, named_setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.rings.rounding import rounded
from place_rings.coverage.robots.built_in import ROBOTS, UR10
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.link_bodies import robot_capsules
from place_rings.coverage.solids.polyhedra import box
from place_rings.coverage.solids.segments import point_to_segment
from place_rings.formats.errors import UserError
from place_rings.formats.loader import read_scene
from place_rings.formats.schema.scene_models import SceneModel
from place_rings.objectives.feasibility.clearance import MountClearance
from place_rings.objectives.feasibility.mounting import alone, meeting
from place_rings.objectives.feasibility.violations import faults
from place_rings.objectives.occlusion import occluders
from place_rings.objectives.parameterization import segments
from place_rings.objectives.scene import Limits, Obstacle, Pose, Rules, Scene
from place_rings.placement.redesign.problem import RedesignProblem
from place_rings.placement.search.collision_repair import apart
from place_rings.placement.search.design import Space
from place_rings.placement.search.feasible_set import InfeasibleError
from place_rings.placement.search.layout import ring_layout
from place_rings.placement.search.moves import fresh, vary

from . import drawing

TABLE = Obstacle(
    "table",
    box((0.5, 0, 0.3), (0.4, 0.8, 0.05)),
    {"centre": [0.5, 0.0, 0.3], "size": [0.4, 0.8, 0.05]},
)


def drawn_scene(rng: np.random.Generator, obstacles: tuple[Obstacle, ...] = ()) -> Scene:
    """A real mount of any robot, at one to four poses about its own."""
    robot = ROBOTS[str(rng.choice(list(ROBOTS)))]
    poses = [
        robot.rest + rng.normal(0, 0.2, len(robot.rest)) * i for i in range(rng.integers(1, 5))
    ]
    if robot.limits is not None:
        poses = [np.clip(q, robot.limits[:, 0], robot.limits[:, 1]) for q in poses]
    return Scene(
        robot=robot, poses=tuple(Pose(q) for q in poses), occlusion="shadow", obstacles=obstacles
    )


def band(clear: MountClearance, ring: Ring) -> np.ndarray:
    """Points (P, N, 3) of a ring's circles at all poses, base frame; its body is within half its
    thickness of them.
    """
    mount, arm = clear.scene.robot.mount(ring.link), clear.scene.rules.arm
    places = ring.position * mount.length + np.linspace(-arm, arm, 5)
    axes = np.stack([mount.axis, mount.zero, mount.side])
    here = circle(places, ring.radius, 90).reshape(-1, 3) @ axes + mount.start
    T = clear.frames[:, mount.frame]
    return np.einsum("pij,nj->pni", T[:, :3, :3], here) + T[:, None, :3, 3]


@given(drawing.seeds)
def test_a_circle_is_as_far_from_things_as_the_bounds_say(seed):
    rng = np.random.default_rng(seed)
    n, radius = 6, float(rng.uniform(0.03, 0.2))
    start, end, thick = (
        rng.uniform(-0.3, 0.3, (n, 3)),
        rng.uniform(-0.3, 0.3, (n, 3)),
        rng.uniform(0.01, 0.1, n),
    )
    places, which = rng.uniform(-0.3, 0.3, n), np.arange(n)
    points = circle(places, radius, 5040)  # those of the bounds are among them
    low, high = capsule_gap(start, end, thick, radius)(places, which)
    true = point_to_segment(points, start[:, None], end[:, None]).min(axis=1) - thick
    assert np.all(low <= true + 1e-9)
    assert np.all(true <= high + 1e-9)
    near = np.abs(true) < radius / 2
    assert np.all((high - low)[near & (true > 0)] < 3e-3)
    solid = box(rng.uniform(-0.2, 0.2, 3), rng.uniform(0.05, 0.3, 3))
    low, high = plane_gap(solid.normal[None], solid.offset[None], radius)(places, np.zeros(n, int))
    true = solid(points).min(axis=1)
    assert np.all(low <= true + 1e-9)
    assert np.all(true <= high + 1e-9)


def test_what_is_blocked_is_what_is_too_near():
    start, end = np.array([[0.3, 0.0, 0.0]]), np.array([[0.4, 0.0, 0.0]])
    found = blocked(capsule_gap(start, end, np.array([0.15]), 0.1), 1, (0.0, 1.0), 0.005)
    edge = math.sqrt(0.155**2 - 0.1**2)
    assert min(a for a, _, _ in found) == pytest.approx(0.3 - edge, abs=1e-3)
    assert max(b for _, b, _ in found) == pytest.approx(0.4 + edge, abs=1e-3)


@settings(max_examples=6, deadline=None)
@given(drawing.seeds, st.booleans())
def test_all_that_is_drawn_and_varied_is_clear_at_all_poses(seed, cluttered):
    rng = np.random.default_rng(seed)
    scene = drawn_scene(rng, (TABLE,) if cluttered else ())
    try:
        space = Space(scene, sensors=30)
    except InfeasibleError:
        return
    c, half = fresh(space, rng), scene.rules.band[0] / 2
    for _ in range(3):
        low, high = (edge[:, : space.places] for edge in space.box(c))
        ends = replace(c, values=np.where(rng.uniform(size=c.values.shape) < 0.5, low, high))
        for setup in (rounded(space.setup(one), scene.sensor) for one in (c, ends)):
            alone = [f for f in faults(scene, setup.rings, space.clear) if len(f.rings) == 1]
            assert alone == []
            for ring in setup.rings:
                mount, points = scene.robot.mount(ring.link), band(space.clear, ring)
                at = ring.position * mount.length
                if mount.length > 0:
                    assert mount.usable[0] * mount.length <= at - scene.rules.band[1] / 2 + 1e-9
                    assert at + scene.rules.band[1] / 2 <= mount.usable[1] * mount.length + 1e-9
                assert ring.radius >= mount.section + scene.rules.standoff - 1e-9
                bodies = robot_capsules(scene.robot, space.clear.frames)
                gap = (
                    point_to_segment(points[:, :, None], bodies.start[:, None], bodies.end[:, None])
                    - bodies.radius
                )
                assert gap.min() >= half - 1e-6
                assert all(o.body(points).min() >= half - 1e-6 for o in scene.obstacles)
            for pose in scene.poses:
                apex = np.asarray(sensor_cones(scene.robot, setup, pose.q).apex)
                assert np.all(occluders(scene, pose.q).holds(apex)[0] < 0)
        c = vary(space, c, rng)


@pytest.mark.parametrize("name", list(ROBOTS))
def test_every_robot_has_room_for_real_rings_at_its_own_pose(name):
    scene = Scene(robot=ROBOTS[name], poses=(Pose(ROBOTS[name].rest),), occlusion="blind")
    space = Space(scene, ring_layout(scene, 2, 16))
    setup = space.setup(fresh(space, np.random.default_rng(0)))
    assert len(setup.rings) >= 3
    assert [f for f in faults(scene, setup.rings) if len(f.rings) == 1] == []


def test_real_is_what_goes_with_occlusion_unless_something_is_said():
    assert not Scene().real
    assert Scene(occlusion="shadow").real
    assert Scene(occlusion="blind").real
    assert Scene(rules=Rules(mount="real")).real
    assert not Scene(occlusion="shadow", rules=Rules(mount="free")).real
    free = Scene(occlusion="shadow", rules=Rules(mount="free"))
    assert segments(free) == segments(Scene())
    assert Space(free, sensors=40).radii == Space(Scene(), sensors=40).radii


def test_a_tube_beside_the_axis_makes_the_ring_wider():
    scene = Scene(occlusion="shadow")
    assert scene.least_radius("upper_arm") == pytest.approx(0.046 + 0.0547 + 0.012, abs=1e-3)
    assert Space(scene, sensors=40).radii == {"upper_arm": 0.113, "forearm": 0.08, "tool": 0.08}


def test_what_cannot_be_mounted_is_refused_with_the_reason():
    stated = Scene(occlusion="shadow", ring_radius=0.08, radius_stated=True)
    with pytest.raises(
        InfeasibleError, match=r"ring_radius: 0.08 m is too small.*upper_arm needs at least 0.113 m"
    ):
        Space(stated, sensors=40)
    of_link = Scene(
        occlusion="shadow",
        limits={"upper_arm": Limits(radius=0.09), "forearm": Limits(radius=0.07)},
    )
    with pytest.raises(
        InfeasibleError,
        match=r"mounts.upper_arm.ring_radius: 0.09 m is too small.* at least 0.113 m",
    ):
        Space(of_link, sensors=40)
    kept_out = replace(stated, limits={"upper_arm": Limits(keep_out=((0.0, 1.0),))})
    assert "upper_arm" not in {s.link for s in Space(kept_out, sensors=40).segments}
    wall = Obstacle("wall", box((0, 0, 0.5), (4, 4, 2)))
    with pytest.raises(
        InfeasibleError, match=r"rules.mount is real: a ring of radius .* lies in .*wall"
    ):
        Space(Scene(occlusion="shadow", obstacles=(wall,)), sensors=40)
    with pytest.raises(InfeasibleError, match="no room for 1 rings on upper_arm"):
        Space(
            Scene(occlusion="shadow", limits={"upper_arm": Limits((0.0, 0.1))}),
            Setup((Ring("upper_arm", 0.5, 8),)),
        )


def test_the_papers_rings_are_named_where_they_cannot_be_mounted():
    texts = [
        f.text
        for f in faults(Scene(occlusion="shadow"), named_setup("n2_16_25").rings)
        if f.rule == "mount"
    ]
    assert any("sits at 0.000, a ring can be closed from" in t for t in texts)
    assert any("lies in" in t and "elbow" in t for t in texts)
    assert faults(Scene(rules=Rules(mount="free")), named_setup("n2_16_25").rings) == []


def test_rings_of_two_links_that_meet_are_named():
    robot = ROBOTS["ur3e"]
    # the elbow folds
    poses = tuple(Pose(robot.rest + math.radians(a) * np.eye(6)[2]) for a in range(-60, 120, 5))
    scene = Scene(robot=robot, poses=poses, occlusion="shadow")
    rings = (Ring("upper_arm", 0.5, 8, radius=0.2), Ring("forearm", 0.5, 8, radius=0.2))
    assert any(
        "ring 0 (upper_arm) lies in ring 1 (forearm) at pose" in f.text
        for f in faults(scene, rings)
    )
    apart = (rings[0], Ring("tool", 0.0, 8, radius=0.05))
    assert not [
        f for f in faults(replace(scene, poses=(Pose(robot.rest),)), apart) if len(f.rings) == 2
    ]


def test_changes_to_what_is_mounted_stand_where_rings_are_clear():
    scene = Scene(occlusion="shadow")
    work = RedesignProblem(scene, named_setup("n2_16_25"), 1)
    assert {s.link for s in work.segments((0,))} == {"upper_arm", "forearm"}
    assert work.radii["upper_arm"] == 0.113
    for s in work.segments((0, 1, 2, 3)):
        low, high = work.clear.closed(s.link)
        assert low <= s.low <= s.high <= high


def test_a_link_can_have_a_ring_radius_of_its_own(tmp_path):
    (tmp_path / "scene.toml").write_text(
        "ring_radius = 0.09\n[mounts.forearm]\nring_radius = 0.07\n"
    )
    scene = read_scene(tmp_path / "scene.toml")
    assert Space(scene, sensors=40).radii == {"upper_arm": 0.09, "forearm": 0.07, "tool": 0.09}
    assert [r.radius for r in ring_layout(scene, 1, 4).rings] == [0.09, 0.07, 0.09]
    assert SceneModel.from_domain(scene).to_domain().limits == scene.limits
    real = replace(scene, occlusion="shadow", radius_stated=False)
    # meant, and not raised as the others are
    assert Space(real, sensors=40).radii["forearm"] == 0.07
    assert Space(real, sensors=40).radii["upper_arm"] == 0.113


def test_a_refusal_names_the_scenes_file(tmp_path, monkeypatch, capsys):
    (tmp_path / "cell.toml").write_text('occlusion = "shadow"\nring_radius = 0.08\n')
    for asked in (["--sensors", "40"], ["--reach", "50"]):
        monkeypatch.setattr(
            sys, "argv", ["place-rings", "--scene", str(tmp_path / "cell.toml"), *asked]
        )
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr("signal.signal", lambda *_: None)
        with pytest.raises(SystemExit) as stop:
            command_line.main()
        assert stop.value.code == 2
        told = capsys.readouterr().err
        assert "cell.toml: ring_radius: 0.08 m is too small: a real ring on upper_arm" in told
        assert "\n" not in told.strip()
        assert not list((tmp_path / "place-rings-out").glob("*"))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[rules]\nmount = 'glued'", "rules.mount: found"),
        ("[rules]\nring_width = 0.005", "rules.ring_width: found 0.005, allowed: at least 0.01"),
        ("[rules]\nstandoff = 0.001", "rules.standoff: found 0.001, allowed: at least 0.005"),
    ],
)
def test_wrong_keys_are_one_line(tmp_path, text, says):
    path = tmp_path / "scene.toml"
    path.write_text(text)
    with pytest.raises(UserError, match=f"scene.toml: {says}"):
        read_scene(path)


def test_a_real_mount_is_read_back_from_its_file():
    rules = Rules(mount="real", standoff=0.02, band=(0.012, 0.03), spacing=0.01)
    for scene in (
        Scene(rules=rules),
        Scene(rules=rules, ring_radius=0.12, radius_stated=True),
        Scene(),
    ):
        again = SceneModel.from_domain(scene).to_domain()
        assert (again.rules, again.ring_radius, again.radius_stated) == (
            scene.rules,
            scene.ring_radius,
            scene.radius_stated,
        )
    assert Scene(rules=rules).spacing == 0.03
    assert forward(UR10.chain, Scene().poses[0].q).ndim == 3


@pytest.mark.parametrize("position", [0.0, 0.5, 1.0])
def test_a_position_on_a_mount_without_length_hides_nothing(position):
    clear = MountClearance(Scene(occlusion="shadow"))
    assert clear.within("tool", 0.02, position)
    assert any("lies in" in f.text for f in alone(clear, 0, Ring("tool", position, 8, radius=0.02)))


def folded(limits: dict[str, Limits]) -> Space:
    """Two rings on a UR3e whose elbow folds until they may meet."""
    robot = ROBOTS["ur3e"]
    poses = tuple(Pose(robot.rest + math.radians(a) * np.eye(6)[2]) for a in (0, 60))
    scene = Scene(robot=robot, poses=poses, occlusion="shadow", limits=limits)
    return Space(scene, Setup((Ring("upper_arm", 0.5, 8), Ring("forearm", 0.5, 8))))


def test_a_search_moves_rings_that_meet_apart():
    space = folded({})
    rng = np.random.default_rng(0)
    drawn = [fresh(space, rng) for _ in range(12)]
    meet = [c for c in drawn if meeting(space.clear, space.setup(c).rings)]
    clear = [c for c in drawn if not meeting(space.clear, space.setup(c).rings)]
    assert meet
    assert clear
    # what is good is left as it is
    assert all(a is b for a, b in zip(apart(space, drawn, rng), clear, strict=True))
    for c, found in zip(meet[:3], apart(space, meet[:3], rng), strict=True):
        assert not meeting(space.clear, space.setup(found).rings)
        assert faults(space.scene, space.setup(found).rings) == []
        assert np.array_equal(found.values[1:], c.values[1:])
        assert np.array_equal(found.count, c.count)


def test_rings_that_cannot_be_moved_apart_are_refused():
    space = folded({"upper_arm": Limits((0.5, 0.56)), "forearm": Limits((0.3, 0.4))})
    rng = np.random.default_rng(0)
    with pytest.raises(
        InfeasibleError,
        match=r"ring 0 \(upper_arm\) lies in ring 1 \(forearm\) at pose 1, and rings collide",
    ):
        apart(space, [fresh(space, rng)], rng)
    held = replace(space.scene, rules=Rules(fixed=space.setup(fresh(space, rng)).rings))
    fixed = Space(held, sensors=held.rules.fixed[0].count + held.rules.fixed[1].count + 8)
    assert apart(fixed, [fresh(fixed, rng)], rng)  # fixed rings are there, whatever they do
