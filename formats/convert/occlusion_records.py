"""Records of what occlusion takes: zeta under all models side by side, and the sensors that see
nothing.
"""

from ...coverage.occlusion.model import Occlusion
from ...objectives.occlusion import Unseeing
from ...objectives.scene import Scene
from ..schema.result_models import UnseeingModel, VerifyResult


def with_sight(
    result: VerifyResult,
    scene: Scene,
    zetas: dict[Occlusion, float],
    blocked: list[Unseeing] | None = None,
) -> VerifyResult:
    """``result`` with the model that the scene names, zeta in [0, 1] under each, and the sensors
    that see nothing.
    """
    percents = {name: min(max(100 * zeta, 0.0), 100.0) for name, zeta in zetas.items()}
    return result.model_copy(
        update={
            "occlusion": scene.occlusion,
            "by_occlusion_percent": percents,
            "unseeing": [_model(one) for one in blocked or []],
        }
    )


def _model(one: Unseeing) -> UnseeingModel:
    return UnseeingModel(
        ring=one.ring,
        sensor=one.sensor,
        poses=len(one.poses),
        within=one.within,
        depth_mm=round(1000 * one.depth, 3),
    )
