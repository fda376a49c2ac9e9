"""The viewer driven in a real browser: nothing from outside, sliders move ζ, two at once, and an
end to all.
"""

import math
import signal
import subprocess
import sys
import time
from functools import partial
from urllib.parse import urlsplit

import numpy as np
import pytest
from place_rings.coverage.definitions.errors import UserError
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.formats.loader import read_proposal
from place_rings.objectives.scene import Scene
from place_rings.placement.search.schedule import Round
from place_rings.viewer import page_tasks, tasks
from place_rings.viewer.html import UNBUILDABLE
from place_rings.viewer.server import Server
from place_rings.viewer.session import ViewerSession

from ..support.browser import PATIENCE, Reader, chromium, needs_chromium, until
from ..support.viser_client import Client, pages_of

pytestmark = pytest.mark.slow

SMALL = Setup((Ring("upper_arm", 0.7, 6, 0.5), Ring("forearm", 0.4, 5, -0.3)))
HOSTILE = "<img src=x onerror=alert(1)>{alert(1)}"


@pytest.fixture(scope="module")
def browser():
    with chromium() as found:
        yield found


def ours(reader: Reader, port: int) -> bool:
    """Did the page ask this server only?"""
    asked = {
        urlsplit(url.removeprefix("blob:")).netloc
        for url in reader.requested
        if not url.startswith("data:")
    }
    return asked == {f"127.0.0.1:{port}"}


@pytest.mark.slow
@needs_chromium()
def test_a_slider_moves_zeta_a_picture_is_saved_and_nothing_comes_from_outside(browser, tmp_path):
    with Server(ViewerSession(Scene.paper(), {HOSTILE: SMALL}, tmp_path)) as server:
        reader = Reader(browser, server.url)
        before = reader.zeta("V_S(0.5)")
        reader.tab("Search and files")
        reader.enter("Name", "mine")
        with reader.page.expect_download(timeout=1000 * PATIENCE) as download:
            reader.press("Picture of the view")
        assert download.value.path().read_bytes() == (tmp_path / "mine.png").read_bytes()
        assert {p.name for p in tmp_path.iterdir()} == {"mine.png"}
        reader.tab("Rings")
        reader.enter("Sensors", "24")
        until(lambda: reader.zeta("V_S(0.5)") > before + 1, "more sensors did not raise ζ")
        assert reader.zeta("V_S(0.5)", 1) == before  # as opened
        assert reader.page.locator("img[src=x]").count() == 0
        assert HOSTILE in reader.page.inner_text("body")
        assert reader.alarms == []
        assert ours(reader, server.port)
        until(lambda: reader.page.url == server.url, "the address is changed")
        assert server.pages == 1
        reader.close()
        until(lambda: server.pages == 0, "a closed page is still kept")


def visible(page, points) -> bool:
    """Does the page's camera, as the browser reports it, see all points?"""
    camera = page._client.camera
    toward = np.asarray(camera.position) - np.asarray(camera.look_at)
    toward /= np.linalg.norm(toward)
    right = np.cross([0, 0, 1], toward)
    right /= np.linalg.norm(right)
    away = points - camera.position
    depth, slope = -away @ toward, math.tan(camera.fov / 2)
    x, y = (away @ a / depth / slope for a in (right, np.cross(toward, right)))
    return bool((np.abs(x) < camera.aspect).all() and (np.abs(y) < 1).all() and depth.min() > 0)


SIZES = ((1024, 768), (1920, 1080), (820, 1180))  # and a phone
PHONE = (390, 844)


@pytest.mark.slow  # every window is drawn anew, by the processor
@needs_chromium()
def test_the_scene_fits_into_any_window_and_a_phone_shows_it_first(browser):
    with Server(ViewerSession(Scene(), {"small": SMALL})) as server:
        reader = Reader(browser, f"{server.url}/?view=Side", SIZES[0], 0.1)
        until(lambda: "place-rings" in reader.page.title(), "the page has no title")
        assert "small: " in reader.page.title()
        assert "covered" in reader.page.title()
        until(lambda: server.pages == 1, "no page is open")
        (page,) = server._pages.values()
        until(lambda: page.state.view == "Side", "the link's view did not come")
        points = server.room.extent(page.state.choice)
        for width, height in SIZES:
            reader.page.set_viewport_size({"width": width, "height": height})
            until(lambda h=height: page._client.camera.image_height == h, "not resized")
            # the panel stands beside the scene
            until(lambda w=width: page._client.camera.image_width < w, "the panel covers it")
            until(lambda: visible(page, points), f"cut at {width}x{height}")
            button = reader.page.get_by_role("button", name="Search from here").bounding_box()
            assert button["y"] + button["height"] < height  # without scrolling
        reader.close()
        until(lambda: server.pages == 0, "a closed page is still kept")
        phone = Reader(browser, server.url, PHONE, 0.1, state="attached")
        until(lambda: server.pages == 1, "no page is open")
        (page,) = server._pages.values()
        search = phone.page.get_by_role("button", name="Search from here")
        until(lambda: not search.is_visible(), "the panel covers the scene")
        until(lambda: visible(page, points), "cut on a phone")
        phone.page.get_by_text("covered").first.click()
        until(search.is_visible, "the panel does not open")
        phone.close()


@pytest.fixture(scope="module")
def served():
    with Server(ViewerSession(Scene.paper(), {HOSTILE: SMALL})) as server:
        yield server


@pytest.fixture
def opened(served):
    with pages_of(served) as opened:
        yield opened


def test_controls_move_zeta_for_their_own_page_only(opened):
    one, two = opened(), opened()
    before = one.zeta("V_S(0.5)")
    one.set("Sensors", 24)
    two.set("Tilt, °", 60.0)
    one.until(lambda: one.zeta("V_S(0.5)") > before + 1, "more sensors did not raise ζ")
    two.until(lambda: two.zeta("V_S(0.5)") != before, "another tilt did not change ζ")
    assert one.zeta("V_S(0.5)", 0) == two.zeta("V_S(0.5)", 0) == before  # as opened
    assert (one.value("Tilt, °"), two.value("Sensors")) == (pytest.approx(28.6, abs=0.1), 6)
    one.set("Robot's body", "shadow")
    one.until(lambda: one.value("Robot's body") == "shadow", "the model did not change")
    one.set("Target", "V_S(1.5)")
    one.until(lambda: "Points of V_S(1.5)" in one.words, "the target did not change")
    assert {
        f"/setup0/{n}" for n in ("robot", "curve", "outline", "ring0", "ring1", "points0")
    } <= one.drawn
    one.set("Remove this ring", True)
    one.until(lambda: "5 sensors on 1 ring " in one.words, "the ring stayed")
    one.until(lambda: "/setup0/ring1" not in one.drawn, "the ring is still drawn")


# What no control would send, and what the page says to it.
NOT_ALLOWED = (
    ("Link", HOSTILE, "robot ur10 has no link"),
    ("Target", HOSTILE, f"'{HOSTILE}'"),
    ("Ring", "99: tool", "'99: tool'"),
    ("Cones", "", "not in tuple"),
    ("Robot's body", "x", "not in tuple"),
    ("Position, mm", float("nan"), "must be finite"),
    ("Save (start with --out FOLDER)", True, "--out FOLDER"),
)


def test_what_no_control_would_send_changes_nothing(opened):
    client = opened()
    before = client.zeta("V_S(0.5)")
    assert HOSTILE in client.words
    assert "<img" not in client.said
    # one after the other: the newest word takes the place of the one before
    for label, value, answer in NOT_ALLOWED:
        client.set(label, value)
        client.until(lambda told=answer: told in client.words, f"nothing was said of {label}")
    client.set("Picture of the view", True)
    client.until(lambda: "picture: " in client.words, "no picture came, and nothing was said")
    client.set("Position, mm", 1e300)
    client.until(lambda: client.zeta("V_S(0.5)") != before, "a place beyond the end is the end")
    assert "<img" not in client.said
    client.set("As opened", True)
    client.until(lambda: client.zeta("V_S(0.5)") == before, "what was opened did not come back")


QUICK = (Round(512, 4, 2, 8, 0.2, 8),)


def test_search_count_and_save(tmp_path, monkeypatch):
    counted = partial(tasks.prove, voxel=0.05, width=0.1)
    monkeypatch.setattr(page_tasks, "prove", counted)
    searched = partial(tasks.search_from, schedule=QUICK, voxel=0.05)
    monkeypatch.setattr(page_tasks, "search_from", searched)
    with Server(ViewerSession(Scene.paper(), {"small": SMALL}, tmp_path)) as server:
        page = Client(server.url)
        page.until(lambda: page.zeta("V_S(0.5)") is not None, "the page says no ζ")
        before = page.zeta("V_S(0.5)")
        page.set("Search from here", True)
        page.until(lambda: page.zeta("V_S(0.5)") > before + 1, "the search found nothing better")
        page.until(lambda: page.button("Count"), "the search does not end")
        page.set("Count", True)
        page.until(lambda: "guaranteed" in page.words, "nothing was counted")
        page.set("Add a ring on this link", True)
        page.until(lambda: "guaranteed" not in page.words, "a count of another setup is shown")
        page.set("Remove this ring", True)
        page.until(lambda: "guaranteed" in page.words, "what was counted is not shown any more")
        for name, said in (("../mine", "../mine"), ("mine", "mine.toml:"), ("mine", "mine.toml ")):
            page.set("Name", name)
            page.set("Save as a new proposal", True)
            page.until(lambda said=said: said in page.words, f"nothing is said of {said}")
        assert {p.name for p in tmp_path.iterdir()} == {"mine.toml"}
        setup, _, file = read_proposal(tmp_path / "mine.toml")
        assert [r.count for r in setup.rings] == [6, 5]
        assert abs(100 * file.zeta[0].zeta - page.zeta("V_S(0.5)")) < 4
        page.set("Search from here", True)  # and leave in the middle of it
        page.close()
        until(lambda: server.pages == 0, "a closed page is still kept")
        until(lambda: not server.room.turn.locked(), "its search continues")


def test_a_ring_moved_too_near_is_named_at_once_and_when_it_is_saved(tmp_path, monkeypatch):
    monkeypatch.setattr(page_tasks, "prove", partial(tasks.prove, voxel=0.05, width=0.1))
    scene = Scene()
    radius, length = scene.radius_of("forearm"), scene.robot.mount("forearm").length
    pair = Setup(tuple(Ring("forearm", p, 4, 0.3, 0.0, radius) for p in (0.4, 0.8)))
    with Server(ViewerSession(scene, {"pair": pair}, tmp_path)) as server:
        page = Client(server.url)
        page.until(lambda: page.zeta("V_S(0.5)") is not None, "the page says no ζ")
        assert UNBUILDABLE not in page.words
        page.set("Position, mm", 1000 * (0.8 * length - 0.015))
        page.until(lambda: "are 15.0 mm apart" in page.words, "15 mm are not named")
        page.set("Save as a new proposal", True)
        page.until(lambda: "saved as proposal.toml" in page.words, "it is not saved")
        assert page.words.count("are 15.0 mm apart") == 2
        assert "are 15.0 mm apart" in (tmp_path / "proposal.toml").read_text()
        page.set("Changes", "Undo")
        page.until(lambda: page.words.count("are 15.0 mm apart") == 1, "the rule is still broken")


def test_an_address_that_cannot_be_served_is_one_line():
    room = ViewerSession(Scene.paper(), {"small": SMALL})
    with Server(room) as server, pytest.raises(UserError, match="--port"):
        Server(room, port=server.port)
    with pytest.raises(UserError, match="--host"):
        Server(room, host="192.0.2.1")


@pytest.fixture
def not_ignored():
    """A child takes over an interrupt that is ignored, as it is in a shell's background."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("not_ignored")
def test_control_c_ends_the_command_at_once():
    command = [sys.executable, "-m", "place_rings.cli.entry", "view", "n1_8_0", "--no-browser"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as run:
        assert run.stdout is not None
        assert run.stdout.readline().startswith("http://127.0.0.1:")
        run.send_signal(signal.SIGPIPE)  # as a write to a browser that went away does
        began = time.monotonic()
        run.send_signal(signal.SIGINT)
        assert run.wait(PATIENCE) == 0
        assert time.monotonic() - began < 10  # s, on a busy machine
        assert run.stderr is not None
        assert run.stderr.read().count("\n") == 1
