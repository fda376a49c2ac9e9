"""A study of convergence with few and coarse measurements."""

import pytest
from place_rings.coverage.targets.named import ReachAndToolSpheres, Shell
from place_rings.studies.convergence import report, study


def make_coarse(patch: pytest.MonkeyPatch) -> None:
    """Let the study measure one setup with two voxels for two targets."""
    patch.setattr(study, "SETUPS", ("n3_16_55",))
    patch.setattr(study, "VOXELS", (0.1, 0.05))
    patch.setattr(study, "TOUCH_FROM", 0.05)
    patch.setattr(study, "TRUTH_WIDTH", 5e-2)
    for module in (study, report):
        patch.setattr(module, "TARGETS", (Shell(0.5), ReachAndToolSpheres()))
