"""Viewer: accuracy of its estimates, and time to a new estimate and to the first picture."""

import os
import statistics
import time

from common import busy, say, table
from place_rings.coverage.occlusion.occlusion_mode import OCCLUSIONS
from place_rings.coverage.rings.ring import named_setup
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import Verifier
from place_rings.viewer.server import Server
from place_rings.viewer.session import ViewerSession

from tests.support.browser import CHROMIUM, Reader, chromium
from tests.support.viser_client import Client

SETUPS, MOVED = ("n1_8_0", "n2_16_25", "n2_16_55", "n3_16_55"), "n3_16_55"
EVENTS, OPENED = {False: 8, True: 20}, {False: 2, True: 5}  # moves of a slider; visits
_FRAMES = "new Promise(r => requestAnimationFrame(() => requestAnimationFrame(r)))"
_PAINT = "performance.getEntriesByType('paint')[0].startTime"


def off() -> float:
    """Return the largest difference from the exact count, points.

    It is taken over setups, targets and models of occlusion.
    """
    worst = 0.0
    for occlusion in OCCLUSIONS:
        scene = Scene(occlusion=occlusion)
        room, verifier = ViewerSession(scene, {"": named_setup(SETUPS[0])}), Verifier(scene)
        for setup in map(named_setup, SETUPS):
            for target in room.targets:
                about = room.glance.zeta(setup, target, occlusion)
                worst = max(worst, 100 * abs(about - verifier.verify(setup, target).zeta))
    return worst


def waits(occlusion: str, events: int) -> list[float]:
    """Return the seconds from a slider's message to the page's first new estimates, over
    loopback.
    """
    found = []
    room = ViewerSession(Scene(occlusion=occlusion), {MOVED: named_setup(MOVED)})
    with Server(room) as server:
        client = Client(server.url)
        client.until(lambda: client.zeta("V_OT") is not None, "the page says no ζ")
        for i in range(events):
            client.read(0.3)
            before, began = client.said, time.perf_counter()
            client.set("Tilt, °", float(5 + 2 * i))
            while client.said == before:
                client.read(0.005)
            found.append(time.perf_counter() - began)
        client.close()
    return found


def first_paint(visits: int) -> list[tuple[str, str]]:
    """Return what a browser shows first and after how many seconds."""
    if CHROMIUM is None:
        return [("no Chromium on this machine", "-")]
    names = ("first paint", "coverage", "scene fitted and drawn")
    found: dict[str, list[float]] = {name: [] for name in names}
    room = ViewerSession(Scene(), {MOVED: named_setup(MOVED)})
    with Server(room) as server, chromium() as browser:
        for _ in range(visits):
            began = time.perf_counter()
            reader = Reader(browser, server.url, (1440, 900), 0.2)
            found["coverage"].append(time.perf_counter() - began)
            for _ in range(5):
                reader.page.evaluate(_FRAMES)
            found["scene fitted and drawn"].append(time.perf_counter() - began)
            found["first paint"].append(reader.page.evaluate(_PAINT) / 1000)
            reader.close()
    return [(what, f"{statistics.median(seconds):.1f}") for what, seconds in found.items()]


def report(full: bool) -> list[str]:
    """Measure on the reference scene and return blocks of Markdown."""
    rows = []
    for occlusion in OCCLUSIONS:
        alone = waits(occlusion, EVENTS[full])
        with busy(os.cpu_count() or 1):
            beside = waits(occlusion, EVENTS[full])
        figures = [f(seconds) for seconds in (alone, beside) for f in (statistics.median, max)]
        rows.append(
            (occlusion, *(f"{value:.2f}" for value in figures), f"{figures[2] / figures[0]:.1f}")
        )
        say(*rows[-1])
    columns = ("occlusion", "median", "largest", "busy: median", "busy: largest", "busy / alone")
    return [
        f"Estimates for {', '.join(SETUPS)}, three targets and three models of occlusion differ"
        f" from the exact count (rule `centre`, voxels of 1 cm) by at most {off():.2f} points.",
        f"Seconds from a slider's message to the new ζ of three targets, for {MOVED} (112"
        f" sensors), {EVENTS[full]} times, alone and then beside a busy process for each core:",
        table(columns, rows),
        "Seconds until a browser without a graphics processor, which draws by software, shows"
        f" the page, median of {OPENED[full]}:",
        table(("what", "seconds"), first_paint(OPENED[full])),
    ]
