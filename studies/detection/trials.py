"""Trials of the twin: test pieces at places, and people on walks."""

import math

import numpy as np
from jaxtyping import Float, Int

from ...coverage.detection.pieces import TestPiece
from ...formats.export.markup import turn_to
from ...simulation.human import Bones
from ...simulation.twin.world import TwinBody
from .twin import Seen, Twin


def trial(twin: Twin, piece: TestPiece, centre: Float[np.ndarray, " 3"]) -> Seen:
    """Return what a twin with the piece's body makes of it at a place, m."""
    twin.world.put(0, centre, np.eye(3))
    twin.world.place()
    near = twin.near(centre, math.hypot(piece.width_m, piece.height_m) / 2)
    return twin.seen([(k, twin.light(k)) for k in near])


def piece_body(piece: TestPiece) -> TwinBody:
    """Return the upright body that stands for a test piece."""
    return TwinBody("cylinder", (piece.width_m / 2, piece.height_m / 2))


def person_bodies(bones: Bones) -> list[TwinBody]:
    """Return a capsule for each segment of a person."""
    half = np.linalg.norm(bones.end[0] - bones.start[0], axis=1) / 2
    return [TwinBody("capsule", (r, h)) for r, h in zip(bones.radius, half, strict=True)]


def walker(twin: Twin, bones: Bones, moments: Int[np.ndarray, " M"]) -> list[Seen]:
    """Return what a twin with the person's bodies makes of it at some moments of a walk."""
    results = []
    for t in moments:
        centre = (bones.start[t] + bones.end[t]) / 2
        for i, way in enumerate(bones.end[t] - bones.start[t]):
            twin.world.put(i, centre[i], turn_to(way / np.linalg.norm(way)))
        twin.world.place()
        middle = (centre.min(axis=0) + centre.max(axis=0)) / 2
        reach = np.linalg.norm(bones.end[t] - bones.start[t], axis=1) / 2 + bones.radius
        radius = float((np.linalg.norm(centre - middle, axis=1) + reach).max())
        results.append(twin.seen([(k, twin.light(k)) for k in twin.near(middle, radius)]))
    return results
