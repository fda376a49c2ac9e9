"""Certificates of guaranteed intervals: what a checker needs to derive an interval again.

A certificate holds the shapes of targets, beams and occluders in metres, the cells that filled the
space around the robot, and what is known of each. A covered cell names the sensor that sees all of
it. ``examples/certificate/check.py`` checks one with NumPy only.
"""

import io
import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ..coverage.occlusion.occluded_beams import OccludedBeams
from ..coverage.rings.ring import Setup
from ..coverage.solids.base import Difference, Intersection, Parts, Solid, Union
from ..coverage.solids.beams import Beams
from ..coverage.solids.capsules import Capsules
from ..coverage.solids.cones import Cones
from ..coverage.solids.polyhedra import NOWHERE, Polyhedra
from ..coverage.solids.pyramids import Pyramids
from ..coverage.solids.sensor_beams import SHAPES, MixedBeams
from ..coverage.solids.spheres import Spheres
from ..coverage.solids.swept_tube import Tube
from ..coverage.targets.target import Target
from ..coverage.voxels.volume_tally import COVERED, OUTSIDE, SettledCells
from ..coverage.voxels.voxel_set import BITS, OFFSET, decode
from .occlusion import occluders, setup_sight
from .scene import Scene
from .verified import Verified

VERSION = 1
_BITS = 3 * BITS  # of a key
_CHUNK = 1 << 16  # cells of which the covering sensors are found at once
Item = dict[str, Any]


class UncertifiedError(ValueError):
    """A scene with shapes that certificates do not describe."""


@dataclass(frozen=True)
class Shapes:
    """The shapes of one target at one pose."""

    target: Target
    """The target."""
    pose: int
    """Index of the pose."""
    item: Item
    """What a certificate states of them."""
    seen: Parts
    """What the sensors see."""
    number: Int[np.ndarray, " K"]
    """Number of each sensor in the certificate; -1 for sensors that see nothing."""


def certified_shapes(scene: Scene, setup: Setup) -> list[Shapes]:
    """Return the shapes of all targets and poses of a scene, before anything is computed.

    Raises:
        UncertifiedError: for weight fields, beams that are neither cones nor pyramids, sensors of
            one zone that a body blinds, and targets of other shapes.
    """
    found, of_poses = list[Shapes](), [_sensors(scene, setup, pose.q) for pose in scene.poses]
    for goal in scene.targets:
        if goal.target.importance is not None:
            raise UncertifiedError(f"target {goal.target}: found weights, allowed: none")
        for i, (sensors, seen, number) in enumerate(of_poses):
            item = {"name": str(goal.target), "pose": i, "weight": float(scene.pose_weights[i])}
            item |= {"target": _tree(scene.solid(goal.target, i)), "sensors": sensors}
            found.append(Shapes(goal.target, i, item, seen, number))
    return found


def certificate(scene: Scene, shapes: Sequence[Shapes], each: Sequence[Verified]) -> bytes:
    """Return a certificate of guaranteed intervals as the content of an ``.npz`` file.

    Args:
        scene: what was verified.
        shapes: its ``certified_shapes``.
        each: the intervals of the scene's targets; their bounds hold the settled cells.
    """
    arrays, items, verified = dict[str, Any](), list[Item](), {v.target: v for v in each}
    for k, of in enumerate(shapes):
        bounds = verified[of.target].poses[of.pose].bounds
        if bounds is None or bounds.settled is None:
            raise ValueError("a certificate needs intervals that hold their cells")
        cells = bounds.settled
        filled = _filled(cells, _covering(cells, of.seen, of.number))
        arrays |= dict(zip((f"level_{k}", f"claim_{k}", f"by_{k}"), filled, strict=True))
        items.append(of.item | {"unit": cells.unit})
    statement = {"certificate": VERSION, "robot": scene.robot.name, "occlusion": scene.occlusion}
    coverage = {str(v.target): [v.low, v.high] for v in each}
    text = json.dumps(statement | {"coverage": coverage, "items": items})
    file = io.BytesIO()
    np.savez_compressed(file, statement=np.array(text), **arrays)
    return file.getvalue()


def _tree(solid: Solid) -> Item:
    """Return a target as a tree of unions, intersections and differences of shapes."""
    for kind in (Union, Intersection, Difference):
        if isinstance(solid, kind):
            return {kind.__name__.lower(): [_tree(solid.a), _tree(solid.b)]}
    if isinstance(solid, Tube):
        return {
            "tube": {
                "discs": _list(solid.centre),
                "normal": _list(solid.normal),
                "radius": float(solid.radius),
                "first": _list(solid.first),
            }
        }
    if isinstance(solid, Spheres):
        solid = Capsules(solid.centre, solid.centre, solid.radius)
    if isinstance(solid, Capsules):
        return {"capsules": _capsules(solid)}
    if isinstance(solid, Polyhedra):
        return {"polyhedra": _planes(solid.normal, solid.offset)}
    raise UncertifiedError(f"found a target with a part {type(solid).__name__}")


def _list(values: Any) -> Any:
    return np.asarray(values).tolist()


def _capsules(bodies: Capsules | None) -> Item:
    if bodies is None:
        return {"start": [], "end": [], "radius": []}
    return dict(zip(("start", "end", "radius"), map(_list, bodies.arrays()), strict=True))


def _planes(normals: Any, offsets: Any) -> Item:
    """Return the planes of bodies, without those that only fill arrays."""
    real = [np.abs(np.asarray(d)) < NOWHERE / 10 for d in offsets]
    return {
        "normal": [_list(np.asarray(n)[k]) for n, k in zip(normals, real, strict=True)],
        "offset": [_list(np.asarray(d)[k]) for d, k in zip(offsets, real, strict=True)],
    }


def _sensors(
    scene: Scene, setup: Setup, q: Float[np.ndarray, " J"]
) -> tuple[Item, Parts, Int[np.ndarray, " K"]]:
    """Return the sensors and their occluders, what they see, and the number of each sensor among
    those of the certificate, its cones first and then its pyramids."""
    seen = setup_sight(scene, setup, q)
    beams = seen.cones if isinstance(seen, OccludedBeams) else seen
    if not isinstance(beams, Beams) or getattr(beams, "near", None) is not None:
        raise UncertifiedError("found beams that begin at a distance, allowed: cones and pyramids")
    if isinstance(seen, OccludedBeams) and np.isfinite(seen.dark[..., 0]).any():
        raise UncertifiedError(
            f"found sensors of one zone that report nothing beyond a body under occlusion"
            f" {scene.occlusion}, allowed: shadow or ignore"
        )
    live, of = np.asarray(beams.range_m) > 0, dict[type[Any], Any]({type(beams): True})
    if isinstance(beams, MixedBeams):
        mixed = zip(SHAPES, beams.which, strict=True)
        of = {shape: own for shape, own in mixed if own is not None}
    which = {k: np.flatnonzero(live & np.asarray(of.get(k, False))) for k in (Cones, Pyramids)}
    if sum(map(len, which.values())) < live.sum():
        raise UncertifiedError("found beams of other shapes, allowed: cones and pyramids")
    number = np.full(len(live), -1)
    number[np.concatenate([*which.values()])] = np.arange(live.sum())
    cones, pyramid = (
        {
            key: _list(np.asarray(getattr(beams, name))[k]) if len(k) else []
            for key, name in names.items()
        }
        for k, names in zip(which.values(), (_CONE, _CONE | _PYRAMID), strict=True)
    )
    around = occluders(scene, q)
    blocks = ([b.normal for b in around.obstacles], [b.offset for b in around.obstacles])
    found = {"capsules": _capsules(around.bodies), "polyhedra": _planes(*blocks)}
    return {"cones": cones, "pyramid": pyramid} | found, seen, number


_CONE = {"apex": "apex", "axis": "axis", "half": "half_angle", "length": "range_m"}
_PYRAMID = {"up": "up", "half_up": "size"}


def _covering(
    cells: SettledCells, seen: Parts, number: Int[np.ndarray, " K"]
) -> Int[np.ndarray, " C"]:
    """Return the sensor that sees all of each covered cell; -1 for the others."""
    by = np.full(len(cells.key), -1, np.int16)
    covered = np.flatnonzero(cells.state == COVERED)
    for some in np.array_split(covered, len(covered) // _CHUNK + 1):
        side = 2.0 ** cells.level[some]
        middle = decode(cells.key[some]) - float(OFFSET) + side[:, None] / 2
        least = np.full(len(some), np.inf)
        for k in np.flatnonzero(number >= 0):
            value = seen.part(cells.unit * middle, int(k))
            by[some[value < least]] = number[k]
            least = np.minimum(least, value)
    return by


def _filled(cells: SettledCells, by: Int[np.ndarray, " C"]) -> tuple[Any, Any, Any]:
    """Return levels, states and sensors of cells that fill all space, in order of their keys."""
    size = np.int64(1) << 3 * cells.level.astype(np.int64)
    ends = np.append(0, cells.key + size)
    gaps = np.flatnonzero(ends[:-1] < cells.key)
    at, levels = list[int](), list[int]()
    for start, stop, k in [
        *((int(ends[g]), int(cells.key[g]), int(g)) for g in gaps),
        (int(ends[-1]), 1 << _BITS, len(cells.key)),
    ]:
        while start < stop:
            aligned = (start & -start).bit_length() - 1 if start else _BITS
            level = min(aligned, (stop - start).bit_length() - 1) // 3
            at.append(k)
            levels.append(level)
            start += 1 << 3 * level
    fillers = np.array(levels, np.uint8)
    return (
        np.insert(cells.level, at, fillers),
        np.insert(cells.state, at, OUTSIDE),
        np.insert(by, at, -1),
    )
