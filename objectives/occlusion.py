"""What a scene's sensors see past the robot and the cell, and which of them stand in the way of
themselves.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from ..coverage.occlusion.model import Occlusion
from ..coverage.occlusion.occluded_beams import Beams
from ..coverage.occlusion.occluders import INSIDE, Occluders, beams
from ..coverage.rings.ring import Setup, ring_values
from ..coverage.rings.ring_kinematics import ring_arrays, sensor_cones, sensor_poses
from ..coverage.robots.kinematics import forward
from ..coverage.robots.link_bodies import robot_capsules
from ..coverage.robots.ring_section import tube_of
from ..coverage.solids.base import Parts
from ..coverage.solids.cones import Cones
from .scene import Scene

_NOTHING = 0.01  # of its cone: a sensor that sees less sees the robot only
_SAMPLES = 512  # points of each cone, to say which sensors see next to nothing


class BodilessError(ValueError):
    """A robot without bodies, where these are asked for."""


def check_bodies(scene: Scene, occlusion: Occlusion) -> None:
    """Refuse a robot without bodies that should shadow or blind its sensors: BodilessError."""
    if occlusion != "ignore" and not scene.robot.bodies:
        raise BodilessError(
            f"occlusion: found {occlusion}, allowed: ignore, as robot {scene.robot.name} has no"
            " bodies"
        )


def occluders(
    scene: Scene, q: Float[np.ndarray, " J"], occlusion: Occlusion | None = None
) -> Occluders:
    """What stands in the way of sensors at joint angles ``q`` (J,) rad.

    Raises:
        BodilessError: if the robot should shadow or blind its sensors, and has no bodies.
    """
    bodies = tuple(o.body for o in scene.obstacles)
    occlusion = occlusion or scene.occlusion
    check_bodies(scene, occlusion)
    if occlusion == "ignore":
        return Occluders(None, bodies)
    return Occluders(robot_capsules(scene.robot, forward(scene.robot.chain, q)), bodies)


def sight(scene: Scene, cones: Cones, q: Float[np.ndarray, " J"], bracketed: bool = False) -> Parts:
    """What sensors with these ``cones`` see at joint angles ``q`` (J,) rad under the scene's
    occlusion; ``bracketed`` as in ``beams``. BodilessError as for ``occluders``."""
    if scene.occlusion == "ignore" and not scene.obstacles:
        return cones
    return beams(cones, occluders(scene, q), scene.occlusion, bracketed)


def setup_sight(
    scene: Scene, setup: Setup, q: Float[np.ndarray, " J"], bracketed: bool = False
) -> Parts:
    """The same for a setup."""
    return sight(scene, sensor_cones(scene.robot, setup, q), q, bracketed)


def check_mounting(scene: Scene, setup: Setup) -> None:
    """Refuse a sensor whose apex lies within its own link's tube: no ring can be mounted there.

    A sensor within a housing across the link, another link or an obstacle is not refused: it sees
    nothing, and ``within`` names it, so that the paper's rings at the links' ends, which stand in
    the joints' housings, can be counted.

    Raises:
        ValueError: naming ring, sensor, link, body and by how much.
    """
    if not setup.rings:
        return
    values = ring_values(setup)
    apex = sensor_poses(
        ring_arrays(scene.robot, setup.rings), values.position, values.tilt, values.phase
    ).apex
    first = np.cumsum([0, *(r.count for r in setup.rings)])
    for i, ring in enumerate(setup.rings):
        for body in tube_of(scene.robot.mount(ring.link), scene.robot.bodies):
            some = apex[first[i] : first[i + 1]]
            gap = body.capsule.distance(some)
            if len(some) and gap.min() <= INSIDE:
                k = int(gap.argmin())
                raise ValueError(
                    f"ring {i}, sensor {k} ({ring.link}): found {-1000 * gap[k]:.1f} mm within body"
                    f" {body.name}, of radius {body.capsule.radius:g} m; allowed under"
                    f" {scene.occlusion}: outside of it"
                )


@dataclass(frozen=True)
class Unseeing:
    """A sensor of a ring, counted from 0, that sees nothing, or next to nothing but the robot, at
    some poses; where it stands within something then, its name and how deep at most, m."""

    ring: int
    sensor: int
    poses: tuple[int, ...]
    within: str | None
    depth: float


def unseeing(scene: Scene, setup: Setup) -> list[Unseeing]:
    """The sensors of ``setup`` that see less than a hundredth of their cones, pose by pose put
    together. A scene that ignores the robot's body hears of those that would see nothing past it,
    if the robot has bodies."""
    if scene.occlusion == "ignore" and scene.robot.bodies:
        scene = replace(scene, occlusion="shadow")
    ring = setup.ring_of_sensor
    number = np.concatenate([np.arange(r.count) for r in setup.rings]) if setup.rings else ring
    names = [
        *(b.name for b in scene.robot.bodies if scene.occlusion != "ignore"),
        *(o.name for o in scene.obstacles),
    ]
    found: dict[tuple[int, str | None], tuple[list[int], float]] = {}
    unit = np.random.default_rng(0).random((_SAMPLES, 3))
    for p, pose in enumerate(scene.poses):
        cones = sensor_cones(scene.robot, setup, pose.q)
        seen = sight(scene, cones, pose.q)
        if not isinstance(seen, Beams):
            return []
        where, depth = occluders(scene, pose.q).holds(np.asarray(cones.apex))
        for k in range(len(cones)):
            name = names[where[k]] if where[k] >= 0 else None
            if name is None and np.mean(seen.part(cones.within(k, unit), k) <= 0) >= _NOTHING:
                continue
            poses, deepest = found.setdefault((k, name), ([], 0.0))
            poses.append(p)
            found[k, name] = poses, max(deepest, float(depth[k]))
    return [
        Unseeing(int(ring[k]), int(number[k]), tuple(p), name, deep)
        for (k, name), (p, deep) in sorted(found.items(), key=_order)
    ]


def _order(item: tuple[tuple[int, str | None], object]) -> tuple[int, str]:
    (sensor, name), _ = item
    return sensor, name or ""
