"""Itinerary: the paths between the robot's present pose and the poses of a check."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from ...coverage.rings.ring import Setup
from ...objectives.scene import Scene
from .clear import Good, drawn
from .near_stops import STEP, NearStops, near_stops
from .routes import Clearance, Roadmap, straight

_BETWEEN = 160  # intermediate poses for paths
_SAME = 1e-3  # rad; poses that near each other are one node
_FEWEST = 3  # poses


def _between(scene: Scene, seed: int, good: Good, wanted: int) -> Float[np.ndarray, "P J"]:
    """Return an itinerary's random poses, of which ``wanted`` are visited. A larger number begins
    with the same poses."""
    return drawn(scene, max(_BETWEEN, 2 * wanted), seed, good)


def reachable(scene: Scene, seed: int, good: Good, wanted: int = 0) -> Float[np.ndarray, "P J"]:
    """Return those of an itinerary's random poses to which a path leads from the scene's first
    pose, rad.

    Args:
        scene: robot, cell and limits.
        seed: of the random poses.
        good: decides which poses are clear.
        wanted: number of poses that will be chosen among them.

    Raises:
        ValueError: if there are fewer than three.
    """
    between = _between(scene, seed, good, wanted)
    found = Roadmap(np.concatenate([scene.poses[0].q[None], between]), good).reached(0)
    if len(found) < 1 + _FEWEST:
        raise ValueError(
            f"clear ways lead from the scene's first pose to {len(found) - 1} of {len(between)}"
            f" random poses, wanted: {_FEWEST}; state another pose first in [[poses]], or correct"
            " [[obstacles]] or the distances in [motion]"
        )
    poses: np.ndarray = between[found[1:] - 1]
    return poses


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
        scene: Scene,
        setup: Setup,
        start: Float[np.ndarray, " J"],
        parts: Sequence[Float[np.ndarray, "_ J"]],
        seed: int,
    ) -> None:
        self.clearance, self._scene, self._setup = Clearance(scene, setup), scene, setup
        self._start = start
        most, wanted = max(map(len, parts), default=0), [start[None], *map(self._here, parts)]
        between = self._here(_between(scene, seed, self.clearance.of, most))
        known = np.abs(between[:, None] - np.concatenate(wanted)).max(axis=2).min(axis=1) <= _SAME
        self.map = Roadmap(np.concatenate([*wanted, between[~known]]), self.clearance.of)
        self.at, self.reached, self.legs = 0, list[list[int]](), list[tuple[int, int]]()
        for joints in parts:
            self.reached.append(self.order(joints))
            for q in joints[self.reached[-1]]:
                self.legs += pairwise([self.at, *self.next(q)])
                self.at = self.node(q)
        self.at = 0

    def node(self, q: Float[np.ndarray, " J"]) -> int:
        """Return the node at a pose."""
        return int(np.abs(self.map.nodes - self._here(q)).max(axis=1).argmin())

    def _here(self, joints: Float[np.ndarray, "*batch J"]) -> Float[np.ndarray, "*batch J"]:
        """Return poses with the continuous joints wound as at the start."""
        return self._scene.robot.unwound(joints, self._start)

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
