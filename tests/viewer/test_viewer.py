"""The viewer without a browser: what is shown agrees with exact counts, edits keep a file's form,
work never makes worse.
"""

import threading
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.definitions.errors import UserError
from place_rings.coverage.occlusion.occlusion_mode import OCCLUSIONS
from place_rings.coverage.rings.ring import Ring, Setup, named_setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.rings.rounding import rounded
from place_rings.coverage.robots.built_in import robot
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.link_bodies import robot_capsules
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.coverage.targets.named import (
    Near,
    ProtectiveVolume,
    ReachAndToolSpheres,
    Shell,
    ToolSphere,
)
from place_rings.coverage.targets.own import Box
from place_rings.formats.loader import read_proposal
from place_rings.formats.robots.urdf_options import UrdfOptions
from place_rings.objectives.feasibility.violations import faults, mount_faults
from place_rings.objectives.occlusion import setup_sight
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import Verifier
from place_rings.placement.search.schedule import Round
from place_rings.viewer import html as words
from place_rings.viewer import tasks
from place_rings.viewer.colours import KINDS, WARNING, rgb
from place_rings.viewer.drawing import Dots, Drawing, DrawnMesh, Edges
from place_rings.viewer.drawn_parts import DrawnParts
from place_rings.viewer.edited_setup import MOST_SENSORS, STEEPEST_DEG, EditedSetup
from place_rings.viewer.long_task import Job, JobStoppedError
from place_rings.viewer.page_tasks import file_named, save
from place_rings.viewer.quick_estimate import (
    ONCE,
    SHADOWED,
    SHOWN,
    UNSEEN,
    QuickEstimate,
    SensorReport,
)
from place_rings.viewer.session import ViewerSession, shown_targets
from place_rings.viewer.tasks import prove, search_from
from place_rings.viewer.triangle_meshes import bodies, read_skin

from ..support import drawing

NEAR, FAR = Shell(0.5), Shell(1.5)
SMALL = rounded(
    Setup((Ring("upper_arm", 0.7, 6, 0.5), Ring("forearm", 0.4, 5, -0.3), Ring("tool", 0.0, 4))),
    Sensor(),
)
HOSTILE = "<img src=x onerror=alert(1)>{alert(1)}'\""


@settings(max_examples=8)
@given(
    seed=drawing.seeds,
    occlusion=st.sampled_from(OCCLUSIONS),
    target=st.sampled_from([NEAR, FAR, ReachAndToolSpheres()]),
)
def test_verdicts_ring_by_ring_are_those_of_each_sensor_of_the_whole_setup(seed, occlusion, target):
    setup = drawing.setup(np.random.default_rng(seed))
    square = replace(setup.rings[0], sensor=Sensor(0.4, 0.8, fov_up=0.2, zones=4))
    setup, scene = Setup((*setup.rings, square)), Scene(occlusion=occlusion)
    glance = QuickEstimate(scene, [target], points=300)
    points, verdict = (
        glance.points(target, 0, 300),
        glance.verdict(setup, target, 0, occlusion, 300),
    )
    q = scene.poses[0].q
    seen, held = setup_sight(scene, setup, q), sensor_cones(scene.robot, setup, q)
    assert np.array_equal(
        verdict.seen, sum((seen.part(points, k) <= 0).astype(int) for k in range(setup.sensors))
    )
    assert np.array_equal(
        verdict.held, sum((held.part(points, k) <= 0).astype(int) for k in range(setup.sensors))
    )
    for kind, is_so in zip(
        range(4),
        (
            verdict.held == 0,
            (verdict.held > 0) & (verdict.seen == 0),
            verdict.seen == 1,
            verdict.seen > 1,
        ),
        strict=True,
    ):
        assert np.array_equal(verdict.kind == kind, is_so)


@pytest.mark.parametrize("occlusion", OCCLUSIONS)
def test_a_glance_is_the_exact_count_within_the_luck_of_its_points(occlusion):
    scene = Scene(occlusion=occlusion)
    glance, verifier = QuickEstimate(scene, [NEAR]), Verifier(scene, 0.02)
    for setup in (SMALL, EditedSetup(scene, SMALL).changed(0, tilt_deg=-40, count=9).setup):
        exact = verifier.verify(setup, NEAR).zeta
        assert abs(glance.zeta(setup, NEAR, occlusion) - exact) < 4 * np.sqrt(
            exact * (1 - exact) / glance.each
        )


def test_over_poses_a_glance_is_the_weighted_mean_and_few_stand_for_many():
    home = Scene.paper().poses[0].q
    poses = tuple(Pose(home + 0.02 * i, 1.0 + i) for i in range(3))
    glance = QuickEstimate(Scene.paper(poses=poses), [NEAR], points=3000)
    each = [glance.verdict(SMALL, NEAR, p, "ignore", glance.each).zeta for p in range(3)]
    assert glance.zeta(SMALL, NEAR, "ignore") == pytest.approx(np.average(each, weights=[1, 2, 3]))
    many = QuickEstimate(
        Scene.paper(poses=tuple(Pose(home, 1.0) for _ in range(500))), [NEAR], points=3000
    )
    assert many.few <= 64
    assert many.weights.sum() == pytest.approx(1)


edits = st.fixed_dictionaries(
    {},
    optional={
        "link": st.sampled_from(["upper_arm", "forearm", "tool"]),
        "position": st.floats(-5, 5),
        "tilt_deg": st.floats(-500, 500),
        "phase_deg": st.floats(-1e4, 1e4),
        "count": st.integers(-5, 5000),
    },
)


@given(seed=drawing.seeds, i=st.integers(0, 2), edit=edits)
def test_an_edit_stays_in_bounds_leaves_the_others_and_is_what_a_file_would_hold(seed, i, edit):
    setup = drawing.setup(np.random.default_rng(seed))
    scene = Scene.paper()
    before = EditedSetup(scene, rounded(setup, scene.sensor))
    i %= len(setup.rings)
    after = before.changed(i, **edit).setup
    ring = after.rings[i]
    assert rounded(after, scene.sensor) == after
    assert [r for k, r in enumerate(after.rings) if k != i] == [
        r for k, r in enumerate(before.setup.rings) if k != i
    ]
    assert 0 <= ring.position <= (scene.robot.mount(ring.link).length > 0)
    assert 1 <= ring.count <= MOST_SENSORS
    assert "tilt_deg" not in edit or abs(np.degrees(ring.tilt)) <= STEEPEST_DEG + 1e-9
    assert "link" not in edit or ring.link == edit["link"]


@pytest.mark.parametrize(
    "edit", [{"link": HOSTILE}, {"position": float("nan")}, {"tilt_deg": float("inf")}]
)
def test_an_edit_that_means_nothing_is_refused(edit):
    with pytest.raises(ValueError, match=r"finite|no link"):
        EditedSetup(Scene.paper(), SMALL).changed(0, **edit)


def test_rings_are_added_in_the_widest_gap_and_taken_away():
    draft = EditedSetup(Scene.paper(), SMALL).added("upper_arm")
    assert draft.setup.rings[-1].position == pytest.approx(0.35)
    assert draft.removed(3).setup == rounded(SMALL, Scene.paper().sensor)
    with pytest.raises(ValueError, match="one ring only"):
        draft.added("tool")
    with pytest.raises(ValueError, match="last ring"):
        EditedSetup(Scene.paper(), Setup(SMALL.rings[:1])).removed(0)


def test_what_is_drawn_is_sound_and_what_stays_is_the_same_array():
    scene = Scene.paper()
    drawn = Drawing(QuickEstimate(scene, [NEAR, ReachAndToolSpheres()]))
    choice = DrawnParts(0, NEAR, "shadow", cones="all", kinds=frozenset(range(4)))
    moved = EditedSetup(scene, SMALL).changed(1, tilt_deg=10).setup
    dots, shares = drawn.points(SMALL, choice)
    before = {**drawn.backdrop(choice), **drawn.rings(SMALL, choice), **dots}
    after = {**drawn.backdrop(choice), **drawn.rings(moved, choice)}
    for item in before.values():
        rgb(item.colour)
        if isinstance(item, DrawnMesh):
            assert np.isfinite(item.vertices).all()
            assert item.faces.min() >= 0
            assert item.faces.max() < len(item.vertices)
    assert before["ring0"].vertices is after["ring0"].vertices
    assert before["robot"].vertices is after["robot"].vertices
    assert before["cones1"].vertices is not after["cones1"].vertices
    assert sum(len(d.points) for d in dots.values() if isinstance(d, Dots)) == SHOWN
    assert sum(shares) == pytest.approx(1)
    wide, sizes = (
        np.linalg.norm(np.ptp(drawn.box(choice), axis=0)),
        {c: d.size for d in dots.values() for c in [d.colour]},
    )
    missed = sum(len(dots[f"points{n}"].points) / SHOWN for n in (UNSEEN, SHADOWED))
    assert missed > 0.8  # and yet the robot and what is seen stand out
    assert missed * (sizes[KINDS[UNSEEN].colour] / wide) ** 2 == pytest.approx(
        0.15 * KINDS[UNSEEN].size ** 2
    )
    assert sizes[KINDS[UNSEEN].colour] == sizes[KINDS[SHADOWED].colour] < sizes[KINDS[ONCE].colour]
    # side by side, points are equally large
    better = drawn.points(named_setup("n3_16_55"), choice, [SMALL])[0]
    assert {n: better[n].size for n in dots} == {n: dots[n].size for n in dots}
    assert drawn.points(named_setup("n3_16_55"), choice)[0]["points0"].size > dots["points0"].size
    assert {name for name in before if name.startswith("cones")} == {"cones0", "cones1", "cones2"}
    assert not any(n.startswith("cones") for n in drawn.rings(SMALL, replace(choice, cones="off")))
    link = drawn.rings(SMALL, replace(choice, cones="this link", ring=1))
    assert {n for n in link if n.startswith("cones")} == {"cones1"}


@pytest.mark.parametrize("target", [NEAR, ReachAndToolSpheres(), ProtectiveVolume(), Near(0.3)])
def test_an_outline_lies_on_its_target_and_rims_on_their_cones(target):
    scene = Scene.paper(
        poses=(replace(Scene.paper().poses[0], rate=np.full(6, 0.3)),), targets=(target,)
    )
    drawn, choice = (
        Drawing(QuickEstimate(scene, [target])),
        DrawnParts(0, target, "ignore", cones="all"),
    )
    edges = drawn.backdrop(choice)["outline"]
    assert isinstance(edges, Edges)
    outer = scene.solid(target, 0).a
    on = outer(edges.ends.reshape(-1, 3))
    assert on.max() < 1e-6  # no line is outside, and the least of them lies on the surface
    assert np.median(np.abs(on)) < (0.02 if target.name == "V_S" else 0.5)
    cones = sensor_cones(scene.robot, Setup(SMALL.rings[:1]), scene.poses[0].q)
    rims = drawn.rings(SMALL, choice)["rims0"].ends.reshape(6, -1, 3)
    for k in range(6):
        v = rims[k] - cones.apex[k]
        angle = np.arccos(v @ cones.axis[k] / np.linalg.norm(v, axis=1))
        assert np.allclose(angle, cones.half_angle[k])


def test_bodies_are_drawn_where_the_capsules_are():
    ur10 = Scene.paper().robot
    frames = forward(ur10.chain, Scene.paper().poses[0].q)
    vertices, faces = bodies(ur10, frames)
    found = robot_capsules(ur10, frames)
    t = np.clip(
        ((vertices[:, None] - found.start) * (v := found.end - found.start)).sum(-1)
        / (v * v).sum(-1),
        0,
        1,
    )
    gap = np.linalg.norm(vertices[:, None] - found.start - t[..., None] * v, axis=-1) - found.radius
    assert np.abs(gap).min(axis=1).max() < 1e-6
    assert len(faces) > 1000


def test_nothing_of_a_file_stands_unescaped_on_the_page():
    scene = Scene.paper()
    proofs = prove(scene, SMALL, (NEAR,), lambda *_: None, voxel=0.1, width=0.3)
    said = [
        words.heading([HOSTILE], HOSTILE, [3], [1]),
        words.zeta_table(
            [HOSTILE, HOSTILE],
            [words.TableRow(HOSTILE, ((0.1, 0.2), (0.3, 0.4)))],
            HOSTILE,
            HOSTILE,
        ),
        words.headline(0.5, HOSTILE, HOSTILE, HOSTILE),
        words.sensor_text(SensorReport(0, 1, 0.1, 0.1, 0.1, ((HOSTILE, 0.1),)), HOSTILE),
        words.link(f"?target={HOSTILE}"),
        words.legend([0.25] * 4, HOSTILE, HOSTILE),
        words.proof_table(HOSTILE, proofs),
        words.note(HOSTILE, True),
    ]
    for text in said:
        assert "<img" not in text
        assert "&lt;img" in text


def test_a_proof_holds_its_count():
    told = []
    (proof,) = prove(
        Scene.paper(), SMALL, (NEAR,), lambda what, over: told.append(over), voxel=0.02, width=0.03
    )
    assert proof.certified.low - 0.002 <= proof.counted.zeta <= proof.certified.high + 0.002
    assert proof.certified.high - proof.certified.low <= 0.03
    assert all(0 <= over < 1 for over in told)

    def stop(what: str, over: float) -> None:
        raise JobStoppedError

    with pytest.raises(JobStoppedError):
        prove(Scene.paper(), SMALL, (NEAR,), stop)


QUICK = (Round(512, 2, 1, 4, 0.2, 4, 1),)


@pytest.mark.parametrize("start", [SMALL, named_setup("n1_8_0")])
def test_a_search_from_here_is_never_for_worse(start):
    scene = Scene.paper()
    found = search_from(scene, start, lambda *_: None, lambda: False, schedule=QUICK, voxel=0.04)
    verifier = Verifier(scene, 0.04)
    before, after = (verifier.judge(rounded(s, scene.sensor))[1] for s in (start, found.setup))
    assert (found.before, found.after) == (pytest.approx(before), pytest.approx(after))
    assert after > before if found.better else found.setup == rounded(start, scene.sensor)
    assert [(r.link, r.count) for r in sorted(found.setup.rings, key=str)] == [
        (r.link, r.count) for r in sorted(start.rings, key=str)
    ]


def test_a_search_for_one_target_keeps_what_the_scene_demands_of_it(monkeypatch):
    box = Box((0.1, 0.1, 0.1), (0.5, -0.5, 0.5), largest_gap=0.05)
    scene, searched = Scene.paper(targets=(box, Shell(0.2, weight=2.0))), []

    def search(space, *_):
        searched.append(space.scene.targets)
        raise JobStoppedError

    monkeypatch.setattr(tasks, "search", search)
    for target in (box.target, Shell(0.3)):
        with pytest.raises(JobStoppedError):
            search_from(scene, SMALL, lambda *_: None, lambda: False, target, voxel=0.1)
    assert searched == [(box,), (Shell(0.3),)]


def test_a_stopped_search_gives_what_was_there():
    found = search_from(
        Scene.paper(), SMALL, lambda *_: None, lambda: True, schedule=QUICK, voxel=0.1
    )
    assert (found.setup, found.better) == (rounded(SMALL, Scene.paper().sensor), False)


def test_jobs_take_turns_and_stop():
    turn, order, go = threading.Lock(), [], threading.Event()

    def work(name):
        def run(job: Job) -> None:
            order.append(f"{name} begins")
            while not go.wait(0.01):
                job.tell("", 0.5)
            order.append(f"{name} ends")

        return run

    one = Job(work("one"), turn, lambda *_: None)
    two, three = (Job(work(n), turn, lambda *_: None) for n in ("two", "three"))
    three.stop()
    three.join(10)
    assert not three.running  # it stopped while it waited
    go.set()
    for job in (one, two):
        job.join(10)
    first, second = ("one", "two") if order[0] == "one begins" else ("two", "one")
    assert order == [f"{first} begins", f"{first} ends", f"{second} begins", f"{second} ends"]


@pytest.mark.parametrize(
    "name",
    ["", "../up", "a/b", "a\\b", ".hidden", "x" * 65, "a\0b", "nul.toml", "~", HOSTILE, "-rf"],
)
def test_a_name_that_is_more_than_a_name_is_refused(name, tmp_path):
    with pytest.raises(UserError, match="name: found"):
        file_named(tmp_path, name, True)
    assert list(tmp_path.iterdir()) == []


def test_a_proposal_is_saved_in_its_folder_only_and_never_over_an_old_one_unasked(tmp_path):
    with pytest.raises(UserError, match="--out"):
        file_named(None, "mine", False)
    scene = Scene.paper()
    setup = rounded(SMALL, scene.sensor)
    path = file_named(tmp_path, "mine", False)
    save(path, setup, scene, [Verifier(scene, 0.05).verify(setup, NEAR)])
    again, _, file = read_proposal(path)
    assert again == setup
    assert 100 * file.zeta[0].zeta == pytest.approx(
        100 * Verifier(scene, 0.05).verify(again, NEAR).zeta
    )
    with pytest.raises(UserError, match="exists; choose another name, or"):
        file_named(tmp_path, "mine", False)
    assert file_named(tmp_path, "mine", True) == path
    outside = tmp_path.parent / "outside.toml"
    (tmp_path / "link.toml").symlink_to(outside)
    with pytest.raises(UserError, match="no regular file"):
        file_named(tmp_path, "link", True)


def test_a_scene_with_one_target_shows_the_papers_beside_it():
    assert shown_targets(Scene.paper()) == (NEAR, FAR, ReachAndToolSpheres())
    two = (FAR, ToolSphere())
    assert shown_targets(Scene.paper(targets=two)) == (FAR, ToolSphere())


ROOM = ViewerSession(Scene(), {"a": SMALL})


@settings(max_examples=12)
@given(gap=st.floats(0.0, 0.3), tilt=st.floats(-1.2, 1.2), seed=drawing.seeds)
def test_rings_that_cannot_be_built_are_red_and_the_reasons_are_those_of_verify(gap, tilt, seed):
    """Rings too near to each other, off the robot's links, through its bodies, of any tilt."""
    scene = ROOM.scene
    radius = scene.radius_of("forearm")
    pair = (Ring("forearm", p, 4, t, 0.0, radius) for p, t in ((0.4, 0.2), (0.4 + gap, tilt)))
    setup = rounded(Setup((*pair, *drawing.setup(np.random.default_rng(seed)).rings)), scene.sensor)
    found = ROOM.broken(setup, "ignore")
    assert {f.text for f in mount_faults(scene, setup)} <= {f.text for f in found}
    assert [f.text for f in found] == [f.text for f in faults(scene, setup.rings)]
    bad = frozenset(ring for fault in found for ring in fault.rings)
    items = ROOM.drawing.rings(setup, DrawnParts(0, NEAR, "ignore", faulty=bad))
    red = {i for i in range(len(setup.rings)) if items[f"ring{i}"].colour == WARNING}
    assert red == bad


def test_a_saved_file_states_what_cannot_be_built(tmp_path):
    """Rings 15 mm apart; as good as new without a fault."""
    scene = Scene()
    length, radius = scene.robot.mount("forearm").length, scene.radius_of("forearm")
    places = (0.5, 0.5 + 0.015 / length)
    close = rounded(
        Setup(tuple(Ring("forearm", p, 4, 0.3, 0.0, radius) for p in places)), scene.sensor
    )
    found = ROOM.broken(close, "shadow")
    texts = [fault.text for fault in found]
    assert any(f.rings == (0, 1) and f.rule == "spacing" and "15.0 mm" in f.text for f in found)
    counted = [Verifier(scene, 0.05).verify(close, NEAR)]
    path = tmp_path / "close.toml"
    save(path, close, scene, counted, found)
    (record,) = read_proposal(path)[2].zeta
    assert list(record.mounting) == [f.text for f in mount_faults(scene, close)]
    assert record.unmounted == (0, 1)
    assert all(text in path.read_text() for text in texts)
    assert all(text in words.violations(texts) for text in texts)
    save(path, close, scene, counted)
    assert read_proposal(path)[2].zeta[0].mounting == ()
    assert words.violations([]) == ""


URDF = """<robot name="two"><link name="base"><visual><geometry><box size="0.2 0.2 \
0.1"/></geometry></visual></link>
<joint name="a" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/><origin \
xyz="0 0 0.2"/>
<limit lower="-1" upper="1"/></joint><link name="arm"><visual><origin xyz="0.2 0 0"/><geometry>
<box size="0.4 0.1 0.1"/></geometry></visual></link></robot>"""


def test_a_robots_surface_moves_with_its_joints_and_must_be_that_robots(tmp_path):
    from place_rings.cli.options.urdf_robot import import_urdf

    path = tmp_path / "two.urdf"
    path.write_text(URDF)
    skin = read_skin(path, UrdfOptions(), import_urdf(path).robot)
    low, high = (edge(skin.at(np.array([np.pi / 2]))[0], axis=0) for edge in (np.min, np.max))
    assert np.allclose(low, [-0.1, -0.1, -0.05])
    assert np.allclose(high, [0.1, 0.4, 0.25])
    with pytest.raises(UserError, match="--urdf"):
        read_skin(path, UrdfOptions(), robot("ur10"))
