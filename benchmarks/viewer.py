"""Viewer: accuracy of its estimates, and time to a new estimate and to the first picture.

Run: python benchmarks viewer
"""

import os
import statistics
import sys
import time
from pathlib import Path

from common import table
from loads import busy
from place_rings.coverage.occlusion.occlusion_mode import OCCLUSIONS
from place_rings.coverage.rings.ring import named_setup
from place_rings.objectives.scene import CoreScene
from place_rings.objectives.verify import Verifier
from place_rings.viewer.server import Server
from place_rings.viewer.session import ViewerSession

sys.path.append(str(Path(__file__).parent.parent))
from tests.browser import CHROMIUM, Reader, chromium
from tests.viser_client import Client

SETUPS = ("n1_8_0", "n2_16_25", "n2_16_55", "n3_16_55")
EVENTS, OPENED = 20, 3


def off() -> float:
    """Return the largest difference from the exact count in points.

    It is taken over setups, targets and models of occlusion.
    """
    worst = 0.0
    for occlusion in OCCLUSIONS:
        scene = CoreScene(occlusion=occlusion)
        room, verifier = ViewerSession(scene, {"": named_setup(SETUPS[0])}), Verifier(scene)
        for name in SETUPS:
            for target in room.targets:
                setup = named_setup(name)
                about, exact = (
                    room.glance.zeta(setup, target, occlusion),
                    verifier.verify(setup, target).zeta,
                )
                worst = max(worst, 100 * abs(about - exact))
    return worst


def waits(occlusion: str) -> list[float]:
    """Return the seconds from a slider's message to the page's first new estimates, over
    loopback.
    """
    found = []
    with Server(
        ViewerSession(CoreScene(occlusion=occlusion), {"n3_16_55": named_setup("n3_16_55")})
    ) as server:
        client = Client(server.port)
        client.until(lambda: client.zeta("V_OT") is not None, "the page says no ζ")
        for i in range(EVENTS):
            client.read(0.3)
            before, began = client.said, time.perf_counter()
            client.set("Tilt, °", float(5 + 2 * i))
            while client.said == before:
                client.read(0.005)
            found.append(time.perf_counter() - began)
        client.close()
    return found


def first_paint() -> list[tuple[str, str]]:
    """Return what a browser shows first and after how many seconds; nothing without a browser."""
    if CHROMIUM is None:
        return []
    found: dict[str, list[float]] = {
        "first paint": [],
        "coverage": [],
        "scene fitted and drawn": [],
    }
    frames = "new Promise(r => requestAnimationFrame(() => requestAnimationFrame(r)))"
    room = ViewerSession(CoreScene(), {"n3_16_55": named_setup("n3_16_55")})
    with Server(room) as server, chromium() as browser:
        for _ in range(OPENED):
            began = time.perf_counter()
            reader = Reader(browser, server.url, (1440, 900), 0.2)
            found["coverage"].append(time.perf_counter() - began)
            for _ in range(5):
                reader.page.evaluate(frames)
            found["scene fitted and drawn"].append(time.perf_counter() - began)
            paint = "performance.getEntriesByType('paint')[0].startTime"
            found["first paint"].append(reader.page.evaluate(paint) / 1000)
            reader.close()
    return [(what, f"{statistics.median(seconds):.1f}") for what, seconds in found.items()]


def report() -> list[str]:
    """Return all three, on the reference scene."""
    rows = []
    for occlusion in OCCLUSIONS:
        alone = waits(occlusion)
        with busy(os.cpu_count() or 1):
            beside = waits(occlusion)
        figures = (f(seconds) for seconds in (alone, beside) for f in (statistics.median, max))
        rows.append((occlusion, *(f"{value:.2f}" for value in figures)))
        print(*rows[-1], flush=True)
    return [
        (
            f"Estimates for {', '.join(SETUPS)}, three targets and three models of occlusion"
            f" differ from the exact count (rule `centre`, voxels of 1 cm) by at most {off():.2f}"
            " points."
        ),
        "",
        (
            "Seconds from a slider's message to the new ζ of three targets, for n3_16_55 (112"
            f" sensors), {EVENTS} times, alone and then beside a busy process for each core, which"
            " the benchmark starts:"
        ),
        "",
        *table(("occlusion", "median", "largest", "busy cores: median", "largest"), rows),
        "",
        (
            "Seconds until a browser without a graphics processor, which draws by software, shows"
            f" the page, median of {OPENED}:"
        ),
        "",
        *table(("what", "seconds"), first_paint()),
    ]
