"""An independent estimate of ζ in plain NumPy: every point against every sensor and body.

It shares link frames and the discs of the pose curve with the package. The tests of points are its
own, straight from the definitions, in 64 bits: no octree, no blocks, no tables.
"""

import math
from typing import Any

import numpy as np
from place_rings.coverage.rings.ring import Setup
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.targets.posed_robot import robot_curve
from place_rings.objectives.scene import Scene

_TRIED = 4_000  # points drawn at once


def estimate(scene: Scene, setup: Setup, points: int, seed: int) -> tuple[float, float]:
    """Return ζ of V_S by random points at the first pose, and half its 95 % interval.

    Args:
        scene: one shell V_S; plain cones; self-occlusion ``ignore`` or ``shadow``.
        setup: rings only.
        points: number of points in the shell.
        seed: random seed.
    """
    (goal,) = scene.targets
    frames = np.asarray(forward(scene.robot.chain, scene.poses[0].q))
    inside = _shell(scene, goal.target.radius, points, seed)
    seen = np.zeros(points, bool)
    apex, axis = _sensors(scene, setup, frames)
    sensor = scene.sensor
    bodies = _bodies(scene, frames) if scene.occlusion == "shadow" else None
    blind = np.zeros(len(apex), bool)
    if bodies is not None:
        start, end, radius = bodies
        still = np.zeros_like(apex)
        for k in range(len(start)):
            blind |= _gap(apex, still, start[k], end[k]) <= radius[k]
    tangent = math.tan(sensor.half_angle)
    for i in np.flatnonzero(~blind):
        left = np.flatnonzero(~seen)
        way = inside[left] - apex[i]
        along = way @ axis[i]
        across = np.linalg.norm(way - along[:, None] * axis[i], axis=1)
        there = (along >= 0) & (along <= sensor.range_m) & (across <= along * tangent)
        left, way = left[there], way[there]
        clear = np.ones(len(left), bool)
        if bodies is not None:
            for a, b, r in zip(*bodies, strict=True):
                clear &= _gap(np.broadcast_to(apex[i], way.shape), way, a, b) >= r
        seen[left[clear]] = True
    zeta = float(seen.mean())
    return zeta, 1.96 * math.sqrt(max(zeta * (1 - zeta), 1 / points) / points)


def _shell(scene: Scene, radius: float, points: int, seed: int) -> Any:
    """Draw points (N, 3) m in the shell: in the tube of its radius and outside that of V_R."""
    curve = robot_curve(scene.robot, scene.poses[0].q, scene.curve)
    centre, normal, first = curve.discs(scene.curve.points_per_bend)
    low, high = centre.min(axis=0) - radius, centre.max(axis=0) + radius
    rng, kept, total = np.random.default_rng(seed), [], 0
    while total < points:
        some = rng.uniform(low, high, (_TRIED, 3))
        for limit, wanted in ((radius, True), (scene.curve.robot_radius, False)):
            held = np.zeros(len(some), bool)
            for k in first:
                before = (some - centre[k]) @ normal[k]
                after = (some - centre[k + 1]) @ normal[k + 1]
                step = centre[k + 1] - centre[k]
                place = np.clip((some - centre[k]) @ step / max(step @ step, 1e-300), 0, 1)
                gap = np.linalg.norm(some - centre[k] - place[:, None] * step, axis=1)
                held |= (before * after <= 0) & (gap <= limit)
            some = some[held == wanted]
        kept.append(some)
        total += len(some)
    return np.concatenate(kept)[:points]


def _sensors(scene: Scene, setup: Setup, frames: Any) -> tuple[Any, Any]:
    """Return apexes (S, 3) m and axes (S, 3) of all sensors, base frame."""
    apexes, axes = [], []
    for ring in setup.rings:
        mount = scene.robot.mount(ring.link)
        T, out = frames[mount.frame], np.asarray(mount.axis, float)
        zero = np.asarray(mount.zero, float)
        side = np.cross(out, zero)
        for j in range(ring.count):
            turn = ring.phase + 2 * math.pi * j / ring.count
            radial = math.cos(turn) * zero + math.sin(turn) * side
            at = mount.start + ring.position * mount.length * out + ring.radius * radial
            look = math.cos(ring.tilt) * radial + math.sin(ring.tilt) * out
            apexes.append(T[:3, :3] @ at + T[:3, 3])
            axes.append(T[:3, :3] @ look)
    return np.array(apexes), np.array(axes)


def _bodies(scene: Scene, frames: Any) -> tuple[Any, Any, Any]:
    """Return starts, ends and radii of the robot's capsules, m, base frame."""
    ends = []
    for body in scene.robot.bodies:
        T = np.eye(4) if body.frame < 0 else frames[body.frame]
        ends.append([T[:3, :3] @ v + T[:3, 3] for v in (body.capsule.start, body.capsule.end)])
    start, end = np.array(ends).swapaxes(0, 1)
    return start, end, np.array([body.capsule.radius for body in scene.robot.bodies])


def _gap(start: Any, way: Any, a: Any, b: Any) -> Any:
    """Return the distance of the segments from ``start`` (N, 3) by ``way`` to the segment a to b,
    m: the least over a fine set of candidates for the nearest points of two segments."""
    w = b - a
    r = start - a
    uu, uw, ww = (way * way).sum(axis=1), way @ w, float(w @ w)
    ur, wr = (way * r).sum(axis=1), r @ w
    square = np.full(len(start), np.inf)
    bent = np.maximum(uu * ww - uw * uw, 1e-300)
    inner = np.clip((uw * wr - ww * ur) / bent, 0, 1)
    # an inner minimum, or one at an end of either segment
    for s in (inner, np.zeros(len(start)), np.ones(len(start))):
        t = np.clip((wr + s * uw) / max(ww, 1e-300), 0, 1)
        square = np.minimum(square, ((r + s[:, None] * way - t[:, None] * w) ** 2).sum(axis=1))
    for t in (0.0, 1.0):
        s = np.clip((t * uw - ur) / np.maximum(uu, 1e-300), 0, 1)
        square = np.minimum(square, ((r + s[:, None] * way - t * w) ** 2).sum(axis=1))
    return np.sqrt(square)
