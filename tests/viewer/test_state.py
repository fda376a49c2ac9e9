"""The viewer's parts without a browser: names and undo, the fitted camera, cuts, links, one
sensor's report, handles and the curve over poses.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.rings.rounding import rounded
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.coverage.targets.named import Shell
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.viewer import playback
from place_rings.viewer.browser import read_answer
from place_rings.viewer.camera import FOV, VIEWS, fitted
from place_rings.viewer.drawing import Drawing
from place_rings.viewer.drawn_parts import BEHIND, CUTS, NONE, DrawnParts, cut_of
from place_rings.viewer.edited_setup import MOST_RINGS, EditedSetup
from place_rings.viewer.link_state import LinkState, read_query, ring_values
from place_rings.viewer.page_state import History, PageState, Version
from place_rings.viewer.playback import Player, curve_data, pose_axis
from place_rings.viewer.quick_estimate import REPORTED, QuickEstimate, nearest_sensor, sensor_report
from place_rings.viewer.ring_handles import dragged_phase, dragged_position, mount_frame

from ..support import drawing
from ..support.browser import until

NEAR, FAR = Shell(0.5), Shell(1.5)
SMALL = rounded(Setup((Ring("upper_arm", 0.7, 6, 0.5), Ring("forearm", 0.4, 5, -0.3))), Sensor())


def version(k: int) -> Setup:
    """Setups that differ."""
    return Setup((Ring("forearm", 0.5, k),))


def test_a_setup_is_named_for_what_it_is():
    history = History(Version(version(1), "mine"))
    history.edit(version(2))
    assert history.now.name == "mine, edited"
    history.searched(version(3))
    assert history.now.name == "search result from mine"
    history.edit(version(4))
    history.edit(version(5))
    assert history.now.name == "search result from mine, edited"
    history.saved(version(4), "other")  # another version than the present one
    assert history.now.name == "search result from mine, edited"
    history.saved(version(5), "saved")
    assert history.now.name == "saved"
    history.edit(version(1))
    assert history.now.name == "mine"


steps = st.lists(st.one_of(st.integers(1, 9), st.sampled_from(["undo", "redo"])), max_size=30)


@given(steps)
def test_undo_and_redo_walk_along_the_versions(steps):
    """An independent list of versions with a place in it."""
    history, past, at = History(Version(version(1), "mine")), [version(1)], 0
    for step in steps:
        if step == "undo":
            history.undo()
            at = max(at - 1, 0)
        elif step == "redo":
            history.redo()
            at = min(at + 1, len(past) - 1)
        else:
            history.edit(version(step))
            if version(step) != past[at]:
                past, at = [*past[: at + 1], version(step)], at + 1
        assert history.now.setup == past[at]
        assert (history.undoable, history.redoable) == (at > 0, at < len(past) - 1)


def test_one_movement_of_a_slider_is_one_step():
    now = [0.0]
    history = History(Version(version(1), "mine"), lambda: now[0])
    for k in (2, 3, 4):
        now[0] += 0.1
        history.edit(version(k), "tilt")
    history.edit(version(5), "phase")
    now[0] += 10.0
    history.edit(version(6), "phase")
    history.undo()
    assert history.now.setup == version(5)
    history.undo()
    assert history.now.setup == version(4)
    history.undo()
    assert history.now.setup == version(1)


@given(
    points=st.lists(st.tuples(*[st.floats(-2, 2)] * 3), min_size=1, max_size=20),
    view=st.sampled_from(sorted(VIEWS)),
    aspect=st.floats(0.2, 4.0),
)
def test_a_fitted_camera_sees_all_points_and_touches_the_windows_edge(points, view, aspect):
    cloud = np.array(points)
    eye, middle = fitted(cloud, VIEWS[view], aspect)
    toward = VIEWS[view] / np.linalg.norm(VIEWS[view])
    assert np.allclose(np.cross(eye - middle, toward), 0, atol=1e-6)
    right = np.cross([0, 0, 1], toward)
    right /= np.linalg.norm(right)
    depth = (eye - cloud) @ toward
    assert depth.min() > 0.04
    x, y = (cloud - eye) @ right, (cloud - eye) @ np.cross(toward, right)
    slope = math.tan(FOV / 2)
    fill = max(np.abs(x / depth).max() / (slope * aspect), np.abs(y / depth).max() / slope)
    assert fill < 1 / 1.05
    across, up = cloud @ right, cloud @ np.cross(toward, right)
    if max(np.ptp(across), np.ptp(up)) > 1 and np.ptp(cloud @ toward) < 1:
        assert fill > 0.3


@pytest.mark.parametrize("kind", CUTS)
def test_a_cut_keeps_the_far_side(kind):
    scene = Scene()
    glance = QuickEstimate(scene, [NEAR])
    drawn = Drawing(glance)
    curve = drawn.curve(0)
    cut = cut_of(kind, 0.1, np.array([0.6, -1.0, 0.3]), curve)
    choice = DrawnParts(0, NEAR, "ignore", cut=cut)
    dots, shares = drawn.points(SMALL, choice)
    every, same = drawn.points(SMALL, replace(choice, cut=None))
    assert shares == same  # what is cut away counts
    kept = np.concatenate([d.points for d in dots.values()])
    number = sum(len(d.points) for d in every.values())
    if kind == NONE:
        assert len(kept) == number
        return
    assert 0.1 * number < len(kept) < 0.9 * number
    along = kept @ np.array(cut.normal)
    assert along.max() <= cut.offset
    if kind == BEHIND:  # on the camera's side of the points stands the robot
        assert abs(np.median(curve @ np.array(cut.normal)) - cut.offset) < 0.15
    else:
        assert np.allclose(abs(cut.offset), 0.1)
    with pytest.raises(ValueError, match="cut: found"):
        cut_of(kind, math.nan, np.array([1.0, 0, 0]), curve)


@given(seed=drawing.seeds)
def test_a_link_opens_the_state_that_it_was_made_from(seed):
    from urllib.parse import parse_qsl

    scene = Scene.paper()
    setup = rounded(drawing.setup(np.random.default_rng(seed)), scene.sensor)
    targets = {str(t): t for t in (NEAR, FAR)}
    state = PageState.of(scene, targets, {"small": SMALL})
    assert state.link().query() == ""
    state.replaced(Version(setup, "drawn"))
    state.choose(target=FAR, occlusion="blind")
    state.dark = True
    other = PageState.of(scene, targets, {"small": SMALL})
    other.open(read_query(dict(parse_qsl(state.link().query()))))
    assert (other.choice.target, other.choice.occlusion, other.dark) == (FAR, "blind", True)
    for a, b in zip(other.setups[0].rings, setup.rings, strict=True):
        assert (a.link, a.count) == (b.link, b.count)
        movable = scene.robot.mount(b.link).length > 0
        assert a.position == pytest.approx(b.position if movable else 0.0, abs=1e-6)
        assert math.degrees(a.tilt) == pytest.approx(math.degrees(b.tilt), abs=1e-3)
    assert ring_values(other.setups[0])[0].link == setup.rings[0].link


@pytest.mark.parametrize(
    "query",
    [
        {"pose": "x"},
        {"pose": "99"},
        {"target": "<img>"},
        {"occlusion": "none"},
        {"rings": "upper_arm,0.5"},
        {"rings": "no such link,0.5,8,0,0"},
        {"rings": "forearm,nan,8,0,0"},
        {"rings": ";"},
        {"rings": "forearm,0.5,8,0,0;" * (MOST_RINGS + 1)},
    ],
)
def test_a_link_to_nothing_changes_nothing(query):
    state = PageState.of(Scene.paper(), {str(NEAR): NEAR}, {"small": SMALL})
    with pytest.raises(ValueError, match=r"link|rings"):
        state.open(read_query(query))
    assert state.setups == [SMALL]
    assert state.link() == LinkState()


@given(st.one_of(st.none(), st.text(max_size=50)))
def test_any_answer_of_a_browser_can_be_read(answer):
    query, dark = read_answer(answer)
    assert isinstance(query, dict)
    assert isinstance(dark, bool)


def test_the_address_and_the_preferred_theme_are_read():
    answer = '{"address": "http://127.0.0.1:80/?pose=3&rings=a,1,2,3,4", "dark": true}'
    assert read_answer(answer) == ({"pose": "3", "rings": "a,1,2,3,4"}, True)


@pytest.mark.parametrize("occlusion", ["ignore", "shadow", "blind"])
def test_the_sensors_reports_add_up(occlusion):
    """What single sensors alone cover is what exactly one covers; and bodies block the rest."""
    scene = Scene(occlusion=occlusion)
    steep = rounded(Setup((SMALL.rings[0], Ring("forearm", 0.4, 5, -1.3))), Sensor())
    glance = QuickEstimate(scene, [NEAR])
    reports = [
        sensor_report(glance, steep, NEAR, 0, occlusion, i, k)
        for i, ring in enumerate(steep.rings)
        for k in range(ring.count)
    ]
    verdict = glance.verdict(steep, NEAR, 0, occlusion, REPORTED)
    assert sum(r.alone for r in reports) == pytest.approx(float(np.mean(verdict.seen == 1)))
    assert sum(r.covered for r in reports) == pytest.approx(float(verdict.seen.mean()))
    assert sum(r.covered + r.blocked for r in reports) == pytest.approx(float(verdict.held.mean()))
    names = {body.name for body in scene.robot.bodies}
    for report in reports:
        assert {name for name, _ in report.blockers} <= names
        behind = [share for _, share in report.blockers]
        assert behind == sorted(behind, reverse=True)
        assert (max(behind, default=0) <= report.blocked <= sum(behind) + 1e-12) or not behind
        assert bool(behind) == (report.blocked > 0)
    assert (sum(r.blocked for r in reports) > 0) == (occlusion != "ignore")
    with pytest.raises(IndexError, match="no sensor 6"):
        sensor_report(glance, SMALL, NEAR, 0, occlusion, 0, 6)


@given(seed=drawing.seeds)
def test_a_click_chooses_the_sensor_in_front(seed):
    rng = np.random.default_rng(seed)
    apexes = rng.normal(size=(12, 3))
    k, origin = int(rng.integers(12)), rng.normal(size=3) * 5
    away = apexes - origin
    direction = away[k] / np.linalg.norm(away[k])
    behind = np.vstack([apexes, origin + 3 * away[k]])  # exactly behind it
    assert nearest_sensor(behind, origin, direction) == k


@given(at=st.floats(0, 1), phase=st.floats(0, 6.28), link=st.sampled_from(["upper_arm", "forearm"]))
def test_handles_read_back_where_a_ring_is(at, phase, link):
    scene = Scene.paper()
    q, ring = scene.poses[0].q, Ring(link, at, 4, 0.0, phase)
    T, there = (mount_frame(scene.robot, q, ring, p) for p in (0.0, at))
    length = scene.robot.mount(link).length
    aside = there[:3, 3] + 0.3 * there[:3, 0]  # only the way along the axis matters
    assert dragged_position(T, length, aside) == pytest.approx(at, abs=1e-9)
    c, s = math.cos(phase), math.sin(phase)
    turned = there[:3, :3] @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    assert math.cos(dragged_phase(T, turned) - phase) == pytest.approx(1)
    moved = EditedSetup(scene, Setup((ring,))).changed(0, position=at).setup.rings[0]
    assert moved.position == pytest.approx(at, abs=1e-6)


def test_a_player_shows_each_pose_and_stops_at_the_last(monkeypatch):
    monkeypatch.setattr(playback, "_WHOLE", 0.3)
    monkeypatch.setattr(playback, "_PERIOD", 0.01)
    shown, states = [], []
    player = Player(14, shown.append, states.append)
    player._run(1, player._stop)  # in this thread
    assert shown == [*range(1, 14)]
    assert states == [True, False]
    player.toggle(13)  # at the end: from the first
    until(lambda: len(shown) > 13, "it does not play")
    assert shown[13] == 0
    player.toggle(0)
    until(lambda: states[-1] is False, "it does not stop")
    assert len(shown) < 26


def test_the_curve_passes_through_the_representative_poses():
    q = Scene.paper().poses[0].q
    timed = tuple(Pose(q, time_s=0.5 * i) for i in range(5))
    axis, name = pose_axis(timed)
    assert name == "time, s"
    assert pose_axis(tuple(Pose(q) for _ in range(3)))[1] == "pose"
    at, now, then, here = curve_data({0: 0.2, 4: 0.4}, {0: 0.1, 4: 0.1}, axis, 2)
    assert list(at) == [0.0, 1.0, 2.0]
    assert now == pytest.approx([20, 30, 40])
    assert then == pytest.approx([10, 10, 10])
    assert np.isnan(here).sum() == 2
    assert here[1] == pytest.approx(30)
