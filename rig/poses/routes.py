"""Collision-free paths between poses: straight paths between known poses, joined into shortest
paths.

A roadmap (Kavraki et al. 1996, Probabilistic roadmaps for path planning): its nodes are clear
poses, its edges are straight paths in joint space on which every pose is clear too.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse.csgraph import shortest_path

from ...coverage.rings.ring import Setup
from ...objectives.scene import Scene
from ..sensing.expected import beams_at
from .clear import Good, clear, gaps, least_gaps
from .near_stops import MARGIN

STEP = np.radians(2.0)  # rad between tested poses of a path
SLACK = 0.01  # m, additional distance for planning
_NEIGHBOURS = 10  # of a node, tested for straight paths
_AT_ONCE = 2000  # poses
_SPARSE = 8  # steps between the poses of a path that are tested first


@dataclass(frozen=True)
class Clearance:
    """Tests whether poses are clear: the bodies keep their distances from each other and from the
    cell, and no sensor reads the cell closer than the distance that stops the robot. ``of`` is for
    planning and requires ``SLACK`` more.
    """

    scene: Scene
    """Robot, cell and limits."""
    setup: Setup
    """The rings as proposed."""

    def of(self, joints: Float[np.ndarray, "P J"]) -> Bool[np.ndarray, " P"]:
        """Return which poses are clear."""
        parts = [
            self._some(joints[i : i + _AT_ONCE], SLACK) for i in range(0, len(joints), _AT_ONCE)
        ]
        return np.concatenate(parts) if parts else np.zeros(0, bool)

    def _some(self, joints: Float[np.ndarray, "P J"], slack: float) -> Bool[np.ndarray, " P"]:
        good = np.array(
            clear(self.scene, joints, self.scene.motion.cell, self.scene.motion.own, slack)
        )
        if good.any() and self.scene.obstacles:
            good[good] = self._sensors(joints[good]) >= self.scene.motion.near + MARGIN + slack
        return good

    def _sensors(self, joints: Float[np.ndarray, "P J"]) -> Float[np.ndarray, " P"]:
        """Return the distance (P,) m of the nearest sensor from the cell."""
        apex = np.asarray(beams_at(self.scene, self.setup, joints).apex)
        each = [np.asarray(o.body(apex)) for o in self.scene.obstacles]
        least: np.ndarray = np.min(each, axis=0).reshape(len(joints), -1).min(axis=1)
        return least

    def fault(self, q: Float[np.ndarray, " J"], slack: float = 0.0) -> str | None:
        """Return why a pose is not clear with ``slack`` m more, or None."""
        if self._some(q[None], slack)[0]:
            return None
        names = [b.name for b in self.scene.robot.enclosed().bodies]
        obstacles = self.scene.obstacles
        motion = self.scene.motion
        if self.scene.robot.beyond(q) is not None:
            return f"joint {self.scene.robot.beyond(q)} is beyond its limits"
        own, cell = gaps(self.scene, q[None])
        own_least, cell_least = least_gaps(self.scene, motion.own, motion.cell, slack)
        pairs = list(itertools.combinations(names, 2))
        stands = [(o.name, name) for name in names for o in obstacles]
        for gap, words, least in ((cell[0], stands, cell_least), (own[0], pairs, own_least)):
            short = np.where(np.isfinite(least), least - gap, -np.inf)
            if len(short) and short.max() > 0:
                worst = int(short.argmax())
                there, here = words[worst]
                if least[worst] < 0:  # capsules that overlap at a pose of the scene, too
                    return (
                        f"{here} {-1000 * gap[worst]:.0f} mm into {there}, allowed: at most"
                        f" {-1000 * least[worst]:.0f} mm, as at the scene's poses"
                    )
                return (
                    f"{here} {1000 * max(gap[worst], 0.0):.0f} mm from {there}, allowed:"
                    f" {1000 * least[worst]:.0f} mm"
                )
        return f"a sensor closer to the cell than {1000 * (motion.near + MARGIN + slack):.0f} mm"


def straight(
    a: Float[np.ndarray, " J"], b: Float[np.ndarray, " J"], step: float = STEP
) -> Float[np.ndarray, "P J"]:
    """Return poses from ``a`` to ``b`` (J,) rad, both included, with steps of at most ``step`` rad
    in every joint.
    """
    poses: np.ndarray = a + np.linspace(0, 1, 2 + int(np.abs(b - a).max() / step))[:, None] * (
        b - a
    )
    return poses


def _all_clear(ways: Sequence[Float[np.ndarray, "_ J"]], good: Good) -> list[bool]:
    """Return for each path whether all its poses are clear."""
    if not ways:
        return []
    first = np.cumsum([0, *map(len, ways)])[:-1]
    kept: list[bool] = np.logical_and.reduceat(good(np.concatenate(ways)), first).tolist()
    return kept


class Roadmap:
    """Nodes (N, J) rad and the straight paths between neighbours that ``good`` accepts."""

    def __init__(self, nodes: Float[np.ndarray, "N J"], good: Good) -> None:
        self.nodes = nodes
        far = np.abs(nodes[:, None] - nodes[None]).max(axis=2)
        near = np.argsort(far, axis=1)[:, 1 : 1 + _NEIGHBOURS]
        pairs = sorted(
            {(min(a, int(b)), max(a, int(b))) for a in range(len(nodes)) for b in near[a]}
        )
        ways = [straight(nodes[a], nodes[b]) for a, b in pairs]
        for step in (_SPARSE, 1):  # few poses show most paths that are not clear
            kept = _all_clear([way[::step] for way in ways], good)
            pairs = [pair for pair, clear in zip(pairs, kept, strict=True) if clear]
            ways = [way for way, clear in zip(ways, kept, strict=True) if clear]
        edges = np.full(far.shape, np.inf)
        for a, b in pairs:
            edges[a, b] = edges[b, a] = max(far[a, b], 1e-9)
        self._far, self._before = shortest_path(edges, directed=False, return_predecessors=True)

    def reached(self, start: int) -> Int[np.ndarray, " R"]:
        """Return the nodes to which a path leads from ``start``, itself among them."""
        return np.flatnonzero(np.isfinite(self._far[start]))

    def way(self, start: int, goal: int) -> list[int] | None:
        """Return the nodes after ``start`` up to ``goal``; None if there is no path."""
        if not np.isfinite(self._far[start, goal]):
            return None
        nodes = [goal] * (start != goal)
        while nodes and (before := int(self._before[start, nodes[0]])) != start:
            nodes.insert(0, before)
        return nodes

    def order(self, start: int, wanted: Sequence[int]) -> list[int]:
        """Return the reachable nodes of ``wanted``, each the nearest of those left."""
        left, ordered = [n for n in wanted if np.isfinite(self._far[start, n])], list[int]()
        while left:
            ordered.append(min(left, key=lambda n: self._far[ordered[-1] if ordered else start, n]))
            left.remove(ordered[-1])
        return ordered
