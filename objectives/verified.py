"""Records of zeta, counted or certified: of one target at one pose, and over all poses."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

from ..coverage.choices import Rule
from ..coverage.targets.target import Target
from ..coverage.voxels.volume_tally import Bracket


def weighted_mean(weights: Iterable[float], shares: Iterable[float]) -> float:
    """Return the weighted mean of shares in [0, 1], capped at 1.

    The weights sum to 1 up to rounding, which could otherwise raise the mean above 1.
    """
    return min(
        math.fsum(float(w) * float(share) for w, share in zip(weights, shares, strict=True)), 1.0
    )


@dataclass(frozen=True)
class PoseZeta:
    """Zeta at one pose."""

    weight: float
    """Weight of the pose in the mean."""
    zeta: float
    """Zeta in [0, 1]; the middle of the interval for the rule ``certified``."""
    low: float
    """Lower bound of zeta; equals ``zeta`` unless the rule is ``certified``."""
    high: float
    """Upper bound of zeta; equals ``zeta`` unless the rule is ``certified``."""
    target_voxels: int | None
    """Voxels of the target; None for the rule ``certified``."""
    covered_voxels: int | None
    """Covered voxels of the target; None for the rule ``certified``."""
    proof: Bracket | None = None
    """How the bounds were computed, for the rule ``certified``."""
    error: float | None = None
    """Computed error of ``zeta``: 3.3 standard deviations for the rule ``sampled``, half of the
    interval for ``certified``, and None, not known, for the others."""


@dataclass(frozen=True)
class Verified:
    """Zeta of one target: the weighted mean over poses, and the value at each pose."""

    target: Target
    """The target volume."""
    rule: Rule
    """How voxels were counted."""
    voxel: float | None
    """Side of the voxels, m, if any."""
    zeta: float
    """Weighted mean over the poses, in [0, 1]."""
    low: float
    """Lower bound of zeta."""
    high: float
    """Upper bound of zeta."""
    poses: tuple[PoseZeta, ...]
    """Zeta at each pose."""
    seconds: float
    """Computation time, s."""
    width: float = 0.0
    """Requested width of a certified interval."""

    @property
    def error(self) -> float | None:
        """Computed error of ``zeta``: the mean of the poses' errors, as these are not independent;
        None if not known.
        """
        errors = [p.error for p in self.poses]
        if self.rule == "certified":
            return (self.high - self.low) / 2
        if any(error is None for error in errors):
            return None
        return weighted_mean([p.weight for p in self.poses], [e or 0.0 for e in errors])

    @property
    def worst(self) -> int:
        """The pose with the smallest zeta; the first of equals."""
        return min(range(len(self.poses)), key=lambda i: self.poses[i].zeta)

    @property
    def target_voxels(self) -> int | None:
        """Voxels of the target, summed over the poses."""
        return None if self.rule == "certified" else sum(p.target_voxels or 0 for p in self.poses)

    @property
    def covered_voxels(self) -> int | None:
        """Covered voxels of the target, summed over the poses."""
        return None if self.rule == "certified" else sum(p.covered_voxels or 0 for p in self.poses)
