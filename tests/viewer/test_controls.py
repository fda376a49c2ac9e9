"""The viewer's controls, as a page without a browser presses them: names, undo, links, one sensor,
handles, playing, cuts and themes.
"""

import asyncio
import math
import threading
import time
from contextlib import contextmanager
from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pytest
import viser.transforms
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.viewer import playback, ring_handles
from place_rings.viewer.browser import set_value
from place_rings.viewer.ring_controls import RingControls
from place_rings.viewer.ring_handles import RingHandles, mount_frame
from place_rings.viewer.server import Server
from place_rings.viewer.session import ViewerSession

from ..support.browser import until
from ..support.viser_client import Client, pages_of

SMALL = Setup((Ring("upper_arm", 0.7, 6, 0.5), Ring("forearm", 0.4, 5, -1.2)))
HOME = Scene().poses[0].q
MOTION = Scene(poses=tuple(Pose(HOME + 0.05 * i, time_s=0.5 * i) for i in range(3)))


@pytest.fixture(scope="module")
def served():
    with Server(ViewerSession(MOTION, {"mine": SMALL})) as server:
        yield server


@pytest.fixture
def opened(served):
    with pages_of(served) as opened:
        yield opened


def test_the_view_is_fitted_again_until_the_browser_has_it_and_somebody_moves_it(opened):
    page = opened()

    def report(position, width: int) -> np.ndarray:
        """What view the page is given after its report."""
        page.report(position, width)
        page.read(0.3)
        return np.array(page.eye)

    def moved(position, width: int) -> np.ndarray:
        """The same, where it is another one."""
        before = page.eye
        page.report(position, width)
        page.until(lambda: not np.allclose(page.eye, before), "no other view came")
        return report(position, width)

    old = (3.0, 0.0, 0.0)  # where the browser's camera stood when the page was opened
    page.until(lambda: np.any(page.eye), "no view came")
    page.read(0.3)
    wide = np.array(page.eye)
    narrow = moved(old, 50)  # the window has another shape, and the first view is still to come
    assert np.linalg.norm(narrow) > 1.2 * np.linalg.norm(wide)
    assert np.allclose(moved(narrow, 100), wide)
    assert np.allclose(report(wide, 100), wide)
    assert np.allclose(report(2 * wide, 100), wide)  # somebody moves it: left alone from now on
    assert np.allclose(report(2 * wide, 50), wide)


def test_the_page_is_named_for_what_it_shows(opened):
    page = opened()
    before = page.zeta("V_S(0.5)")
    assert "mine : 11 sensors" in page.words
    page.set("Sensors", 12)
    page.until(lambda: "mine, edited : 17 sensors" in page.words, "an edited setup keeps its name")
    page.until(lambda: any("mine, edited" in s for s in page.scripts), "the title keeps it")
    page.set("Changes", "Undo")
    page.until(lambda: "mine : 11 sensors" in page.words, "an edit cannot be undone")
    page.until(lambda: page.zeta("V_S(0.5)") == before, "undone, but not counted")
    page.set("Changes", "Redo")
    page.until(lambda: "mine, edited : 17 sensors" in page.words, "an edit cannot be redone")
    page.set("Start from", "n1_8_0")
    page.until(lambda: "n1_8_0 : 24 sensors" in page.words, "no preset came")
    assert page.value("Start from") == "…"
    page.set("Changes", "Hop")
    page.until(lambda: "allowed: Undo, Redo" in page.words, "what no button says is taken")
    page.set("As opened", True)
    page.until(lambda: "mine : 11 sensors" in page.words, "it is not as opened")


def test_positions_are_in_mm_along_the_link(opened):
    page = opened()
    length = 1000 * MOTION.robot.mount("upper_arm").length
    assert page.value("Position, mm") == pytest.approx(0.7 * length, abs=0.1)
    page.set("Position, mm", 150.0)
    page.until(lambda: "edited" in page.words, "the ring stays")
    page.set("Ring", "1: forearm")
    far = 1000 * MOTION.robot.mount("forearm").length
    page.until(
        lambda: page.value("Position, mm") == pytest.approx(0.4 * far, abs=0.1), "not its own"
    )
    page.set("Ring", "0: upper_arm")
    page.until(lambda: page.value("Position, mm") == 150.0, "it was moved elsewhere")


def test_a_link_opens_its_state_and_the_page_gives_one(opened):
    page = opened(query="pose=2&occlusion=blind&rings=forearm,0.5,9,10,0", dark=True)
    page.until(lambda: "9 sensors on 1 ring " in page.words, "the link's rings did not come")
    page.until(lambda: page.value("Pose") == 2, "the pose did not come")
    page.until(lambda: page.value("Robot's body") == "blind", "the model did not come")
    page.until(lambda: page.value("Dark") is True, "a dark browser gets a light page")
    page.until(
        lambda: "pose=2&amp;occlusion=blind&amp;rings=forearm,0.5,9,10,0&amp;dark=1" in page.said,
        "the link is another",
    )
    page.set("Dark", False)
    page.until(lambda: "dark=1" not in page.said, "it stays dark")
    wrong = opened(query="rings=<img src=x>")
    wrong.until(lambda: "link: rings: found" in wrong.words, "nothing was said of a broken link")
    assert "<img" not in wrong.said
    assert "mine : 11 sensors" in wrong.words


def test_a_clicked_sensor_says_what_it_does(served, opened):
    page = opened()
    room = served.room
    page.until(lambda: "/setup0/sensors1" in page.drawn, "no sensors are drawn")
    apexes = room.drawing.apexes(room.setups["mine"].rings[1], 0)
    outward = apexes[3] - apexes.mean(axis=0)
    outward /= np.linalg.norm(outward)
    page.click("/setup0/sensors1", apexes[3] + outward, -outward)
    page.until(lambda: "Sensor 3 of ring 1: forearm" in page.words, "the click says nothing")
    assert "no other sensor covers" in page.words
    page.until(lambda: "/setup0/sensor" in page.drawn, "its cone is not drawn")
    page.set("Sensor", "0")
    page.until(lambda: "Sensor 0 of ring 1" in page.words, "the list chooses nothing")
    page.set("Sensors", 4)
    page.set("Sensor", "7")
    page.until(lambda: page.value("Sensor") == "none", "a sensor that does not exist is kept")
    page.until(lambda: "/setup0/sensor" not in page.drawn, "its cone is still drawn")


def dragged_to(position: float, turn_deg: float = 0.0):
    """Where a handle of the first ring is dragged to: its place, m, and orientation."""
    T = mount_frame(MOTION.robot, MOTION.poses[0].q, SMALL.rings[0], position)
    turn = viser.transforms.SO3.from_z_radians(math.radians(turn_deg))
    return T[:3, 3], (viser.transforms.SO3.from_matrix(T[:3, :3]) @ turn).wxyz


def test_handles_drag_the_ring_along_and_around(opened):
    page = opened()
    page.set("Handles", True)
    page.until(lambda: {"/setup0/along", "/setup0/around"} <= page.drawn, "no handles came")
    page.drag("/setup0/along", *dragged_to(0.25))
    length = 1000 * MOTION.robot.mount(SMALL.rings[0].link).length
    page.until(
        lambda: page.value("Position, mm") == pytest.approx(0.25 * length, abs=0.1), "it stays"
    )
    page.drag("/setup0/around", *dragged_to(0.25, 40))
    page.until(lambda: page.value("Phase, °") == pytest.approx(40, abs=0.1), "it does not turn")
    page.drag("/setup0/around", dragged_to(0.25)[0], [math.nan] * 4)
    page.set("Handles", False)
    page.until(lambda: "/setup0/along" not in page.drawn, "the handles stay")
    assert page.value("Phase, °") == pytest.approx(40, abs=0.1)


class LateHandle:
    """A handle that the user drags to a place while the page puts it where the ring is."""

    __class__ = viser.TransformControlsHandle

    def __init__(self, place):
        self._place, self._at, self.wxyz = place, np.zeros(3), np.array([1.0, 0, 0, 0])
        self.heard, self.user = None, None
        self._written, self._drawn = threading.Event(), threading.Event()

    def on_update(self, callback):
        self.heard = callback

    @property
    def position(self):
        return self._at

    @position.setter
    def position(self, value):
        if self.heard is not None and self.user is None:
            self.user = threading.Thread(target=self._drag)
            self.user.start()
            self._written.wait(0.5)
        self._at = np.array(value)
        self._drawn.set()

    def _drag(self):
        def event(phase):
            return Mock(viser.TransformControlsEvent, phase=phase)

        asyncio.run(self.heard(event("start")))
        self._at = self._place
        self._written.set()
        self._drawn.wait(10)
        asyncio.run(self.heard(event("update")))


def test_a_drag_that_begins_while_the_page_draws_is_not_overwritten():
    ring, scene, moved = SMALL.rings[0], Mock(viser.SceneApi), []
    T = mount_frame(MOTION.robot, MOTION.poses[0].q, ring, 0.25)
    late = LateHandle(T[:3, 3])
    still = Mock(viser.TransformControlsHandle)
    still.position, still.wxyz = np.zeros(3), np.array([1.0, 0, 0, 0])
    scene.add_transform_controls = lambda name, *_, **__: late if "along" in name else still
    handles = RingHandles(scene, lambda position, phase: moved.append(position))
    handles.show("/setup0", MOTION.robot, MOTION.poses[0].q, ring)
    late.user.join(20)
    assert moved == [pytest.approx(0.25)]


@contextmanager
def drawn_before_each_action(served, monkeypatch):
    """Let the page draw what it knows between a change by the user and the page's answer."""
    (page,) = served._pages.values()
    pool = page._actions._pool
    submit = pool.submit

    def late(act, *args):
        page._show()
        time.sleep(0.2)  # viser's own thread waits meanwhile
        return submit(act, *args)

    with monkeypatch.context() as patch:
        patch.setattr(pool, "submit", late)
        yield


def test_a_change_is_not_lost_where_the_page_draws_meanwhile(served, opened, monkeypatch):
    page = opened()
    until(lambda: served.pages == 1, "the page is not kept")
    length = 1000 * MOTION.robot.mount(SMALL.rings[0].link).length
    with drawn_before_each_action(served, monkeypatch):
        page.set("Position, mm", 150.0)
        page.until(lambda: "edited" in page.words, "the ring stays", 10)
        assert page.value("Position, mm") == 150.0
        page.set("Handles", True)
        page.until(lambda: {"/setup0/along", "/setup0/around"} <= page.drawn, "no handles came")
        page.drag("/setup0/along", *dragged_to(0.25))
        page.until(
            lambda: page.value("Position, mm") == pytest.approx(0.25 * length, abs=0.1),
            "the drag is lost",
            10,
        )


def held_up(monkeypatch, owner, name: str):
    """Let the first call of a function of a module or class take a fifth of a second longer."""
    real, calls = getattr(owner, name), []

    def late(*args):
        calls.append(args)
        if len(calls) == 1:
            time.sleep(0.2)
        return real(*args)

    monkeypatch.setattr(owner, name, late)


def test_a_change_does_not_overtake_the_one_before(opened, monkeypatch):
    """The other ring is turned, not the one that was shown before."""
    page = opened()
    held_up(monkeypatch, RingControls, "ring_number")
    page.set("Ring", "1: forearm")
    page.set("Phase, °", 90.0)
    page.until(lambda: "edited" in page.words, "no ring turns")
    page.until(lambda: page.value("Ring") == "1: forearm", "the ring is not chosen")
    page.read(0.5)
    assert page.value("Phase, °") == pytest.approx(90, abs=0.1)


def test_a_drag_ends_where_the_handle_was_let_go(opened, monkeypatch):
    page = opened()
    page.set("Handles", True)
    page.until(lambda: {"/setup0/along", "/setup0/around"} <= page.drawn, "no handles came")
    length = 1000 * MOTION.robot.mount(SMALL.rings[0].link).length
    held_up(monkeypatch, ring_handles, "dragged_position")
    page.drag("/setup0/along", *dragged_to(0.25))
    page.until(lambda: "edited" in page.words, "it stays")
    page.read(0.5)
    assert page.value("Position, mm") == pytest.approx(0.25 * length, abs=0.1)


def test_the_page_sets_no_control_while_viser_stores_a_change(served):
    """Else the page could read its own value in place of the user's."""
    control = served._server.gui.add_text("Name", "old")
    loop = control._impl.gui_api._websock_interface.get_message_buffer().event_loop

    async def store() -> str:
        control._impl.value = "of the user"
        page = threading.Thread(target=set_value, args=(control, "old"))
        page.start()
        page.join(10)
        return control.value

    assert asyncio.run_coroutine_threadsafe(store(), loop).result(20) == "of the user"
    until(lambda: control.value == "old", "it is never set")
    control.remove()


def test_a_handle_that_is_only_grabbed_leaves_the_ring_where_it_is(opened):
    page = opened()
    page.set("Handles", True)
    page.until(lambda: "/setup0/along" in page.drawn, "no handles came")
    page.set("Position, mm", 150.0)
    page.until(lambda: "edited" in page.words, "the ring stays")
    node = {"name": "/setup0/along", "owner": page._owners["/setup0/along"]}
    page.read(0.4)
    page.send({"type": "TransformControlsDragStartMessage", **node})
    page.send({"type": "TransformControlsDragEndMessage", **node})
    page.read(0.4)
    assert page.value("Position, mm") == pytest.approx(150.0, abs=0.1)


def test_messages_are_never_left_waiting(served, opened, monkeypatch):
    """The event loop stops for a moment whenever it is about to wait for messages."""
    real = asyncio.Event._get_loop

    def slow(event):
        time.sleep(0.03)
        return real(event)

    page = opened()
    until(lambda: served.pages == 1, "the page is not kept")
    (drawn,) = served._pages.values()
    monkeypatch.setattr(asyncio.Event, "_get_loop", slow)
    for i in range(24):
        drawn.controls.said.content = f"message {i}"
        drawn._client.flush()
        page.read(0.001 * (i % 12) ** 2)
    page.until(lambda: "message 23" in page.words, "the page gets no messages any more", 20)


def test_it_plays_to_the_last_pose_and_draws_the_curve(served, opened, monkeypatch):
    monkeypatch.setattr(playback, "_LONGEST", 0.05)
    page = opened()
    until(lambda: served.pages == 1, "the page is not kept")  # it shows ζ a little earlier
    (drawn,) = served._pages.values()
    curve = drawn.controls.view.curve
    page.until(lambda: np.isfinite(curve.data[1]).all(), "there is no curve")
    axis, now, opened_, here = curve.data
    assert list(axis) == [0.0, 0.5, 1.0]
    assert np.isfinite(now).all()
    assert list(now) == list(opened_)
    assert list(np.isfinite(here)) == [True, False, False]
    page.set("Play", True)
    page.until(lambda: page.value("Pose") == 2, "it does not play")
    page.until(lambda: page.button("Play"), "it does not stop at the end")
    page.until(lambda: np.isfinite(curve.data[3]).tolist() == [False, False, True], "still")


def test_cuts_change_what_is_drawn_and_not_what_is_counted(opened):
    page = opened()
    before = page.zeta("V_S(0.5)")
    page.set("Cut", "z: top")
    page.until(lambda: page.visible("Plane at, mm"), "the plane cannot be moved")
    page.set("Plane at, mm", -9000)
    page.until(lambda: "/setup0/points0" not in page.drawn, "points above the plane are drawn")
    page.set("Cut", "none")
    page.until(lambda: "/setup0/points0" in page.drawn, "points are missing")
    page.set("Points", "covered")
    page.until(lambda: "/setup0/points0" not in page.drawn, "uncovered points stay")
    page.set("Cut", "w")
    page.until(lambda: "cut: found" in page.words, "an unknown cut is taken")
    page.set("View from", "Top")
    page.until(lambda: "view=Top" in page.said, "the link says nothing of the view")
    assert page.zeta("V_S(0.5)") == before


def test_two_setups_are_named_each(opened):
    scene = replace(MOTION, poses=MOTION.poses[:1])
    with Server(ViewerSession(scene, {"one": SMALL, "two": SMALL})) as server:
        page = Client(server.url)
        page.until(lambda: page.zeta("V_S(0.5)", 3) is not None, "the page says no ζ")
        page.set("Setup to change", "B: two")
        page.set("Sensors", 3)
        page.until(lambda: "two, edited : 8 sensors" in page.words, "the other was edited")
        assert "one : 11 sensors" in page.words
        page.close()
        until(lambda: server.pages == 0, "a closed page is still kept")


def test_a_browser_that_leaves_early_leaves_no_trace(recwarn, capfd):
    with Server(ViewerSession(MOTION, {"mine": SMALL})) as server:
        for wait in (0.0, 0.1, 0.2, 0.3):
            page = Client(server.url)
            page.read(0.02)
            time.sleep(wait)
            page.close()
        end = time.monotonic() + 30
        while server.pages:
            assert time.monotonic() < end, "a page stays"
            time.sleep(0.05)
        time.sleep(0.5)  # what was being drawn
    assert [str(w.message) for w in recwarn if "closed connection" in str(w.message)] == []
    assert capfd.readouterr().err == ""
