"""Faults of the rings' serial lines."""

import time
from functools import partial

import numpy as np
from place_rings.rig.rings.line_monitor import SILENT, Event, Happened, Port
from place_rings.rig.rings.ports import RingReaders
from place_rings.rig.robot.vetting import Ended, LinkFaultError
from place_rings.rig.simulated.process import SimulatedRig, command
from rig_found import PLAIN, Found, row, until

# fault, its end, events, bound in s
_RINGS: dict[str, tuple[str, dict, dict, tuple[Happened, ...], float]] = {
    "unplugged": ("unplug", {}, {"do": "plug"}, (Happened.GONE,), 0.02),
    "plugged in again": ("plug", {}, {"do": "plug"}, (Happened.BACK,), 0.05 + 1 / 15),
    "silent": ("silent", {}, {"do": "silent", "on": False}, (Happened.SILENT,), SILENT + 0.02),
    "speaks another language": (
        "garble",
        {"on": True},
        {"do": "garble", "on": False},
        (Happened.GARBLED,),
        SILENT + 1 / 15,
    ),
    "1 % of bytes changed": (
        "corrupt",
        {"share": 0.01},
        {"do": "corrupt", "share": 0},
        (Happened.NOISY, Happened.GARBLED),
        2.0,
    ),
    "frames out of order, one in four": (
        "disorder",
        {"share": 0.33},
        {"do": "disorder", "share": 0},
        (Happened.NOISY,),
        3.0,
    ),
}


def ring_fault(rig: SimulatedRig, name: str, rng: np.random.Generator, found: Found) -> None:
    """Run a fault of a ring's line once, at a random moment."""
    do, more, end, events, _ = _RINGS[name]
    watch, ring = list[Event](), int(rng.integers(2))
    if do == "plug":
        rig.do("unplug", ring=ring)
    with RingReaders([Port(rig.ring(i), 16) for i in range(2)], on_event=watch.append) as rings:
        time.sleep(rng.uniform(0.4, 0.9))
        # the machine delayed a line, which is already reported
        if do != "plug" and None in rings.latest():
            raise LinkFaultError(Ended.STALE)
        watch.clear()
        done = rig.do(do, ring=ring, **more)["time"]
        until(lambda: any(e.ring == ring and e.what in events for e in watch))
        event = next((e for e in watch if e.ring == ring and e.what in events), None)
    found.outcomes[event.what.value if event else "not detected"] += 1
    if event:
        found.seconds.append(event.time - done)
    rig.do(**{**end, "ring": ring})


def of_rings(runs: int, seed: int) -> list[tuple[tuple, Found]]:
    """Return the rows of the faults of rings' lines."""
    rng = np.random.default_rng(seed)
    with SimulatedRig((PLAIN, command(2))) as rig:
        return [
            row(f"a ring: {name}", runs, partial(ring_fault, rig, name, rng), f"{1000 * bound:.0f}")
            for name, (*_, bound) in _RINGS.items()
        ]
