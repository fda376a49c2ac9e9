"""A robot at a pose with a target, rings and obstacles, small enough for a dense count."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from hypothesis import strategies as st
from place_rings.coverage.occlusion.occluders import Occluders
from place_rings.coverage.rings.ring import Setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.robots.built_in import ROBOTS
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.link_bodies import robot_capsules
from place_rings.coverage.robots.robot import Robot
from place_rings.coverage.solids.base import Difference, Solid
from place_rings.coverage.solids.cones import Cones
from place_rings.coverage.solids.polyhedra import Polyhedron, polyhedra
from place_rings.coverage.targets.named import (
    Near,
    ReachAndToolSpheres,
    ReachSphere,
    Shell,
    ToolSphere,
)
from place_rings.coverage.targets.posed_robot import Shape
from place_rings.coverage.targets.solid import target_solid
from place_rings.coverage.targets.target import Target

from .rings import LONGEST, ROBOT_NAMES
from .singles import REPORTING, SENSORS, mixed_setups, with_sensors
from .solids import boxes, pointed_bodies

DENSE = {
    "centre": 20_000,
    "sampled": 20_000,
    "touch": 80,
}  # voxels that a dense count by each rule can stand


@dataclass(frozen=True)
class DrawnScene:
    """A target at a pose, less the obstacles, and the beams of a setup."""

    robot: str
    pose_deg: tuple[int, ...]
    """As many angles as the longest arm has; others leave the last out."""
    target: Target
    blend_percent: int
    setup: Setup
    fineness_percent: int
    """Voxels in the bounding box of the target: this share of what a dense count can stand."""
    obstacles: tuple[Polyhedron, ...] = ()

    @cached_property
    def arm(self) -> Robot:
        return ROBOTS[self.robot]

    @cached_property
    def q(self) -> np.ndarray:
        """Joint angles, rad."""
        return np.radians(self.pose_deg[: len(self.arm.chain)])

    @cached_property
    def solid(self) -> Difference:
        shape = Shape(blend=self.blend_percent / 100, points_per_bend=4)
        solid: Solid = target_solid(self.target, self.arm, self.q, shape)
        if self.obstacles:
            solid = Difference(solid, polyhedra(self.obstacles, solid.bounds()))
        assert isinstance(solid, Difference)
        return solid

    @cached_property
    def cones(self) -> Cones:
        return sensor_cones(self.arm, self.setup, self.q)

    @cached_property
    def occluders(self) -> Occluders:
        return Occluders(robot_capsules(self.arm, forward(self.arm.chain, self.q)), self.obstacles)

    def voxel(self, rule: str) -> float:
        """Side of a voxel for a dense count by ``rule``, m."""
        volume = float(np.prod(np.ptp(self.solid.bounds(), axis=0)))
        voxels = DENSE[rule] * self.fineness_percent / 100
        return max(0.02, (volume / voxels) ** (1 / 3))


def shells(least_mm: int, most_mm: int) -> st.SearchStrategy[Target]:
    """Targets V_S."""
    return st.integers(least_mm, most_mm).map(lambda mm: Shell(mm / 1000))


NEAR = st.integers(50, 1200).map(lambda mm: Near(mm / 1000))
"""Targets V_N."""
TARGETS = st.one_of(
    shells(200, 1200), NEAR, st.sampled_from([ReachSphere(), ToolSphere(), ReachAndToolSpheres()])
)


NO_OBSTACLES: st.SearchStrategy[tuple[Polyhedron, ...]] = st.just(())
CELLS = st.lists(boxes(1000, (50, 800)) | pointed_bodies(1000), max_size=3).map(tuple)
"""Up to three boxes and pointed bodies anywhere."""


def scenes(
    targets: st.SearchStrategy[Target] = TARGETS,
    obstacles: st.SearchStrategy[tuple[Polyhedron, ...]] = NO_OBSTACLES,
) -> st.SearchStrategy[DrawnScene]:
    """Scenes of any built-in robot."""
    return st.builds(
        DrawnScene,
        robot=ROBOT_NAMES,
        pose_deg=st.tuples(*[st.integers(-180, 180)] * LONGEST),
        target=targets,
        blend_percent=st.integers(10, 100),
        setup=st.builds(with_sensors, mixed_setups(), st.lists(SENSORS | REPORTING, max_size=2)),
        fineness_percent=st.integers(25, 100),
        obstacles=obstacles,
    )
