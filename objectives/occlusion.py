"""Lines of sight in a scene: which parts of the beams the robot and the cell leave free, and which
sensors see almost nothing.
"""

import math
from dataclasses import replace
from functools import partial
from typing import Annotated

import numpy as np
from jaxtyping import Bool, Float

from ..coverage.definitions.definition import definition
from ..coverage.definitions.units import Millimetres
from ..coverage.occlusion.occluded_beams import OccludedBeams
from ..coverage.occlusion.occluders import INSIDE, Occluders, beams
from ..coverage.occlusion.occlusion_mode import Occlusion
from ..coverage.rings.ring import Setup, ring_values
from ..coverage.rings.ring_kinematics import ring_arrays, sensor_cones, sensor_poses
from ..coverage.robots.kinematics import forward
from ..coverage.robots.link_bodies import carried_polyhedra, robot_capsules
from ..coverage.robots.ring_section import tube_of
from ..coverage.solids.base import Parts
from ..coverage.solids.beams import Beams
from .pose_workers import each_pose
from .scene import Scene

_NOTHING = 0.01  # share of its cone below which a sensor counts as occluded
_SAMPLES = 512  # points sampled in each cone to detect occluded sensors


class BodilessError(ValueError):
    """A robot without bodies in a scene whose occlusion model needs them."""


def check_bodies(scene: Scene, occlusion: Occlusion) -> None:
    """Raise ``BodilessError`` if the occlusion model needs the robot's bodies and it has none."""
    if occlusion != "ignore" and not scene.robot.bodies:
        raise BodilessError(
            f"robot {scene.robot.name} has no bodies, which occlusion {occlusion} needs; set"
            " occlusion to ignore"
        )


def occluders(
    scene: Scene, q: Float[np.ndarray, " J"], occlusion: Occlusion | None = None
) -> Occluders:
    """Return the occluders of a scene at joint angles ``q`` (J,) rad.

    Raises:
        BodilessError: if the occlusion model needs the robot's bodies and the robot has none.
    """
    bodies = tuple(o.body for o in scene.obstacles)
    occlusion = occlusion or scene.occlusion
    check_bodies(scene, occlusion)
    if occlusion == "ignore":
        return Occluders(None, bodies)
    capsules = robot_capsules(scene.robot, forward(scene.robot.chain, q))
    return Occluders(capsules, (*bodies, *carried_polyhedra(scene.robot, q)))


def sight(scene: Scene, cones: Beams, q: Float[np.ndarray, " J"], bracketed: bool = False) -> Parts:
    """Return the visible parts of sensor cones under the scene's occlusion model.

    Args:
        scene: the scene.
        cones: the cones of the sensors, base frame.
        q: joint angles (J,), rad.
        bracketed: as in ``beams``.

    Raises:
        BodilessError: as ``occluders`` does.
    """
    if scene.occlusion == "ignore" and not scene.obstacles:
        return cones
    return beams(cones, occluders(scene, q), scene.occlusion, bracketed)


def setup_sight(
    scene: Scene, setup: Setup, q: Float[np.ndarray, " J"], bracketed: bool = False
) -> Parts:
    """Return the visible parts of a setup's beams and, after them, of the cell's sensors; see
    ``sight``."""
    return sight(scene, sensor_cones(scene.robot, scene.with_cell(setup), q), q, bracketed)


def own_link_fault(scene: Scene, setup: Setup) -> str | None:
    """Return a message on the first sensor whose apex lies within the tube of its own link; None if
    there is none.

    No ring fits there. Like a sensor within any other body, it sees nothing, and
    ``Unseeing.within`` names the body: a count of such a setup states the fault and has an answer,
    whatever the robot.
    """
    if not setup.rings:
        return None
    values = ring_values(setup.rings)
    apex = sensor_poses(
        ring_arrays(scene.robot, setup.rings), values.position, values.tilt, values.phase
    ).apex
    first = np.cumsum([0, *(r.count for r in setup.rings)])
    for i, ring in enumerate(setup.rings):
        for body in tube_of(scene.robot, scene.robot.mount(ring.link)):
            some = apex[first[i] : first[i + 1]]
            gap = body.capsule.distance(some)
            if len(some) and gap.min() <= INSIDE:
                k = int(gap.argmin())
                return (
                    f"ring {i}, sensor {k} ({ring.link}): found {-1000 * gap[k]:.1f} mm within body"
                    f" {body.name} (radius {body.capsule.radius:g} m); occlusion {scene.occlusion}"
                    " requires sensors outside it"
                )
    return None


@definition
class Unseeing:
    """A blocked sensor: it sees less than 1 % of its cone, or nothing because it sits inside a
    body."""

    ring: int
    """Number of the ring, counted from 0; single sensors follow the rings, then the cell's."""
    sensor: int
    """Number of the sensor on its ring, counted from 0."""
    poses: int
    """Number of poses at which it is blocked."""
    within: str | None = None
    """Name of the body or obstacle that contains it."""
    depth: Annotated[float, Millimetres("depth_mm", digits=3)] = 0.0
    """Largest depth inside it, m."""
    single: str = ""
    """Name of a single sensor or of one of the cell; empty for a sensor of a ring."""


def unseeing(scene: Scene, setup: Setup) -> list[Unseeing]:
    """Return the sensors of ``setup`` and of the cell that see less than a hundredth of their
    beams at some poses.

    For a scene that ignores the robot's body, this evaluates the model ``shadow`` if the robot has
    bodies.
    """
    if scene.occlusion == "ignore" and scene.robot.bodies:
        scene = replace(scene, occlusion="shadow")
    setup = scene.with_cell(setup)
    labels = setup.labels
    singles = {i: setup.group_name(i) for i in range(len(setup.rings), len(setup.groups))}
    occluded: dict[tuple[int, str | None], tuple[list[int], float]] = {}
    for p, found in enumerate(each_pose(partial(_blocked, scene, setup), len(scene.poses))):
        for k, name, depth in found:
            poses, deepest = occluded.setdefault((k, name), ([], 0.0))
            poses.append(p)
            occluded[k, name] = poses, max(deepest, depth)
    return [
        Unseeing(*labels[k], len(p), name, deep, singles.get(labels[k][0], ""))
        for (k, name), (p, deep) in sorted(occluded.items(), key=_order)
    ]


def _blocked(scene: Scene, setup: Setup, pose: int) -> list[tuple[int, str | None, float]]:
    """Return the blocked sensors at a pose: the number of each, the name of the body or obstacle
    that contains it, and its depth inside it, m."""
    q = scene.poses[pose].q
    cones = sensor_cones(scene.robot, setup, q)
    seen = sight(scene, cones, q)
    if not isinstance(seen, OccludedBeams):
        return []
    names = [
        *(b.name for b in scene.robot.bodies if scene.occlusion != "ignore"),
        *(o.name for o in scene.obstacles),
        *(c.name for c in scene.robot.carried if scene.occlusion != "ignore"),
    ]
    where, depth = occluders(scene, q).holds(np.asarray(cones.apex))
    sees = _sees(cones, seen, np.random.default_rng(0).random((_SAMPLES, 3)))
    within = [names[i] if i >= 0 else None for i in where]
    return [
        (k, name, float(depth[k]))
        for k, name in enumerate(within)
        if name is not None or not sees[k]
    ]


def _sees(
    cones: Beams, seen: OccludedBeams, unit: Float[np.ndarray, "N 3"]
) -> Bool[np.ndarray, " K"]:
    """Return which sensors see at least a hundredth of the points of their beams.

    A few points are enough for most, as they hold so many that are seen.
    """
    least, sees = math.ceil(_NOTHING * len(unit)), np.zeros(len(cones), bool)
    for some in (unit[: 4 * least], unit):
        if not len(k := np.flatnonzero(~sees)):
            break
        index = np.repeat(k, len(some))
        value = seen.part(cones.within(index, np.tile(some, (len(k), 1))), index)
        sees[k] = (value.reshape(len(k), -1) <= 0).sum(axis=1) >= least
    return sees


def _order(item: tuple[tuple[int, str | None], object]) -> tuple[int, str]:
    (sensor, name), _ = item
    return sensor, name or ""
