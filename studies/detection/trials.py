"""Trials of the twin: test pieces at places, and people on walks."""

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from ...coverage.detection.pieces import TestPiece
from ...simulation.human import Bones
from ...simulation.twin.bodies import axes_along
from ...simulation.twin.world import TwinBody
from .twin import Seen, Twin, facing

PLATE, UPRIGHT = 0, 1
_THIN = 5e-4  # m, half the thickness of a plate


class PieceSeen(NamedTuple):
    """What the twin makes of a test piece at a place."""

    plate: Seen
    """For each sensor a plate that faces it, the silhouette that the law assumes."""
    upright: Seen
    """One upright cylinder for all sensors."""


def piece_bodies(piece: TestPiece) -> tuple[TwinBody, TwinBody]:
    """Return the two bodies that stand for a test piece."""
    width, height = piece.width_m / 2, piece.height_m / 2
    return TwinBody("box", (width, height, _THIN), PLATE), TwinBody(
        "cylinder", (width, height), UPRIGHT
    )


def trial(twin: Twin, piece: TestPiece, centre: Float[np.ndarray, " 3"]) -> PieceSeen:
    """Return what a twin with the piece's bodies makes of it at a place, m."""
    near = twin.near(centre, math.hypot(piece.width_m, piece.height_m) / 2)
    plates = []
    for k in near:
        slim = piece.width_m <= piece.height_m
        twin.world.put(PLATE, centre, facing(twin.eyes[k], centre, slim))
        twin.world.place()
        plates.append((k, twin.light(k, PLATE)))
    twin.world.put(UPRIGHT, centre, np.eye(3))
    twin.world.place()
    return PieceSeen(twin.seen(plates), twin.seen([(k, twin.light(k, UPRIGHT)) for k in near]))


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
            twin.world.put(i, centre[i], axes_along(way))
        twin.world.place()
        middle = (centre.min(axis=0) + centre.max(axis=0)) / 2
        reach = np.linalg.norm(bones.end[t] - bones.start[t], axis=1) / 2 + bones.radius
        radius = float((np.linalg.norm(centre - middle, axis=1) + reach).max())
        results.append(twin.seen([(k, twin.light(k)) for k in twin.near(middle, radius)]))
    return results
