"""Zeta of a setup under all three models of occlusion, beside the one that was asked for."""

from ..coverage.occlusion.model import OCCLUSIONS, Occlusion
from ..coverage.rings.ring import Setup
from .exact import Verified, Verifier


def by_occlusion(verifier: Verifier, setup: Setup, known: Verified) -> dict[Occlusion, float]:
    """Zeta in [0, 1] of ``setup`` for the target of ``known`` under each model, by the same voxels; ``known`` under its own.

    None where the robot has no bodies, or where the rule is certified: an interval is made for one model at a time.
    """
    scene = verifier.scene
    if not scene.robot.bodies or verifier.rule == "certified":
        return {}
    return {
        occlusion: known.zeta if occlusion == scene.occlusion else verifier.under(occlusion).verify(setup, known.target).zeta
        for occlusion in OCCLUSIONS
    }
