"""Tasks of the study: random rings, and predictions beside what the twin sees."""

import json
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from ...coverage.detection.detection import Detection
from ...coverage.detection.pieces import PIECES
from ...objectives.detection_share import at_pose, noticed_in, several_zones
from ...objectives.verify import Verifier
from ...placement.space.design import Space
from ...placement.space.starts import fresh
from ...simulation.human import PEDESTAL, bones
from ...simulation.walk import walk
from ..engine.runner import register
from ..engine.scenes import Rings, Sensors, asked_from, ring_keys, scene_from, setup_from
from .trials import person_bodies, piece_body, trial, walker
from .twin import Twin

BINS = 10
"""Bins of equal width of the probability that the law predicts at a place."""
VOXEL = 0.03
"""Side of the voxels of predictions, m."""
_SOBOL = 16  # sample points of the target for each place that is drawn among them
WALK, EVERY, NEAR = 40.0, 0.4, 2.0
"""Length of a walk and time between its moments, s; moments count when the person stands within
this distance of the base's axis, m."""


@register("random rings")
def random_rings(scene: Mapping[str, Any], seed: int, sensors: int) -> Rings:
    """Draw rings that the rules of a scene allow."""
    where = scene_from(scene)
    space = Space(where, sensors=sensors)
    setup = space.setup(fresh(space, np.random.default_rng(seed)))
    return ring_keys(setup, where.sensor)


def detection_of(
    piece: str, reflectance: float, seconds: float, at_least: int, ambient: str | None
) -> Detection:
    """Return a question of detection from the data of a cell."""
    return Detection(
        PIECES[piece], ambient=ambient, seconds=seconds, at_least=at_least, reflectance=reflectance
    )


@lru_cache(maxsize=2)
def _verifier(scene: str) -> Verifier:
    """Return a verifier; the latest ones are cached with their voxels for neighbouring cells."""
    return Verifier(scene_from(json.loads(scene)), VOXEL)


@register("twin trials")
def trials(
    scene: Mapping[str, Any],
    setup: str | Rings | Sensors,
    target: str,
    radius: float | None,
    places: int,
    seed: int,
    **question: Any,
) -> dict[str, Any]:
    """Predict ζ of detection, and let the twin see the piece at random places of the target.

    Returns:
        The prediction and the largest sampling error of its count, in percent; how often enough
        sensors of the twin reported the piece, and the means of its probabilities in percent; and
        by the law's probability at a place, in bins: the number of places, the sum of the
        probabilities, and the reports.
    """
    verifier, detection = _verifier(json.dumps(scene, sort_keys=True)), detection_of(**question)
    where = verifier.scene
    rings, volume = asked_from(where, setup, target, radius)
    predicted = at_pose(verifier, rings, volume, 0, detection)
    rng = np.random.default_rng(seed)
    points = where.sample(volume, 0, _SOBOL * places, seed)
    points = points[rng.choice(len(points), places, replace=False)]
    twin = Twin(where, rings, detection, [piece_body(detection.piece)], seed)
    seen = [trial(twin, detection.piece, point) for point in points]
    law = noticed_in(where, rings, 0, detection).at(points)
    bin_of = np.minimum((law * BINS).astype(int), BINS - 1)
    each = np.ones(places), law, np.array([s.noticed for s in seen])
    return {
        "predicted_percent": 100 * predicted.zeta,
        "error_percent": 100 * (predicted.error or 0.0),
        "several_zones": several_zones(where, rings),
        "places": places,
        "noticed": sum(s.noticed for s in seen),
        "best_percent": 100 * float(np.mean([s.best for s in seen])),
        "any_percent": 100 * float(np.mean([s.any for s in seen])),
        "bins": [np.bincount(bin_of, values, BINS).round(6).tolist() for values in each],
    }


@register("twin walk")
def walks(
    scene: Mapping[str, Any],
    setup: str | Rings | Sensors,
    walks: int,
    seed: int,
    **question: Any,
) -> dict[str, Any]:
    """Predict at how many moments of some walks a person is noticed, and let the twin see them.

    The law knows where the middle of the person's height is; the twin sees a body of capsules.

    Returns:
        The number of moments, the prediction in percent, and how often enough sensors reported the
        person.
    """
    where, detection = scene_from(scene), detection_of(**question)
    rings = setup_from(setup, where)
    law, sums, noticed = noticed_in(where, rings, 0, detection), list[float](), 0
    for number in range(seed, seed + walks):
        path = walk(number, np.arange(0.0, WALK, EVERY))
        body = bones(path.stature, path.posture)
        near = np.flatnonzero(np.hypot(*path.posture.position.T) <= NEAR)
        position = path.posture.position[near]
        height = np.full(len(near), path.stature / 2 - PEDESTAL)
        sums += law.at(np.column_stack([position, height])).tolist()
        twin = Twin(where, rings, detection, person_bodies(body), number)
        noticed += sum(seen.noticed for seen in walker(twin, body, near))
    return {
        "moments": len(sums),
        "predicted_percent": 100 * float(np.mean(sums)),
        "several_zones": several_zones(where, rings),
        "noticed": noticed,
    }
