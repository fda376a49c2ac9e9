"""Itinerary: the paths between the robot's present pose and the poses of a check."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from ...coverage.rings.ring import Setup
from ...objectives.scene import CoreScene
from .clear import drawn
from .near_stops import STEP, NearStops, near_stops
from .routes import Clearance, Roadmap, straight

_BETWEEN = 60  # intermediate poses for paths


class Itinerary:
    """The paths between the robot's present pose and the poses of a check.

    Args:
        scene: robot, cell and limits.
        setup: the rings as proposed.
        start: (J,) rad, present pose of the robot.
        parts: for each part of the check, in order, its poses (P, J) rad.
        seed: of the random intermediate poses.
    """

    def __init__(
        self,
        scene: CoreScene,
        setup: Setup,
        start: Float[np.ndarray, " J"],
        parts: Sequence[Float[np.ndarray, "_ J"]],
        seed: int,
    ) -> None:
        self.clearance, self._scene, self._setup = Clearance(scene, setup), scene, setup
        between = drawn(scene, _BETWEEN, seed, self.clearance.of)
        self.map = Roadmap(np.concatenate([start[None], *parts, between]), self.clearance.of)
        self.at, self.reached, self.legs = 0, list[list[int]](), list[tuple[int, int]]()
        for joints in parts:
            self.reached.append(self.order(joints))
            for q in joints[self.reached[-1]]:
                self.legs += pairwise([self.at, *self.next(q)])
                self.at = self.node(q)
        self.at = 0

    def node(self, q: Float[np.ndarray, " J"]) -> int:
        """Return the node at a pose."""
        return int(np.abs(self.map.nodes - q).max(axis=1).argmin())

    def order(self, joints: Float[np.ndarray, "P J"]) -> list[int]:
        """Return the reachable poses among P, each the nearest of those left."""
        nodes = {self.node(q): i for i, q in enumerate(joints)}
        return [nodes[n] for n in self.map.order(self.at, list(nodes))]

    def next(self, q: Float[np.ndarray, " J"]) -> list[int]:
        """Return the nodes on the path to a pose."""
        return self.map.way(self.at, self.node(q)) or []

    def near_stops(self) -> NearStops:
        """Return the near stops along the whole route."""
        ways = [straight(self.map.nodes[a], self.map.nodes[b], STEP) for a, b in self.legs]
        return near_stops(self._scene, self._setup, np.concatenate([self.map.nodes[:1], *ways]))

    def near_stops_to(self, node: int, q: Float[np.ndarray, " J"]) -> NearStops:
        """Return the near stops along the path to a node from the robot's actual pose ``q`` (J,)
        rad.
        """
        return near_stops(self._scene, self._setup, straight(q, self.map.nodes[node], STEP))
