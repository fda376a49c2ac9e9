"""Record of a simulation of approaches, as ``place-rings safety --json`` prints it."""

import time
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from ._safety_conditions import SafetyMotion, SafetyOptions
from .coverage.rings.ring import Setup, sensor_optics
from .coverage.robots.separation_distance import separation, stopping_time
from .formats.schema.sensor_records import sensor_records
from .formats.schema.separation_models import (
    DirectionModel,
    SafetyResult,
    SeparationModel,
    ShareModel,
)
from .objectives.scene import CoreScene
from .reporting.detection_page import DISCLAIMER
from .simulation.detection import Approaches, floor_of
from .simulation.motion_samples import STEP


def _share(approaches: Approaches, some: slice | np.ndarray = slice(None)) -> dict[str, float]:
    share, low, high = approaches.share(some)
    return {"percent": 100 * share, "low_percent": 100 * low, "high_percent": 100 * high}


def _by_direction(approaches: Approaches, directions: int) -> list[DirectionModel]:
    """Return the share of each sector that has an approach."""
    edges = np.linspace(0, 360, directions + 1)
    degrees = np.degrees(approaches.azimuth) % 360
    sector = np.clip(np.searchsorted(edges, degrees, side="right") - 1, 0, directions - 1)
    return [
        DirectionModel(
            from_deg=low,
            to_deg=high,
            approaches=int((sector == k).sum()),
            **_share(approaches, sector == k),
        )
        for k, (low, high) in enumerate(pairwise(edges))
        if (sector == k).any()
    ]


def _separation(scene: CoreScene, motion: SafetyMotion) -> SeparationModel:
    """Return the record of the separation distances."""
    terms, fastest = motion.safety, float(motion.full.speed.max())
    return SeparationModel.from_domain(
        separation(terms, fastest, stopping_time(terms, scene.robot.name, fastest)),
        least_m=float(motion.full.asked.min()),
        mean_m=float(motion.moments.weight @ motion.full.asked.mean(axis=1)),
        fastest_m_s=fastest,
        speeds_known=motion.moments.together or all(p.rate is not None for p in scene.poses),
        human_speed=terms.human,
        reaction_s=terms.reaction,
    )


def record_of(
    name: str,
    setup: Setup,
    scene: CoreScene,
    options: SafetyOptions,
    motion: SafetyMotion,
    simulated: Sequence[Approaches],
    began: float,
) -> SafetyResult:
    """Return the record of a simulation.

    Args:
        name: name of the setup.
        setup: the rings.
        scene: scene of the simulation.
        options: options of the simulation.
        motion: the moments of the motion.
        simulated: approaches to the setup, and to the same with a range that suffices.
        began: clock reading at the start, s.
    """
    first, moments, needed = simulated[0], motion.moments, motion.full.asked
    range_m = float(sensor_optics(setup)[1].min())
    suffices = float(motion.full.weight @ (needed.max(axis=1) <= range_m))
    reported = np.isfinite(first.report)
    return SafetyResult(
        setup=name,
        approaches=options.approaches,
        moments=len(moments.weight),
        seconds_of_motion=STEP * (len(moments.weight) - 1) if moments.together else None,
        in_time=ShareModel(**_share(first)),
        if_far_enough=ShareModel(**_share(simulated[1])) if len(simulated) > 1 else None,
        never_reported=int((~reported).sum()),
        nearest_report_m=float(np.nanmin(first.report)) if reported.any() else None,
        by_direction=_by_direction(first, options.directions),
        separation=_separation(scene, motion),
        separation_at_report_m=float(moments.asked.max()),
        period_s=float(motion.timing.period.max()),
        latency_s=options.latency,
        rate_assumed=motion.assumed,
        range_m=range_m,
        range_needed_m=float(needed.max()),
        range_suffices_percent=min(100 * suffices, 100.0),  # the weights' sum is rounded
        occlusion=options.occlusion,
        obstacles=[o.name for o in scene.obstacles],
        floor_m=floor_of(scene),
        seed=options.seed,
        sensors=sensor_records(setup),
        disclaimer=DISCLAIMER,
        seconds=time.perf_counter() - began,
    )
