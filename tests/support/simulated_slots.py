"""Rings that keep in step by their clock line: their compiled sketches, each on a board whose clock
runs at its own rate, and when their sensors emitted light."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from place_rings.formats.firmware.wiring import RingWiring
from place_rings.rig.rings.protocol import Status

from .simulated_firmware import Run, build, run

EDGE_US = 50  # most time from an edge to its interrupt, with those of the bus before it


@dataclass(frozen=True)
class BoardClock:
    """Clock of a board: its start in true time, s, and its rate less one."""

    start: float
    rate: float

    def true(self, local_us: np.ndarray) -> np.ndarray:
        return self.start + local_us / 1e6 / (1 + self.rate)

    def local_us(self, true: np.ndarray) -> np.ndarray:
        return 1e6 * (true - self.start) * (1 + self.rate)


@dataclass(frozen=True)
class SlottedRun:
    """A run of several rings."""

    light: Mapping[tuple[int, int], np.ndarray]
    """Begin and end of each ranging (n, 2), true time, s, by ring and sensor."""
    edges: Mapping[int, np.ndarray]
    """Edges that began the cycles of each ring's leader, true time, s."""
    runs: Mapping[int, Run]
    """What each ring sent."""
    clocks: Mapping[int, BoardClock]
    """Clocks of the rings' boards."""


def run_rings(
    wirings: Mapping[int, RingWiring],
    rng: np.random.Generator,
    seconds: float = 6.0,
    events: Mapping[int, Sequence[str]] = {},
    programs: Mapping[int, Path] = {},
    drop: float = 0.0,
    edges_until: float = np.inf,
    clocks: Mapping[int, BoardClock] | None = None,
) -> SlottedRun:
    """Run the sketches of rings by their numbers; all but the leaders of their groups hear the
    edges of their leader's clock line, within ``EDGE_US``, on clocks up to 100 ppm apart; of these
    edges a share ``drop`` is missing, and all from ``edges_until``, s, on. ``clocks`` take
    the place of random ones."""
    clocks = clocks or {
        i: BoardClock(rng.uniform(0, 0.5), rng.uniform(-5e-5, 5e-5)) for i in wirings
    }
    edges, light, runs = {}, {}, {}
    for i in sorted(wirings, key=lambda i: not (wirings[i].slots and wirings[i].slots.leads)):
        wiring, slots = wirings[i], wirings[i].slots
        lines = ["light", *events.get(i, ())]
        if slots and slots.shared and slots.leads:
            lines.append(f"watch {wiring.clock}")
        elif slots and slots.shared:
            sent = edges[slots.rings[0]]
            there = (rng.random(len(sent)) >= drop) & (sent < edges_until)
            heard = clocks[i].local_us(sent[there])
            heard = np.ceil(heard + rng.uniform(0, EDGE_US, len(heard))).astype(int)
            noise = [int(line.split()[1]) for line in lines if line.startswith("edge")]
            lines = [line for line in lines if not line.startswith("edge")]
            lines += [f"edge {at}" for at in sorted([*heard[heard > 0], *noise])]
        readings = [(500 + k, Status.VALID) for k in range(wiring.count)]
        runs[i] = run(programs.get(i) or build(wiring), wiring, readings, lines, seconds)
        edges[i] = clocks[i].true(np.array(runs[i].edges))
        for k in range(wiring.count):
            light[i, k] = clocks[i].true(np.array(runs[i].light[k]).reshape(-1, 2))
    return SlottedRun(light, edges, runs, clocks)
