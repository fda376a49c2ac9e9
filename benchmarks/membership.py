"""Fast paths of membership: what each saves over the one definition that it must agree with.

Whether a point is in a beam, in a shadow or beyond a first return is defined by the implicit
functions of ``coverage/solids`` and ``coverage/occlusion``. Hot loops have faster paths beside
them, which tests tie to the definition.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from common import cone_task, medians, say, table
from place_rings.coverage.occlusion.shadows import CapsuleShadows
from place_rings.coverage.ring_views.line_of_sight import LinkOccluders
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.coverage.solids.base import Parts
from place_rings.coverage.solids.beams import InBeam
from place_rings.coverage.solids.capsule_shadows import behind, capsule_shadow
from place_rings.coverage.solids.cones import Cones, cone
from place_rings.coverage.targets.named import Shell
from place_rings.coverage.voxels.solid_bitmask import words
from place_rings.coverage.voxels.voxel_bitmask import CORNER, BlockGrid
from place_rings.objectives.scene import Scene

Paths = tuple[str, str, int, Callable[[], Any], Callable[[], Any]]
VOXEL = 0.01
_COLUMNS = ("fast path", "definition", "items", "ns an item", "of the definition", "times as fast")


def beam_paths(rng: np.random.Generator, count: int) -> Paths:
    """Return the same function of a sensor's own coordinates in 32 bits, and of poses."""
    sensor, points = Sensor(math.radians(25), 1.5), rng.uniform(-1, 1, (count, 3))
    along, across, up = points.T.astype(np.float32).copy()
    pose = np.zeros(3), np.array([1.0, 0.0, 0.0])
    cosine, sine, range_m = Cones.terms(sensor.sizes)
    return (
        *("`Sensor.holds`, 32 bits", "`cone`", count),
        lambda: sensor.holds(InBeam(along, across, up)),
        lambda: cone(points, *pose, cosine, sine, range_m) <= 0,
    )


def bitmask_paths(rng: np.random.Generator, count: int) -> list[Paths]:
    """Return the 64 voxels of a block at once, in cones and in shadows."""
    parts, blocks = cone_task(), count // 64
    points, index = rng.uniform(-1, 1, (blocks, 3)), rng.integers(0, len(parts), blocks)
    grid = BlockGrid(VOXEL, 1e-9)
    centres = points + VOXEL * (CORNER[:, None] - 1.5)
    body = rng.uniform(-0.3, 0.3, (2, blocks, 3))
    shadow = capsule_shadow(body[0] + [0, 0, 1.0], *body, np.full(blocks, 0.08))
    number = np.arange(blocks)
    return [
        (
            *("`words` of cones", "`Cones.part`", count),
            lambda: words(parts, grid, points, index),
            lambda: parts.part(centres, index) <= 0,
        ),
        (
            *("`CapsuleShadows.free`", "`behind`", count),
            lambda: CapsuleShadows(number, shadow).free(grid, points, number),
            lambda: behind(centres, shadow) > 0,
        ),
    ]


def body_paths(rng: np.random.Generator, count: int) -> Paths:
    """Return lines of sight past capsules."""
    start, end = rng.uniform(-0.4, 0.4, (2, count, 3))
    apex, points = start + np.array([0.0, 0.0, 0.6]), rng.uniform(-1, 1, (count, 3))
    thick, number = np.full(count, 0.06), np.arange(count)[:, None]
    flat = (start, end, thick, apex, points - apex)
    a, b, r, eye, way = (np.asarray(v, np.float32) for v in flat)
    past = LinkOccluders(a, b, r, number, (), np.zeros((count, 0), int), False)
    return (
        *("`LinkOccluders.clear`, 32 bits", "`behind` of `capsule_shadow`", count),
        lambda: past.clear(list(eye.T), list(way.T), np.arange(count)),
        lambda: behind(points, capsule_shadow(apex, start, end, thick)) > 0,
    )


def tube_paths(rng: np.random.Generator, count: int) -> Paths:
    """Return the points inside a tube by the signs of its planes."""
    scene = Scene.paper()
    tube: Any = scene.solid(Shell(0.5), 0).a
    points = rng.uniform(-1, 1, (count // 16, 3))
    return (
        *("`Tube.holds`", "`Parts.holds`", len(points)),
        lambda: tube.holds(points),
        lambda: Parts.holds(tube, points),
    )


def report(full: bool) -> list[str]:
    """Measure each path beside its definition and return blocks of Markdown."""
    rng, count, rows = np.random.default_rng(0), 1 << (20 if full else 17), []
    paths = [make(rng, count) for make in (beam_paths, body_paths, tube_paths)]
    for fast, slow, items, quickly, plainly in [*bitmask_paths(rng, count), *paths]:
        times = medians({"fast": quickly, "slow": plainly})
        a, b = (1e9 * times[name][1] / items for name in ("fast", "slow"))
        rows.append((fast, slow, f"{items:,}", f"{a:.0f}", f"{b:.0f}", f"{b / a:.1f}"))
        say(*rows[-1])
    intro = (
        "Fast paths of membership, each beside the definition that its test compares it with."
        " Both classify the same random points, pairs or voxels."
    )
    return [intro, table(_COLUMNS, rows)]
