"""Choose poses of the robot at which the rings' readings reveal how the rings are mounted.

A sensor returns the nearest point in its beam. On a wall at normal incidence that point is the foot
of the perpendicular, wherever the beam points, so the distance does not constrain a tilt within
half the beam. Oblique surfaces and edges do. Poses are therefore chosen greedily among many clear
ones: each adds most to the information about the rings' errors, the sum of their log determinants
(D-optimal; Fedorov, Theory of Optimal Experiments, 1972). The information is averaged over the
proposed setup and a few random mountings, because the actual one is unknown, and it includes the
prior that mounting is careful.
"""

from functools import cached_property
from typing import Annotated

import numpy as np
from jaxtyping import Float
from pydantic import Field

from ...coverage.definitions.definition import definition, refuse
from ...coverage.definitions.field_types import Items
from ...coverage.rings.ring import Setup
from ...formats.schema.versions import Versioned
from ...objectives.scene import Scene
from ...simulation.twin.noise import USUAL_NOISE
from ..poses.clear import drawn
from ..poses.planned_pose import Poses, planned_poses, require_alike
from ..sensing.expected import CELL, expected
from .mounting_error_model import LIMITS, free, grazing, moved, slopes

POSES, FRAMES = 24, 10
_CANDIDATES, _DRAWS = 240, 2
_MEDIAN = np.pi / 2  # variance of the median of normal numbers over that of their mean


@definition
class MountPlan:
    """Stops of a mount check of R rings."""

    frames: Annotated[int, Field(ge=1, le=100_000)]
    """Frames read at each stop."""
    stops: Poses
    """Stops in the order of travel."""
    information: Annotated[Items[Items[Items[float]]], Field(max_length=1000)]
    """Information (R, 4, 4) about each ring's ``NAMES``, in units of ``LIMITS`` to the power of
    minus 2, without the prior."""

    def __post_init__(self) -> None:
        refuse(
            (("information", i), f"{[len(row) for row in part]}", "four rows of four")
            for i, part in enumerate(self.information)
            if [len(row) for row in part] != [4] * 4
        )
        require_alike("stops", self.stops)

    @cached_property
    def joints(self) -> Float[np.ndarray, "P J"]:
        """Joint angles of the stops, rad."""
        return np.array([pose.q for pose in self.stops])


MountPlanFile = Annotated[MountPlan, Versioned()]


def planned(
    scene: Scene,
    setup: Setup,
    poses: int = POSES,
    frames: int = FRAMES,
    seed: int = 0,
    candidates: int = _CANDIDATES,
    among: Float[np.ndarray, "C J"] | None = None,
) -> MountPlan:
    """Choose the stops of a mount check.

    Args:
        scene: with the known cell: floor, table, boxes.
        setup: as proposed.
        poses: number of stops.
        frames: read at each stop.
        seed: of random poses and mountings.
        candidates: number of clear poses to draw and choose from.
        among: poses to choose from instead, rad.

    Raises:
        ValueError: if the scene has no obstacles, or leaves no clear poses.
    """
    require_cell(scene)
    joints = drawn(scene, candidates, seed) if among is None else among
    rng, parts = np.random.default_rng((seed, 1)), []
    for draw in range(1 + _DRAWS):
        errors = rng.uniform(-1, 1, (len(setup.rings), 4)) * LIMITS * (draw > 0)
        parts.append(_information(scene, setup, joints, errors, frames))
    information = np.mean(parts, axis=0)
    total = np.tile(np.eye(4), (len(setup.rings), 1, 1))
    chosen: list[int] = []
    for _ in range(min(poses, len(joints))):
        value = np.linalg.slogdet(total + information)[1].sum(axis=1)
        value[chosen] = -np.inf
        chosen.append(int(value.argmax()))
        total = total + information[chosen[-1]]
    order = _short_way(joints[chosen], scene.poses[0].q)
    return MountPlan(frames, planned_poses(joints[chosen][order]), (total - np.eye(4)).tolist())


def require_cell(scene: Scene) -> None:
    """Raise ValueError if the scene has no obstacles, so that no reading shows how rings sit."""
    if not scene.obstacles:
        raise ValueError(
            "the scene has no obstacles; a mount check needs a known cell: a floor, a table, boxes"
        )


def _information(
    scene: Scene,
    setup: Setup,
    joints: Float[np.ndarray, "C J"],
    errors: Float[np.ndarray, "R 4"],
    frames: int,
) -> Float[np.ndarray, "C R 4 4"]:
    """Return the information of each pose about each ring mounted with these errors, in units of
    ``LIMITS``.
    """
    mounted = Setup(tuple(moved(scene, r, e) for r, e in zip(setup.rings, errors, strict=True)))
    seen = expected(scene, mounted, joints)
    information = np.zeros((len(joints), len(setup.rings), 4, 4))
    for i, (ring, wires) in enumerate(zip(mounted.rings, mounted.slices, strict=True)):
        which = seen.what[:, wires] == CELL
        distance, by = slopes(scene, ring, joints, which)
        by = np.where(
            grazing(by)[:, None],
            0.0,
            by * LIMITS / (USUAL_NOISE.at(distance) * np.sqrt(_MEDIAN / frames))[:, None],
        )
        if len(free(scene, ring)) < 4:
            by[:, 0] = 0.0
        np.add.at(information[:, i], np.nonzero(which)[0], by[:, :, None] * by[:, None, :])
    return information


def _short_way(joints: Float[np.ndarray, "P J"], start: Float[np.ndarray, " J"]) -> list[int]:
    """Order the poses so that each is the nearest of those left, measured by the joint that turns
    farthest.
    """
    left, at, order = list(range(len(joints))), start, []
    while left:
        order.append(min(left, key=lambda i: np.abs(joints[i] - at).max()))
        left.remove(order[-1])
        at = joints[order[-1]]
    return order
