"""Records of results: what was counted, proven and measured, in percent."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...coverage.rings.mounting_errors import MountingErrors
from ...coverage.rings.ring import Setup
from ...coverage.rings.rounding import degrees
from ...coverage.robots.separation_distance import Safety, Terms
from ...coverage.targets import Target
from ...objectives.criterion import Criterion
from ...objectives.redundancy import Loss, Redundancy
from ...objectives.scene import Pose, Scene
from ...objectives.separation_summary import separations
from ...objectives.tolerance import Tolerance
from ...objectives.verify import PoseZeta, Verified
from ..schema.result_models import (
    ErrorsModel,
    LossModel,
    PoseZetaModel,
    ProofModel,
    RobustnessResult,
    SeparationModel,
    VerifyResult,
    WorstModel,
)


def verify_result(name: str, verified: Verified, scene: Scene | None = None) -> VerifyResult:
    """The record of a verified zeta, in percent, of the setup called ``name``; the ``scene`` tells
    more of the worst of its poses, and of the distances that V_P is made of."""
    poses: Sequence[Pose] = () if scene is None else scene.poses

    def percents(z: Verified | PoseZeta) -> dict[str, Any]:
        return {
            f"{key}_percent": min(100.0, 100 * getattr(z, key)) for key in ("zeta", "low", "high")
        }

    return VerifyResult(
        setup=name,
        target=verified.target.name,
        radius=verified.target.radius,
        rule=verified.rule,
        voxel=verified.voxel,
        **percents(verified),
        target_voxels=verified.target_voxels,
        covered_voxels=verified.covered_voxels,
        proof=_proof(verified),
        separation=_separation(scene, verified.target),
        worst=WorstModel(
            pose=verified.worst,
            time_s=poses[verified.worst].time_s,
            q_deg=[degrees(a) for a in poses[verified.worst].q],
            **percents(verified.poses[verified.worst]),
        )
        if len(poses) > 1
        else None,
        poses=[
            PoseZetaModel(
                weight=p.weight,
                **percents(p),
                target_voxels=p.target_voxels,
                covered_voxels=p.covered_voxels,
            )
            for p in verified.poses
        ],
        seconds=verified.seconds,
    )


def _separation(scene: Scene | None, target: Target) -> SeparationModel | None:
    found = None if scene is None else separations(scene, target)
    if found is None or scene is None:
        return None
    known = all(p.rate is not None for p in scene.poses)
    return separation_model(
        found.least, found.mean, found.largest, found.fastest, known, scene.safety
    )


def separation_model(
    least: float, mean: float, largest: Terms, fastest: float, known: bool, safety: Safety
) -> SeparationModel:
    """The record of separation distances."""
    return SeparationModel(
        least_m=least,
        mean_m=mean,
        largest_m=largest.total,
        fastest_m_s=fastest,
        speeds_known=known,
        S_h=largest.S_h,
        S_r=largest.S_r,
        S_s=largest.S_s,
        C=largest.C,
        Z_d=largest.Z_d,
        Z_r=largest.Z_r,
        human_speed=safety.human,
        reaction_s=safety.reaction,
        stopping_s=largest.stopping,
    )


def _proof(verified: Verified) -> ProofModel | None:
    proofs = [p.proof for p in verified.poses if p.proof is not None]
    if not proofs:
        return None
    return ProofModel(
        width_percent=100 * verified.width,
        reached=all(p.reached for p in proofs),
        passes=max(p.passes for p in proofs),
        cells=sum(p.cells for p in proofs),
        smallest=min(p.smallest for p in proofs),
    )


def errors_model(errors: MountingErrors, draws: int, seed: int) -> ErrorsModel:
    """Errors of mounting as a file holds them."""
    return ErrorsModel(
        position_mm=round(1000 * errors.position, 9),
        direction_deg=degrees(errors.direction),
        law=errors.law,
        draws=draws,
        seed=seed,
    )


def tolerant_model(aim: Criterion) -> ErrorsModel | None:
    """The errors that a search kept in mind, if any."""
    return errors_model(aim.errors, aim.draws, aim.seed) if aim.errors else None


def robustness_result(
    name: str, setup: Setup, sure: Redundancy, astray: Tolerance
) -> RobustnessResult:
    """The record of redundancy and tolerance, in percent, of the setup called ``name``."""
    ring_of, first = setup.ring_of_sensor, np.cumsum([0, *(r.count for r in setup.rings)])

    def loss(ring: int, found: Loss, sensor: int | None = None) -> LossModel:
        return LossModel(
            ring=ring, link=setup.rings[ring].link, sensor=sensor, zeta_percent=_percent(found.zeta)
        )

    sensor, ring = sure.worst_sensor, sure.worst_ring
    at = int(ring_of[sensor.index])
    return RobustnessResult(
        setup=name,
        target=sure.target.name,
        radius=sure.target.radius,
        voxel=sure.voxel,
        zeta_percent=_percent(sure.zeta),
        seen_percent=[_percent(z) for z in sure.zetas],
        worst_sensor=loss(at, sensor, sensor.index - int(first[at])),
        worst_ring=loss(ring.index, ring),
        without_sensor_percent=[_percent(z) for z in sure.without_sensor],
        without_ring_percent=[_percent(z) for z in sure.without_ring],
        errors=errors_model(astray.errors, len(astray.zetas), astray.seed),
        mean_percent=_percent(astray.mean),
        mean_error_percent=100 * astray.mean_error if math.isfinite(astray.mean_error) else None,
        fifth_percentile_percent=_percent(astray.fifth_percentile),
        worst_percent=_percent(astray.worst),
        drawn_percent=[_percent(z) for z in astray.zetas],
        seconds=sure.seconds + astray.seconds,
    )


def _percent(share: float) -> float:
    return min(max(100 * float(share), 0.0), 100.0)
