"""Rings of different links that come too near to each other at a pose.

No segment keeps such rings apart; a search never enters the setups in which they are.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float, Int

from ...coverage.rings.ring import Ring
from ...coverage.rings.ring_envelope import Envelope
from ...objectives.feasibility.clearance import MountClearance
from ...objectives.feasibility.mounting import meeting
from ...objectives.feasibility.ring_envelopes import envelope


class Collisions:
    """Finds new rings that collide with rings of other links, new or fixed."""

    def __init__(
        self, clear: MountClearance, radii: Mapping[str, float], fixed: Sequence[Ring]
    ) -> None:
        """Use the radius of new rings on each link, m."""
        self._clear, self._fixed = clear, fixed
        mounts = [clear.scene.robot.mount(link) for link in radii]
        frames = [clear.frames[:, m.frame] for m in mounts]  # (P, 4, 4) each
        self._start, self._way = (
            np.array([f[:, :3, :3] @ np.asarray(v) for f, v in zip(frames, each, strict=True)])
            for each in ([m.start for m in mounts], [m.length * m.axis for m in mounts])
        )  # (L, P, 3), base frame
        self._start += np.array([f[:, :3, 3] for f in frames])
        self._ball = np.array([_ball(clear.widest(*pair)) for pair in radii.items()])
        links = list(radii)
        self._held = np.array([links.index(ring.link) for ring in fixed], int)
        self._held_at = np.array([ring.position for ring in fixed])
        self._held_ball = np.array([_ball(envelope(clear.scene, ring)) for ring in fixed])

    def possible(self, link: Int[np.ndarray, " R"], position: Float[np.ndarray, " R"]) -> bool:
        """Return whether balls about rings on the links of these numbers meet at a pose: if not,
        the rings do not collide."""
        new, every = len(link), np.concatenate([link, self._held])
        at = np.concatenate([position, self._held_at])[:, None, None]
        ball = np.concatenate([self._ball[link], self._held_ball])
        centre = self._start[every] + at * self._way[every]  # (N, P, 3)
        for i in range(new - 1, -1, -1):
            others = i + 1 + np.flatnonzero(every[i + 1 :] != every[i])
            off = centre[others] - centre[i]
            least = ball[others] + ball[i] + self._clear.scene.rules.clearance
            if (np.einsum("npc,npc->np", off, off) < (least * least)[:, None]).any():
                return True
        return False

    def among(self, rings: Sequence[Ring]) -> str | None:
        """Return the first collision, as text; None without one, or only among fixed rings."""
        held = {i for i, ring in enumerate(rings) if ring in self._fixed}
        faults = meeting(self._clear, rings)
        return next((fault.text for fault in faults if not set(fault.rings) <= held), None)


def _ball(around: Envelope) -> float:
    """Return the radius of a ball about the middle of a ring's lenses that holds its envelope."""
    return math.hypot(max(-around.low, around.high), around.outer)
