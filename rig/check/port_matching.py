"""Find which port belongs to which ring: by the boards' serial numbers, by the number of sensors,
and by what the sensors read.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from ...coverage.rings.ring import Setup
from ...objectives.scene import Scene
from ..mount.channel_assignment import least_cost
from ..mount.hand_sweep import passages
from ..mount.mounting_error_model import both_ways
from ..rings.protocol import Counts
from ..sensing.expected import expected
from ..sensing.readings import Readings, Stops

_SURE = 80.0  # required advantage of other ports: twice a log likelihood ratio
_MOST_SEEN, _FEW_SEEN = 0.6, 0.3  # shares of a ring's sensors that saw a hand

Ports = Mapping[int, int]
"""The ring that a port belongs to, by the number of the ring it was given for; only ports that
were given for another ring."""


def by_lines(setup: Setup, counts: Sequence[Counts]) -> Ports:
    """Return the ports that belong to other rings by what their lines say: the serial number of a
    ring of ``setup``, or frames of so many sensors as only one ring has that is not heard.
    """
    serials = {r.serial: i for i, r in enumerate(setup.rings) if r.serial}
    owner: dict[int, int] = {}
    for port, c in enumerate(counts):
        known = [serials[s] for s in c.serials if s in serials]
        if len(known) == 1:
            owner[port] = known[0]
    for port, c in enumerate(counts):
        if port in owner or c.frames or not c.sizes:
            continue
        size = c.sizes.most_common(1)[0][0]
        free = [
            i
            for i, group in enumerate(setup.groups)
            if group.count == size and i not in owner.values() and not counts[i].frames
        ]
        if len(free) == 1:
            owner[port] = free[0]
    return _distinct(owner)


def by_waving(waves: Mapping[int, Readings], setup: Setup) -> Ports:
    """Return the ports that belong to other rings, from the readings of all rings while a hand
    passed one ring after another.
    """
    owner: dict[int, int] = {}
    for ring, readings in waves.items():
        share = [
            np.isfinite(passages(readings, setup, i)).mean() for i, _ in enumerate(setup.groups)
        ]
        port = int(np.argmax(share))
        same = setup.groups[port].count == setup.groups[ring].count
        if port != ring and same and share[port] >= _MOST_SEEN and share[ring] <= _FEW_SEEN:
            owner[port] = ring
    return _distinct(owner)


def by_pattern(scene: Scene, setup: Setup, stops: Stops) -> Ports:
    """Return the ports that belong to other rings, from the readings at stops: what each ring
    should see of the robot itself and of the cell, in any order of its wires, mounted as proposed
    or the other way round.
    """
    rings = len(setup.rings)
    wanted = [expected(scene, way, stops.joints).distance for way in both_ways(setup.rings)]
    parts = setup.slices
    table = np.full((rings, rings), np.inf)
    for port in range(rings):
        for ring in range(rings):
            if setup.rings[port].count == setup.rings[ring].count:
                read = stops.distance[:, parts[port]]
                table[port, ring] = least_cost(read, [one[:, parts[ring]] for one in wanted])
    finite = np.where(np.isfinite(table), table, 1e12)
    port, ring = linear_sum_assignment(finite + 1e-6 * (1 - np.eye(rings)))
    if finite.trace() - finite[port, ring].sum() <= _SURE:
        return {}
    return _distinct({int(p): int(r) for p, r in zip(port, ring, strict=True)})


def _distinct(owner: Mapping[int, int]) -> Ports:
    """Return the ports that differ from the given ones; none if two belong to one ring."""
    if len(set(owner.values())) < len(owner):
        return {}
    return {port: ring for port, ring in owner.items() if port != ring}


def exchanged(readings: Readings, ports: Ports) -> Readings:
    """Return the readings with the rings that their ports belong to. Only ports that are exchanged
    among themselves are: another ring's readings would be taken twice.
    """
    if not ports or set(ports) != set(ports.values()):
        return readings
    ring = readings.ring.copy()
    for port, owner in ports.items():
        ring[readings.ring == port] = owner
    return replace(readings, ring=ring)


def text(ports: Ports, names: Sequence[str], devices: Sequence[str]) -> str:
    """Say which ports are swapped, and which ring each belongs to, in one line."""
    each = (
        f"{devices[port]}, given for {names[port]}, belongs to {names[ring]}"
        for port, ring in sorted(ports.items())
    )
    return f"ports swapped: {'; '.join(each)}"
