"""How long a moving robot takes to stop after an event, and how far it travels meanwhile, at most.

Both follow from the limits of the links (``[link]`` in a scene) and of the motion. A reading may be
as old as ``ring_late`` and ``ring_silent`` allow together, and a ring that freezes may send each of
``frozen_frames`` frames only just in time. The check may then be held up for
``sign_of_life``, and the process that moves the robot for ``watchdog``, before the next of them
stops the robot. Each is assumed to be held up once at most. Not included: the time that a sensor
measures, the network, the robot's controller, which decelerates in its own way where its watchdog
ends the program, and what ``UNDETECTED`` names.
"""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...coverage.definitions.errors import UserError
from ...coverage.rings.ring import Setup
from ...coverage.robots.kinematics import forward
from ...coverage.robots.link_bodies import robot_capsules
from ...coverage.robots.robot import BASE
from ...objectives.link_limits import USUAL_LIMITS, LinkLimits
from ...objectives.motion_limits import Motion
from ...objectives.scene import Scene
from ..robot.motion import LOOK
from ..robot.motion_process import DECELERATION, TICK
from ..sensing.expected import beams_at
from ..session.stop_conditions import TURNED

LOOPS = LOOK + TICK  # s between two looks of the check, and of the process that moves the robot
NEAR = "a reading below near_m"
FROZEN = "distances of a ring that freeze"
UNDETECTED = (
    "Not detected: a delay that is the same for all frames of a ring, in its sensors, its firmware"
    " or its adapter. It adds to the times of near readings and of rings. Measure it before a"
    " motion: docs/rig.md says how."
)


@dataclass(frozen=True)
class StopBound:
    """How long the robot takes to begin its stop after an event, and how far it travels."""

    event: str
    """The event, as text."""
    seconds: float
    """Largest time from the event until the robot begins to stop, s."""
    metres: float
    """Largest distance that a point of the robot travels from the event to standstill, m."""


def lever(scene: Scene, setup: Setup, joints: Float[np.ndarray, "P J"]) -> float:
    """Return how far a point of the robot's bodies or a sensor moves at most for each radian of the
    leading joint, m/rad, between consecutive poses of a route.
    """
    leading = np.abs(np.diff(joints, axis=0)).max(axis=1, initial=0.0)  # (P - 1,)
    moves = leading > 1e-9
    if not moves.any():
        return 0.0
    paths = [np.asarray(beams_at(scene, setup, joints).apex).reshape(len(joints), -1, 3)]
    turned = np.zeros((len(joints) - 1, 1))
    robot = scene.robot.enclosed()
    if robot.bodies:
        frames = np.asarray(forward(robot.chain, joints))  # (P, F, 4, 4)
        start, end, radius = robot_capsules(robot, frames).arrays()
        paths += [start, end]
        turned = np.stack(
            [r * _turned(frames, b.frame) for b, r in zip(robot.bodies, radius, strict=True)], -1
        )
    points = np.linalg.norm(np.diff(np.concatenate(paths, axis=1), axis=0), axis=-1)  # (P - 1, n)
    sensors = points[:, : paths[0].shape[1]].max(axis=1)
    ends = points[:, paths[0].shape[1] :].reshape(len(points), 2, -1)
    most = (ends.max(axis=1, initial=0.0) + turned).max(axis=1, initial=0.0)
    return float((np.maximum(sensors, most)[moves] / leading[moves]).max())


def _turned(frames: Float[np.ndarray, "P F 4 4"], frame: int) -> Float[np.ndarray, " P-1"]:
    """Return the angle, rad, by which a frame turns between consecutive poses."""
    if frame == BASE:
        return np.zeros(len(frames) - 1)
    R = frames[:, frame, :3, :3]
    trace = np.einsum("pij,pij->p", R[:-1], R[1:])
    angle: np.ndarray = np.arccos(np.clip((trace - 1) / 2, -1, 1))
    return angle


def stop_bounds(
    link: LinkLimits, motion: Motion, lever: float, cycle: float = 0.0
) -> list[StopBound]:
    """Return the bounds for each kind of event, the near reading first.

    Args:
        link: limits of the links.
        motion: limits of the motion.
        lever: m/rad, from ``lever``.
        cycle: time between two readings of a sensor of a ring that fires in slots, s: a frame may
            hold a reading that is so much older.
    """
    held_up = link.sign_of_life + link.watchdog + LOOPS
    reading = cycle + link.oldest_reading + held_up
    times = {
        NEAR: reading,
        "sensors of a ring that fail, more than failed_share": reading,
        FROZEN: cycle + link.ring_late + motion.frozen_frames * link.ring_silent + held_up,
        "a ring that falls silent": link.oldest_reading + held_up,
        "states of the robot that cease": 2 * link.state_stale + held_up,
        "this program ends or is held up": held_up,
        "the process that moves the robot ends or is held up": link.watchdog,
    }
    least = {FROZEN: lever * (TURNED + travelled(motion.speed, held_up, 1.0))}
    return [
        StopBound(event, t, max(travelled(motion.speed, t, lever), least.get(event, 0.0)))
        for event, t in times.items()
    ]


def travelled(speed: float, seconds: float, lever: float) -> float:
    """Return how far a point travels, m, that moves on for ``seconds`` and is then braked.

    Args:
        speed: of the leading joint, rad/s.
        seconds: until the robot begins to stop.
        lever: m/rad.
    """
    return lever * (speed * seconds + speed**2 / (2 * DECELERATION))


def slow_enough(near: float, seconds: float, lever: float) -> float:
    """Return the highest speed of the leading joint, rad/s, at which the robot travels at most
    ``near`` m; the inverse of ``travelled``.
    """
    if lever <= 0:
        return math.inf
    coast = DECELERATION * seconds
    return math.sqrt(coast**2 + 2 * DECELERATION * near / lever) - coast


def bounds_of_route(
    scene: Scene,
    setup: Setup,
    joints: Float[np.ndarray, "P J"],
    real: bool,
    cycle: float = 0.0,
) -> tuple[list[StopBound], str | None]:
    """Return the bounds for a route, and a warning if the robot may travel farther than the near
    stop after a reading below it.

    Args:
        scene: limits of links and motion.
        setup: the rings.
        joints: (P, J) rad, poses along the route.
        real: whether the robot is real; a simulated one is not warned of.
        cycle: as in ``stop_bounds``.

    Raises:
        UserError: if a real robot may, and a limit is longer than its default; or if it may travel
            that far before it stops for a frozen ring, and ``frozen_frames`` is above its default.
    """
    most = lever(scene, setup, joints)
    bounds = stop_bounds(scene.link, scene.motion, most, cycle)
    if not real:
        return bounds, None
    motion, frozen = scene.motion, next(b for b in bounds if b.event == FROZEN)
    if frozen.metres > motion.near and motion.frozen_frames > Motion.frozen_frames:
        default = f"frozen_frames = {Motion.frozen_frames}"
        raise UserError(f"--move: {_too_far(frozen, scene, most)}, or {default}, its default")
    if bounds[0].metres <= motion.near:
        return bounds, None
    warning = _too_far(bounds[0], scene, most)
    if scene.link.longer_than(USUAL_LIMITS):
        raise UserError(f"--move: {warning}, or set the times under [link] to their defaults")
    if motion.failed_share > Motion.failed_share:
        default = f"failed_share = {Motion.failed_share:g}"
        raise UserError(f"--move: {warning}, or set {default}, its default")
    return bounds, warning


def _too_far(bound: StopBound, scene: Scene, lever: float) -> str:
    """Say in one line how far the robot travels, and what would keep it within ``near_m``."""
    near, event = scene.motion.near, bound.event
    if event == NEAR:
        event = f"{NEAR} = {near:g}"
    speed = math.degrees(slow_enough(near, bound.seconds, lever))
    keeps = [f"near_m = {math.ceil(100 * bound.metres) / 100:g}"]
    if speed >= 1:
        keeps.insert(0, f"speed_deg_s = {math.floor(10 * speed) / 10:g}")
    return (
        f"after {event} the robot may travel {1000 * bound.metres:.0f} mm within the limits under"
        f" [link] and [motion]; under [motion], {' or '.join(keeps)} keeps the distance"
    )
