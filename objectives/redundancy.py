"""Redundancy of a setup: k-coverage, and coverage after the loss of a sensor or ring."""

from collections.abc import Callable
from typing import Annotated

import numpy as np

from ..coverage.definitions.definition import definition
from ..coverage.definitions.field_types import Items, Metres
from ..coverage.definitions.records import JsonRecord
from ..coverage.definitions.units import Covered
from ..coverage.rings.ring import Setup
from ..coverage.targets.target import Target
from ..coverage.voxels.k_coverage import CoverageCounts, tally
from .occlusion import setup_sight
from .verified import OfTarget, TargetName, Zeta, weighted_mean
from .verify import Verifier

MOST = 3  # default maximum number of sensors that are counted at a point


@definition(kw_only=True)
class Loss:
    """Coverage after the loss of a ring or a sensor."""

    ring: int
    """Number of the ring, counted from 0; single sensors follow the rings."""
    link: str
    """Link of the ring or single sensor."""
    sensor: int | None = None
    """Number of the sensor on its ring, counted from 0."""
    single: str = ""
    """Name of a single sensor; empty for a ring and its sensors."""
    zeta: Zeta
    """Coverage without it."""


@definition(kw_only=True)
class Redundancy(OfTarget, JsonRecord):
    """Redundancy for one target, counted at one point in each voxel.

    Shares are weighted means over poses. A failed sensor is lost in all poses, so each loss is
    averaged over the poses before the worst is taken. Sensors of the cell are not lost.
    """

    setup: str = ""
    """Name or file of the setup."""
    target: TargetName
    """The target volume; from a file, its name."""
    radius: float | None = None
    """Radius of V_S or V_N, m."""
    voxel: Metres
    """Side of the voxels, m."""
    zeta: Zeta
    """Coverage."""
    seen: Items[Annotated[float, Covered("seen_percent")]]
    """Shares that at least 1, 2, ... sensors see."""
    worst_sensor: Loss
    """Sensor whose loss costs most."""
    worst_ring: Loss
    """Ring whose loss costs most."""
    without_sensor: Items[Annotated[float, Covered("without_sensor_percent")]]
    """Coverage without each sensor."""
    without_ring: Items[Annotated[float, Covered("without_ring_percent")]]
    """Coverage without each ring."""


def redundancy(verifier: Verifier, setup: Setup, target: Target, most: int = MOST) -> Redundancy:
    """Return the k-coverage of ``target`` up to k = ``most``, and zeta after each single loss.

    Losses are those of each sensor and of each ring. One octree descent per pose counts them all.

    Raises:
        ValueError: if the target is empty, ``most`` is below 1, or the rule is ``touch`` or
            ``certified``.
        TooFineError: if the count would take days.
        BodilessError: if the occlusion model needs the robot's bodies and the robot has none.
    """
    scene, sampled = verifier.scene, verifier.points == "sampled"
    ring = scene.with_cell(setup).ring_of_sensor
    voxels, tallies = [], []
    for p, pose in enumerate(scene.poses):
        seen = setup_sight(scene, setup, pose.q)
        sizes, parts = zip(
            *(
                (weight * len(wanted), tally(seen, ring, wanted, most, region, sampled) * weight)
                for piece, region in verifier.pieces(target, p)
                for weight, wanted in verifier.layers(target, p, piece, region)
            ),
            strict=True,
        )
        voxels.append(sum(sizes))
        tallies.append(sum(parts[1:], parts[0]))

    def mean(counts: Callable[[CoverageCounts], np.ndarray]) -> np.ndarray:
        shares = np.stack([counts(t) for t in tallies]) / np.array(voxels)[:, None]
        return np.array([weighted_mean(scene.pose_weights, column) for column in shares.T])

    zetas = mean(lambda t: t.at_least)
    without_sensor = (zetas[0] - mean(lambda t: t.alone))[: setup.sensors]
    without_ring = (zetas[0] - mean(lambda t: t.alone_group))[: len(setup.groups)]

    def loss(zetas: np.ndarray, group: int, sensor: int | None = None) -> Loss:
        single = setup.group_name(group) if group >= len(setup.rings) else ""
        zeta, link = max(float(zetas.min()), 0.0), setup.groups[group].link
        return Loss(ring=group, link=link, sensor=sensor, single=single, zeta=zeta)

    lost = int(np.argmin(without_sensor))
    on = int(setup.ring_of_sensor[lost])
    first = sum(group.count for group in setup.groups[:on])
    return Redundancy(
        target=target,
        voxel=verifier.point_voxel,
        zeta=zetas[0],
        seen=tuple(zetas),
        worst_sensor=loss(without_sensor, on, lost - first),
        worst_ring=loss(without_ring, int(np.argmin(without_ring))),
        without_sensor=tuple(without_sensor),
        without_ring=tuple(without_ring),
    )
