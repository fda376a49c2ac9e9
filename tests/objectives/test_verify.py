"""Counts of a verifier: weighted poses, and several targets by one descent."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.rings.ring import named_setup
from place_rings.coverage.targets.named import ReachAndToolSpheres, ReachSphere, Shell, ToolSphere
from place_rings.objectives import verify_targets as module
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.objectives.target_voxels import TooFineError
from place_rings.objectives.verify import Verifier
from place_rings.objectives.verify_targets import verify_targets

from ..strategies.rings import poses, setups
from ..support import drawing


def test_too_fine_a_voxel_is_refused_before_it_is_tried():
    with pytest.raises(TooFineError):
        Verifier(Scene.paper(), 1e-5).verify(named_setup("n1_8_0"), Shell(0.5))


def test_mean_over_poses_is_weighted():
    poses = Pose(np.radians([0.0, -45, 60, -105, -90, 0]), 2.0), Pose(np.full(6, -0.9), 1.0)
    scene, setup = Scene.paper(poses=poses), named_setup("n2_16_25")
    verified = Verifier(scene, 0.1).verify(setup, ReachSphere())
    assert [p.weight for p in verified.poses] == pytest.approx([2 / 3, 1 / 3])
    mean = 2 / 3 * verified.poses[0].zeta + 1 / 3 * verified.poses[1].zeta
    assert verified.zeta == pytest.approx(mean)
    certified = Verifier(scene, 0.1, "certified").verify(setup, ReachSphere())
    assert certified.low < verified.zeta < certified.high
    assert certified.target_voxels is None


TARGETS = (Shell(0.5), ReachSphere(), ToolSphere(), ReachAndToolSpheres(), Shell(1.5))


@pytest.mark.slow
@settings(max_examples=4)
@given(
    st.tuples(poses(), poses()),
    setups(),
    st.sampled_from(["ignore", "shadow", "blind"]),
    st.sampled_from([None, 3e6]),
)
def test_targets_together_are_targets_one_by_one(angles, setup, occlusion, memory):
    """Whatever fits into memory: all targets, one at a time, or parts of one."""
    weighted = tuple(Pose(q, weight) for q, weight in zip(angles, (1.0, 2.0), strict=True))
    scene, voxel = replace(Scene.paper(), poses=weighted, occlusion=occlusion), 0.15
    alone = [Verifier(scene, voxel).verify(setup, target) for target in TARGETS]
    together = verify_targets(Verifier(scene, voxel, memory=memory), setup, TARGETS)
    assert [replace(v, seconds=0.0) for v in together] == [replace(v, seconds=0.0) for v in alone]


@pytest.mark.parametrize(("most", "descents"), [(1, 0), (2, 2), (31, 1)])
def test_a_descent_counts_at_most_so_many_targets(monkeypatch, most, descents):
    calls, real = [], module.count_each
    monkeypatch.setattr(module, "MOST_SETS", most)
    monkeypatch.setattr(module, "count_each", lambda *a: calls.append(1) or real(*a))
    setup = drawing.setup(np.random.default_rng(0))
    verify_targets(Verifier(Scene.paper(), 0.1), setup, TARGETS)
    assert len(calls) == descents


def test_an_empty_target_among_others_is_refused():
    setup = drawing.setup(np.random.default_rng(0))
    with pytest.raises(ValueError, match=r"V_S\(0.1501\)"):
        verify_targets(Verifier(Scene.paper(), 1.0), setup, (ReachSphere(), Shell(0.1501)))
