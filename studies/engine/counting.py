"""The tasks that count: exact zeta of a setup, and its sensors that see next to nothing."""

import json
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from ...coverage.choices import Rule
from ...coverage.targets import Target
from ...objectives.occlusion import unseeing
from ...objectives.verify import Verifier
from .scenes import Rings, scene_from, setup_from
from .tasks import register


@lru_cache(maxsize=2)
def _verifier(scene: str, rule: Rule, voxel: float | None, width: float) -> Verifier:
    """The last ones are kept, with the voxels of their targets: cells side by side share them."""
    return Verifier(scene_from(json.loads(scene)), voxel, rule, width)


@register("zeta")
def zeta(
    scene: Mapping[str, Any],
    setup: str | Rings,
    target: str,
    radius: float | None,
    rule: Rule,
    voxel: float | None,
    width: float = 0.0,
) -> dict[str, Any]:
    """Exact zeta of a setup for one target, in percent with its bounds, the voxels counted, and the
    seconds it took.

    Raises:
        KeyboardInterrupt: also where Ctrl-C left an interval wider than was asked for: a study must
            not keep that.
    """
    verifier = _verifier(json.dumps(scene, sort_keys=True), rule, voxel, width)
    found = verifier.verify(setup_from(setup, verifier.scene), Target(target, radius))
    if any(pose.proof is not None and width > 0 and not pose.proof.reached for pose in found.poses):
        raise KeyboardInterrupt
    percents = {f"{key}_percent": 100 * getattr(found, key) for key in ("zeta", "low", "high")}
    return percents | {
        "target": found.target_voxels,
        "covered": found.covered_voxels,
        "seconds": found.seconds,
    }


@register("unseeing sensors")
def unseeing_sensors(scene: Mapping[str, Any], setup: str | Rings) -> int:
    """How many sensors of a setup see next to nothing at a pose, as the scene's occlusion has
    it.
    """
    where = scene_from(scene)
    return len({(u.ring, u.sensor) for u in unseeing(where, setup_from(setup, where))})
