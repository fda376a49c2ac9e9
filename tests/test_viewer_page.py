"""The viewer driven in a real browser: nothing from outside, sliders move ζ, two at once, and an end to all."""

import os
import signal
import subprocess
import sys
import time
from urllib.parse import urlsplit

import pytest
from place_rings.cli.viewer.room import Room
from place_rings.cli.viewer.server import Server
from place_rings.coverage.rings import Ring, Setup, named_setup
from place_rings.objectives.scene import Scene
from place_rings.placement.errors import UserError
from place_rings.placement.loader import read_proposal

from .browser import PATIENCE, Reader, chromium, needs_chromium, until

SMALL = Setup((Ring("upper_arm", 0.7, 6, 0.5), Ring("forearm", 0.4, 5, -0.3)))
HOSTILE = "<img src=x onerror=alert(1)>{alert(1)}"


@pytest.fixture(scope="module")
def browser():
    with chromium() as found:
        yield found


def ours(reader: Reader, port: int) -> bool:
    """Did the page ask this server only?"""
    asked = {urlsplit(url.removeprefix("blob:")).netloc for url in reader.requested if not url.startswith("data:")}
    return asked == {f"127.0.0.1:{port}"}


@needs_chromium()
def test_a_slider_moves_zeta_and_nothing_comes_from_outside(browser):
    with Server(Room(Scene(), {HOSTILE: SMALL})) as server:
        reader = Reader(browser, server.url)
        reader.choose("Cones", "off")
        before = reader.zeta("V_S(0.5)")
        reader.enter("Sensors", "24")
        until(lambda: reader.zeta("V_S(0.5)") > before + 1, "more sensors did not raise ζ")
        assert reader.zeta("V_S(0.5)", 1) == before  # as opened
        assert reader.page.locator("img[src=x]").count() == 0
        assert HOSTILE in reader.page.inner_text("body")
        assert reader.alarms == []
        assert ours(reader, server.port)
        assert server.pages == 1
        reader.close()
        until(lambda: server.pages == 0, "a closed page is still kept")


@needs_chromium()
@pytest.mark.slow
def test_two_at_once_have_each_their_own(browser):
    with Server(Room(Scene(), {"small": SMALL, "n1_8_0": named_setup("n1_8_0")})) as server:
        one, two = Reader(browser, server.url), Reader(browser, server.url)
        until(lambda: server.pages == 2, "two pages are open")
        before = one.zeta("V_S(0.5)", 2)
        one.enter("Tilt, °", "-20")
        two.enter("Sensors", "12")
        until(lambda: one.zeta("V_S(0.5)", 2) != before, "the first page's slider did nothing")
        until(lambda: two.zeta("V_S(0.5)", 2) > before, "the second page's slider did nothing")
        assert one.zeta("V_S(0.5)", 1) == two.zeta("V_S(0.5)", 1) == before
        assert one.zeta("V_S(0.5)", 2) != two.zeta("V_S(0.5)", 2)
        one.close()
        until(lambda: server.pages == 1, "a closed page is still kept")
        now = two.zeta("V_S(0.5)", 2)
        two.press("Remove this ring")
        until(lambda: two.zeta("V_S(0.5)", 2) < now, "the other page does not go on")
        two.close()


@needs_chromium()
@pytest.mark.slow
def test_search_count_save_and_picture(browser, tmp_path):
    with Server(Room(Scene(), {"small": SMALL}, tmp_path)) as server:
        reader = Reader(browser, server.url)
        reader.choose("Cones", "off")
        before = reader.zeta("V_S(0.5)")
        reader.press("Search from here")
        reader.says("better:", 5 * PATIENCE)
        until(lambda: reader.zeta("V_S(0.5)") > before + 1, "the search found nothing better")
        reader.press("Count exactly")
        reader.says("counted in", 5 * PATIENCE)
        for name, said in (("../mine", "allowed: letters"), ("mine", "saved as mine.toml"), ("mine", "there already")):
            reader.enter("Name", name)
            reader.press("Save as a new proposal")
            reader.says(said, 5 * PATIENCE)
        setup, _, file = read_proposal(tmp_path / "mine.toml")
        assert [r.count for r in setup.rings] == [6, 5]
        assert abs(file.zeta[0].zeta_percent - reader.zeta("V_S(0.5)")) < 1.5
        with reader.page.expect_download(timeout=5000 * PATIENCE) as download:
            reader.press("Picture of the view")
        assert download.value.path().read_bytes() == (tmp_path / "mine.png").read_bytes()
        assert {p.name for p in tmp_path.iterdir()} == {"mine.toml", "mine.png"}
        reader.press("Search from here")  # and leave in the middle of it
        reader.close()
        until(lambda: server.pages == 0, "a closed page is still kept")
        until(lambda: not server.room.turn.locked(), "its search goes on", 2 * PATIENCE)


@needs_chromium()
@pytest.mark.slow
def test_a_page_of_another_site_gets_nothing(browser):
    with Server(Room(Scene(), {"small": SMALL})) as server:
        home = Reader(browser, server.url)
        client = home.context.request.get(server.url).body()
        context = browser.new_context()
        context.route("http://elsewhere.example/**", lambda route: route.fulfill(body=client, content_type="text/html"))
        page = context.new_page()
        frames = []
        page.on("websocket", lambda w: w.on("framesent", frames.append))
        page.goto(f"http://elsewhere.example/?websocket=ws://127.0.0.1:{server.port}")
        until(lambda: (page.wait_for_timeout(100), len(frames) > 2)[1], "the other page has not connected")
        page.wait_for_timeout(2000)
        assert server.pages == 1
        assert page.get_by_text("ζ in %").count() == 0
        context.close()
        home.close()


def test_an_address_that_cannot_be_served_is_one_line():
    room = Room(Scene(), {"small": SMALL})
    with Server(room) as server, pytest.raises(UserError, match="--port"):
        Server(room, port=server.port)
    with pytest.raises(UserError, match="--host"):
        Server(room, host="192.0.2.1")


@pytest.mark.slow
def test_control_c_ends_the_command_at_once():
    command = [sys.executable, "-m", "place_rings.cli.entry", "view", "n1_8_0", "--no-browser"]
    undo = {"preexec_fn": lambda: signal.signal(signal.SIGINT, signal.default_int_handler)}
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=os.environ, **undo) as run:
        assert run.stdout is not None
        assert run.stdout.readline().startswith("http://127.0.0.1:")
        began = time.monotonic()
        run.send_signal(signal.SIGINT)
        assert run.wait(PATIENCE) == 0
        assert time.monotonic() - began < 10  # s, on a busy machine
        assert run.stderr is not None
        assert run.stderr.read().strip() == "closed"
