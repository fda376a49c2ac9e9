"""Prismatic joints: an arm on a rail is the same arm elsewhere, in every number; and its
derivatives, speeds, counts and gradients by slower ways.
"""

import jax
import numpy as np
import pytest
import yourdfpy
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.robots.built_in import ROBOTS, UR10
from place_rings.coverage.robots.joint_values import in_file_units, named, ordered, radians_of
from place_rings.coverage.robots.kinematics import arm_base, forward, joint_origins
from place_rings.coverage.robots.link_bodies import robot_capsules
from place_rings.coverage.robots.protective_volume import moving
from place_rings.coverage.targets.named import ReachAndToolSpheres, ReachSphere, Shell, ToolSphere
from place_rings.coverage.targets.solid import target_solid
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import Verifier
from place_rings.placement.space.design import Space
from place_rings.placement.space.starts import fresh

from ..strategies.rings import LONGEST, ROBOT_NAMES, poses
from ..strategies.units import GENERATORS
from ..support.rails import carried, rail_ur10
from ..support.urdf_text import chain_text, drawn_chain

AXES = GENERATORS.map(lambda rng: rng.normal(size=3))
PLACES = st.integers(-1500, 2000).map(lambda mm: mm / 1000)


@settings(max_examples=10)
@given(GENERATORS)
def test_kinematics_are_yourdfpys(tmp_path_factory, rng):
    """Drawn chains of revolute and prismatic joints, at twenty poses each."""
    chain = drawn_chain(rng)
    path = tmp_path_factory.mktemp("chain") / "drawn.urdf"
    path.write_text(chain_text(chain))
    peer = yourdfpy.URDF.load(str(path), load_meshes=False, build_scene_graph=True)
    for q in rng.uniform(-2, 2, (20, len(chain))):
        peer.update_cfg(dict(zip(chain.joints, q, strict=True)))
        found = forward(chain, q)
        for j in range(len(chain)):
            wanted = peer.get_transform(f"link_{j}", "base")
            np.testing.assert_allclose(found[j], wanted, atol=1e-6)
        np.testing.assert_allclose(found[-1], peer.get_transform("tip", "base"), atol=1e-6)


@pytest.mark.parametrize("seed", range(2))
def test_derivatives_are_differences(seed):
    rng = np.random.default_rng(seed)
    drawn = (drawn_chain(rng) for _ in range(100))
    chain = next(c for c in drawn if len(c) == 4 and len(c.prismatic) in (1, 2))
    q, step = rng.uniform(-2, 2, len(chain)), 1e-6
    slope = jax.jacfwd(lambda q: forward(chain, q))(jax.numpy.asarray(q))
    for j, unit in enumerate(np.eye(len(chain))):
        difference = (forward(chain, q + step * unit) - forward(chain, q - step * unit)) / (
            2 * step
        )
        np.testing.assert_allclose(slope[..., j], difference, atol=1e-8)


@given(ROBOT_NAMES, poses(LONGEST), PLACES, AXES)
@settings(max_examples=20)
def test_the_carriage_carries_frames_curve_and_bodies(name, q, place, axis):
    robot = ROBOTS[name]
    rail, q = carried(robot, axis), q[: len(robot.chain)]
    way, moved = place * axis / np.linalg.norm(axis), np.append(place, q)
    frames = forward(rail.chain, moved)
    np.testing.assert_allclose(frames[0, :3, 3], way, atol=1e-12)
    np.testing.assert_allclose(frames[1:, :3, :3], forward(robot.chain, q)[:, :3, :3], atol=1e-12)
    np.testing.assert_allclose(
        frames[1:, :3, 3], forward(robot.chain, q)[:, :3, 3] + way, atol=1e-12
    )
    np.testing.assert_allclose(arm_base(rail.chain, moved), way, atol=1e-12)
    np.testing.assert_allclose(
        joint_origins(rail.chain, moved), joint_origins(robot.chain, q) + way, atol=1e-9
    )
    if robot.bodies:
        here = robot_capsules(rail, frames)
        there = robot_capsules(robot, forward(robot.chain, q))
        np.testing.assert_allclose(here.start, there.start + way, atol=1e-12)


@given(
    st.sampled_from([Shell(0.5), ReachSphere(), ToolSphere(), ReachAndToolSpheres()]),
    poses(),
    PLACES,
    AXES,
    GENERATORS,
)
@settings(max_examples=20)
def test_targets_move_with_the_carriage(target, q, place, axis, rng):
    way = place * axis / np.linalg.norm(axis)
    solid = target_solid(target, UR10, q)
    moved = target_solid(target, carried(UR10, axis), np.append(place, q))
    points = rng.uniform(-1.5, 1.5, (500, 3))
    np.testing.assert_allclose(moved(points + way), solid(points), atol=1e-9)


def test_a_carriage_alone_moves_every_part_at_its_speed():
    rail = rail_ur10()
    rate = np.zeros(7)
    rate[0] = 0.4
    assert moving(rail, rail.rest, rate).speed == pytest.approx(0.4)


def test_coverage_on_a_rail_is_that_of_the_arm_alone():
    """With self-occlusion and real rings, at a place of the carriage on the lattice."""
    arm, voxel = ROBOTS["ur10"].with_links(True), 0.05
    rules, goals = Rules(mount="real"), (Shell(0.5), ReachSphere())
    alone = Scene(arm, poses=(Pose(arm.rest),), targets=goals, rules=rules, occlusion="shadow")
    rail = carried(arm)
    at = (Pose(np.append(12 * voxel, arm.rest)),)
    on = Scene(rail, poses=at, targets=goals, rules=rules, occlusion="shadow")
    space = Space(alone, sensors=16)
    setup = space.setup(fresh(space, np.random.default_rng(0)))
    for goal in goals:
        here, there = (
            Verifier(s, voxel, "centre").verify(setup, goal.target).zeta for s in (alone, on)
        )
        assert here == pytest.approx(there, abs=2e-4)


@given(GENERATORS)
def test_values_by_name_come_back(rng):
    chain = drawn_chain(rng)
    q = rng.uniform(-1, 1, len(chain))
    table = named(chain, q)
    assert [key.rsplit("_", 1)[1] for key in table] == ["m" if s else "deg" for s in chain.slides]
    shuffled = dict(sorted(table.items(), key=lambda _: rng.uniform()))
    np.testing.assert_allclose(ordered(chain, shuffled), q, atol=1e-10)
    for j, slides in enumerate(chain.slides):
        unit = 1.0 if slides else 180 / np.pi
        assert in_file_units(chain, q)[j] == pytest.approx(q[j] * unit, abs=1e-9)


def test_a_metre_weighs_as_the_turn_that_moves_the_tool_by_one():
    rail = carried(UR10)
    length = np.linalg.norm(UR10.chain.origin[1:, :3, 3], axis=1).sum()
    assert radians_of(rail.chain) == pytest.approx([1 / length, 1, 1, 1, 1, 1, 1])
    assert radians_of(UR10.chain) == pytest.approx(np.ones(6))
