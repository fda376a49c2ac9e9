"""The global stage by gradients keeps the rules, finds more than its starts, and compiles once."""

from dataclasses import replace

import numpy as np
import place_rings as pr
import pytest
from place_rings.coverage.rings.ring import Setup
from place_rings.objectives.feasibility.violations import faults
from place_rings.objectives.named_layouts import ring_layout
from place_rings.objectives.parameterization import decode
from place_rings.objectives.soft_coverage import SoftCoverage
from place_rings.objectives.target_points import TargetPoints
from place_rings.placement.search import gradient_stage as stage
from place_rings.placement.search import search as searching
from place_rings.placement.search.gradient_stage import gradient_stage, suits
from place_rings.placement.search.schedule import Round
from place_rings.placement.space.design import Candidate, Space
from place_rings.placement.space.starts import fresh
from place_rings.placement.stop_token import StopToken

from ..support.searching import search

SCENES = {
    "paper": pr.Scene.paper(targets=[pr.Shell(0.5)]),
    "real mounts": pr.Scene(targets=[pr.Shell(0.5, weight=0.6), pr.Shell(1.0, weight=0.4)]),
}


def asked(name: str, points: int, seed: int = 0, poses: int = 1) -> tuple[Space, SoftCoverage]:
    """Return two rings of 8 sensors on each link, and the soft coverage."""
    core = SCENES[name]
    core = replace(core, poses=core.poses * poses)
    drawn = TargetPoints(core, points, seed)
    return Space(core, ring_layout(core, 2, 8)), SoftCoverage(core, drawn.terms, drawn.points)


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_candidates_keep_rules_and_improve(name: str) -> None:
    space, soft = asked(name, 2048)
    assert suits(space, soft.aim)
    some = gradient_stage(space, soft, [], 3, StopToken(np.inf), batch=6)
    rng = np.random.default_rng(5)
    for c in some:
        setup = space.setup(c)
        assert [ring.count for ring in setup.rings] == [ring.count for ring in space.layout.rings]
        assert [f for f in faults(space.scene, setup.rings) if len(f.rings) < 2] == []

    def share(c: Candidate) -> float:
        arrays, where = space.arrays(c)
        return soft.share(arrays, decode(where, space.values(c)))

    drawn = max(share(fresh(space, rng)) for _ in range(6))
    assert share(some[0]) > drawn


def test_rounds_seeds_and_points_share_one_compilation(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stage, "_STEPS", (2, 1, 3))
    monkeypatch.setattr(stage, "_POINTS", 16)
    compiled = []
    for seed in range(2):
        space, soft = asked("paper", 64, seed)
        gradient_stage(space, soft, [], seed, StopToken(np.inf), batch=2)
        compiled.append((stage._run._cache_size(), stage._judge._cache_size()))
    assert compiled[0] == compiled[1]


def test_gradients_follow_few_pairs_of_goal_and_pose() -> None:
    each = [asked("real mounts", 16, poses=poses) for poses in (1, 2, 3)]
    assert [suits(space, soft.aim) for space, soft in each] == [True, True, False]


def test_the_exchange_chooses_links_and_counts_beside_an_accelerator_too(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """On a GPU gradients found 56.5 % of V_S(1.5) with 80 sensors in the time of the exchange's
    61 %."""
    scene, few = SCENES["paper"], (Round(256, 2, 1, 4, 0.3, trials=4, library=40),)

    def found() -> Setup:
        return search(Space(scene, sensors=12), seed=3, schedule=few, voxel=0.05).setup

    without = found()
    monkeypatch.setattr(searching, "accelerated", lambda device: True)
    assert found() == without
