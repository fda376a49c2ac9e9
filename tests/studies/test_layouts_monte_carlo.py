"""An independent score of a published layout: a Monte Carlo in NumPy alone.

Nothing of the package computes here but the count that is checked. From it come only data: the
lines of the layout's CSV, and the numbers of the robot's capsules. Kinematics follow the maker's
table of the arm (modified Denavit and Hartenberg), target volumes the definition in the docs.
"""

import csv
import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from place_rings.coverage.robots.built_in import ROBOTS
from place_rings.coverage.targets.named import Shell
from place_rings.formats.layouts.layout import read_layout
from place_rings.objectives.verify import Verifier
from place_rings.studies.layouts.study import PUBLISHED

POSE_DEG = (0.0, 20.0, 0.0, -80.0, 0.0, 100.0, 45.0)
TABLE = (  # a m, d m, alpha rad of joints 1 to 7, then the flange
    (0.0, 0.333, 0.0),
    (0.0, 0.0, -math.pi / 2),
    (0.0, 0.316, math.pi / 2),
    (0.0825, 0.0, math.pi / 2),
    (-0.0825, 0.384, -math.pi / 2),
    (0.0, 0.0, math.pi / 2),
    (0.088, 0.0, math.pi / 2),
    (0.0, 0.107, 0.0),
)
REACH, TOOL, OWN = 0.855, 1.5, 0.15  # m
POINTS = 40_000
BLEND, BEND = 0.5, 20


def frames():
    """Pose of each joint's frame, and of the flange, in the base frame."""
    T, each = np.eye(4), []
    for (a, d, alpha), q in zip(TABLE, (*np.radians(POSE_DEG), 0.0), strict=True):
        c, s, ca, sa = math.cos(q), math.sin(q), math.cos(alpha), math.sin(alpha)
        T = T @ np.array(
            [
                [c, -s, 0, a],
                [s * ca, c * ca, -sa, -sa * d],
                [s * sa, c * sa, ca, ca * d],
                [0, 0, 0, 1],
            ]
        )
        each.append(T)
    return each


def curve(points):
    """Discs along the pose curve: centres and unit tangents (N, 3)."""
    corners = [points[0]]
    for p in points[1:]:
        if np.linalg.norm(p - corners[-1]) > 1e-9:
            corners.append(p)
    ways = [(b - a) / np.linalg.norm(b - a) for a, b in pairwise(corners)]
    centres, tangents = [corners[0]], [ways[0]]
    for before, at, after, u, v in zip(
        corners, corners[1:], corners[2:], ways, ways[1:], strict=False
    ):
        if np.linalg.norm(np.cross(u, v)) < 1e-9:
            continue
        start = at + BLEND / 2 * (before - at)
        end = at + BLEND / 2 * (after - at)
        for t in np.linspace(0, 1, BEND):
            centres.append((1 - t) ** 2 * start + 2 * t * (1 - t) * at + t**2 * end)
            way = (1 - t) * (at - start) + t * (end - at)
            tangents.append(way / np.linalg.norm(way))
    return np.array([*centres, corners[-1]]), np.array([*tangents, ways[-1]])


def in_tube(points, centres, tangents, radius):
    """Whether points (N, 3) lie between two neighbouring discs, within a radius of their centres'
    line."""
    inside = np.zeros(len(points), bool)
    for a, b, n, m in zip(centres, centres[1:], tangents, tangents[1:], strict=False):
        between = ((points - a) @ n >= 0) != ((points - b) @ m >= 0)
        k = np.flatnonzero(between & ~inside)
        t = np.clip((points[k] - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        away = np.linalg.norm(points[k] - a - t[:, None] * (b - a), axis=1)
        inside[k[away <= radius]] = True
    return inside


def to_axis(points, start, end):
    """Distance (...) of points from a segment."""
    way = end - start
    t = np.clip((points - start) @ way / max(way @ way, 1e-30), 0, 1)
    return np.linalg.norm(points - start - t[..., None] * way, axis=-1)


def crossed(apex, points, start, end, radius):
    """Whether the lines from an apex to points (N, 3) pass through a capsule.

    The distance from the axis is convex along a line, so that its least value is bracketed.
    """
    low, high = np.zeros(len(points)), np.ones(len(points))
    for _ in range(40):
        a, b = low + (high - low) / 3, high - (high - low) / 3
        nearer = [to_axis(apex + t[:, None] * (points - apex), start, end) for t in (a, b)]
        left = nearer[0] < nearer[1]
        low, high = np.where(left, low, a), np.where(left, b, high)
    t = (low + high) / 2
    return to_axis(apex + t[:, None] * (points - apex), start, end) <= radius


def sensors(file, here):
    """Apexes and axes in the base frame, each moved along its axis out of its link's capsules."""
    bodies = [b for b in ROBOTS["panda"].bodies if b.frame >= 0]
    lines = [s for s in file.read_text().splitlines() if not s.startswith("#")]
    each = []
    for row in csv.DictReader(lines):
        at = np.array([float(row[k]) for k in "xyz"])
        look = np.array([float(row[f"axis_{k}"]) for k in "xyz"])
        look /= np.linalg.norm(look)
        joint = int(row["link"].removeprefix("panda_joint")) - 1
        own = [b.capsule for b in bodies if b.frame == joint]

        def gap(t, at=at, look=look, own=own):
            along = at + np.atleast_1d(t)[:, None] * look
            return np.min(
                [to_axis(along, np.asarray(c.start), np.asarray(c.end)) - c.radius for c in own],
                axis=0,
            )

        if own and gap(0.0)[0] <= 0:
            t = np.arange(0, 0.06, 1e-5)
            at = at + (t[np.flatnonzero(gap(t) > 0)[0]] + 1e-4) * look
        T = here[joint]
        each.append((T[:3, :3] @ at + T[:3, 3], T[:3, :3] @ look))
    return each


@pytest.mark.parametrize("occlusion", ["ignore", "shadow"])
@pytest.mark.parametrize("name", ["gentact_fr3_2356_fancy"])
def test_a_score_agrees_with_a_monte_carlo_of_its_own(name, occlusion):
    file, range_m = PUBLISHED / f"{name}.csv", 0.18
    here = frames()
    body = curve([np.zeros(3), *(T[:3, 3] for T in here)])
    rng = np.random.default_rng(7)
    span = np.stack([body[0].min(axis=0) - 0.25, body[0].max(axis=0) + 0.25])
    points = rng.uniform(*span, (POINTS, 3))
    points = points[in_tube(points, *body, 0.25) & ~in_tube(points, *body, OWN)]
    still = [np.eye(4), *here]
    capsules = [
        (
            *(still[b.frame + 1] @ [*np.asarray(p), 1] for p in (b.capsule.start, b.capsule.end)),
            b.capsule.radius,
        )
        for b in ROBOTS["panda"].bodies
    ]
    covered = np.zeros(len(points), bool)
    for apex, look in sensors(file, here):
        k = np.flatnonzero(~covered)
        v = points[k] - apex
        k = k[(np.linalg.norm(v, axis=1) <= range_m) & (v @ look >= 0)]
        hidden = np.zeros(len(k), bool)
        for start, end, radius in capsules if occlusion == "shadow" else ():
            hidden |= crossed(apex, points[k], start[:3], end[:3], radius)
        covered[k[~hidden]] = True
    share = covered.mean()
    error = math.sqrt(share * (1 - share) / len(points))
    layout = read_layout(file)
    scene = replace(layout.scene, occlusion=occlusion)
    exact = Verifier(scene, 0.015).verify(layout.setup, Shell(0.25)).zeta
    assert len(points) > 7_000
    assert abs(share - exact) < 4 * error
