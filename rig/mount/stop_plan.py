"""Where a robot should stand so that its rings' readings tell how they are mounted.

A sensor returns the nearest point in its beam: of a wall met square that point is the foot of the
perpendicular, wherever the beam points, and its distance tells nothing of a tilt within half the
beam. Oblique surfaces and edges do tell. So poses are chosen by what they tell: of many clear ones,
one by one, that which adds most to the information about the rings' errors, the sum of their log
determinants (D-optimal; Fedorov, Theory of Optimal Experiments, 1972), over the setup as proposed
and a few drawn mountings of it, as the real one is not known yet. That a mount is careful is
counted in.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...coverage.rings.ring import Setup
from ...objectives.scene import Scene
from ..poses.clear import Good, drawn
from ..sensing.expected import CELL, expected
from ..sensing.noise import Noise
from .model import LIMITS, NAMES, free, grazing, moved, slopes

POSES, FRAMES = 24, 10
_CANDIDATES, _DRAWS = 240, 2
_MEDIAN = np.pi / 2  # variance of a median of normal numbers over that of their mean
# of what a careful mount keeps within: an error known no better counts as not observable
OPEN = 0.5


@dataclass(frozen=True)
class MountPlan:
    """P stops, joints (P, J) rad in the order to be driven, with so many ``frames`` each;
    information (R, 4, 4): of each ring's ``NAMES``, in units of ``LIMITS`` to the power of minus 2,
    what is known beforehand left out."""

    joints: Float[np.ndarray, "P J"]
    frames: int
    information: Float[np.ndarray, "R 4 4"]

    def deviations(self) -> Float[np.ndarray, "R 4"]:
        """Standard deviations (R, 4) of ``NAMES`` that are to be expected, m and rad, by what these
        poses tell alone; infinite where they tell nothing."""
        value, vector = np.linalg.eigh(self.information)
        variance = (vector**2 / np.maximum(value, 1e-12)[:, None]).sum(axis=2)
        deviation: np.ndarray = np.where(variance < 1e9, np.sqrt(variance), np.inf) * LIMITS
        return deviation

    def unobservable(self, scene: Scene, setup: Setup) -> list[tuple[int, str]]:
        """Rings and those of their errors which these poses leave open."""
        sd = self.deviations()
        return [
            (i, NAMES[k])
            for i, ring in enumerate(setup.rings)
            for k in free(scene, ring)
            if sd[i, k] > OPEN * LIMITS[k]
        ]

    def text(self, scene: Scene, setup: Setup) -> list[str]:
        """What is to be expected, and what stays open, in lines."""
        scale = np.array([1000, *np.degrees([1, 1]), 1000])
        unit, lines = ("mm", "°", "°", "mm"), []
        for i, (ring, sd) in enumerate(zip(setup.rings, self.deviations() * scale, strict=True)):
            known = ", ".join(
                f"{NAMES[k]} ± {1.96 * sd[k]:.2g} {unit[k]}" for k in free(scene, ring)
            )
            lines.append(f"ring {i} ({ring.link}): to be known within {known}")
        for i, name in self.unobservable(scene, setup):
            lines.append(
                f"ring {i} ({setup.rings[i].link}): {name} is not observable in this cell from"
                " these poses"
            )
        return lines


def planned(
    scene: Scene,
    setup: Setup,
    poses: int = POSES,
    frames: int = FRAMES,
    noise: Noise | None = None,
    seed: int = 0,
    candidates: int = _CANDIDATES,
    good: Good | None = None,
) -> MountPlan:
    """The stops of a mount check.

    Args:
        scene: with the known cell: floor, table, boxes.
        setup: as proposed.
        poses: how many stops.
        frames: read at each.
        noise: of the sensors.
        seed: of drawn poses and mountings.
        candidates: clear poses to choose from. good: which poses are clear, where another rule is
            given.

    Raises:
        ValueError: if the cell holds nothing to be seen, or leaves no clear poses.
    """
    if not scene.obstacles:
        raise ValueError(
            "the scene has no obstacles; a mount check needs a known cell: a floor, a table, boxes"
        )
    noise, joints = noise or Noise(), drawn(scene, candidates, seed, good)
    rng, parts = np.random.default_rng((seed, 1)), []
    for draw in range(1 + _DRAWS):
        errors = rng.uniform(-1, 1, (len(setup.rings), 4)) * LIMITS * (draw > 0)
        parts.append(_information(scene, setup, joints, errors, noise, frames))
    each = np.mean(parts, axis=0)
    total = np.tile(np.eye(4), (len(setup.rings), 1, 1))
    chosen: list[int] = []
    for _ in range(min(poses, len(joints))):
        value = np.linalg.slogdet(total + each)[1].sum(axis=1)
        value[chosen] = -np.inf
        chosen.append(int(value.argmax()))
        total = total + each[chosen[-1]]
    order = _short_way(joints[chosen], scene.poses[0].q)
    return MountPlan(joints[chosen][order], frames, total - np.eye(4))


def _information(
    scene: Scene,
    setup: Setup,
    joints: Float[np.ndarray, "C J"],
    errors: Float[np.ndarray, "R 4"],
    noise: Noise,
    frames: int,
) -> Float[np.ndarray, "C R 4 4"]:
    """What each pose tells of each ring mounted with these errors, in units of ``LIMITS``."""
    rings = tuple(moved(scene, r, e) for r, e in zip(setup.rings, errors, strict=True))
    seen, first = expected(scene, Setup(rings), joints), np.cumsum([0, *(r.count for r in rings)])
    found = np.zeros((len(joints), len(rings), 4, 4))
    for i, ring in enumerate(rings):
        which = seen.what[:, first[i] : first[i + 1]] == CELL
        distance, by = slopes(scene, ring, joints, which)
        by = np.where(
            grazing(by)[:, None],
            0.0,
            by * LIMITS / (noise.at(distance) * np.sqrt(_MEDIAN / frames))[:, None],
        )
        if len(free(scene, ring)) < 4:
            by[:, 0] = 0.0
        np.add.at(found[:, i], np.nonzero(which)[0], by[:, :, None] * by[:, None, :])
    return found


def _short_way(joints: Float[np.ndarray, "P J"], start: Float[np.ndarray, " J"]) -> list[int]:
    """An order in which each pose is the nearest of those left, by the joint that turns
    farthest.
    """
    left, at, order = list(range(len(joints))), start, []
    while left:
        order.append(min(left, key=lambda i: np.abs(joints[i] - at).max()))
        left.remove(order[-1])
        at = joints[order[-1]]
    return order
