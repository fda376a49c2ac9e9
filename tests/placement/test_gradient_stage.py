"""The global stage by gradients keeps the rules and the budget, and finds more than its starts."""

import numpy as np
import place_rings as pr
import pytest
from place_rings.objectives.feasibility.violations import faults
from place_rings.objectives.soft_coverage import SoftCoverage
from place_rings.objectives.target_points import TargetPoints
from place_rings.placement.search.gradient_stage import gradient_stage, suits
from place_rings.placement.space.design import Space
from place_rings.placement.space.starts import fresh
from place_rings.placement.stop_token import StopToken

SCENES = {
    "paper": pr.Scene.paper(targets=[pr.Shell(0.5)]),
    "real mounts": pr.Scene(targets=[pr.Shell(0.5, weight=0.6), pr.Shell(1.0, weight=0.4)]),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_candidates_keep_rules_and_budget_and_improve(name: str) -> None:
    core = SCENES[name].core
    space, points = Space(core, sensors=36), TargetPoints(core, 2048, 0)
    soft = SoftCoverage(core, points.terms, points.points)
    assert suits(space, soft)
    some = gradient_stage(space, soft, [], 3, StopToken(np.inf), batch=6)
    rng = np.random.default_rng(5)
    for c in some:
        setup = space.setup(c)
        assert setup.sensors == 36
        assert [f for f in faults(core, setup.rings) if len(f.rings) < 2] == []

    def share(c: object) -> float:
        return soft.share(space.arrays(c)[0], np.stack(pr_values(space, c)))

    drawn = max(share(fresh(space, rng)) for _ in range(6))
    assert share(some[0]) > drawn


def pr_values(space: Space, c: object) -> np.ndarray:
    """Return positions, tilts and phases of a candidate's rings."""
    from place_rings.objectives.parameterization import decode

    return decode(space.stretch(c), space.values(c))
