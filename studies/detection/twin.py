"""A twin of a scene in MuJoCo: it predicts nothing, but casts rays, adds noise and counts reports.

The twin shares no geometry with the law of detection. Robot, cell and sensors come from the scene's
own MJCF, and MuJoCo places them and casts the rays. The light that a zone receives is the mean over
its rays of (R / distance)² where they meet the test piece first, and 0 elsewhere. It stands above
noise of standard deviation 1, a new one for each zone and frame. Only figures are shared: the range
R, the share of frames that report a target there, the threshold, the frames in time, and the least
range.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.special import ndtr

from ...coverage.detection.detection import Detection, detectors
from ...coverage.rings.ring import Setup
from ...coverage.sensors.sensor import Sensor
from ...formats.export.placed import PlacedSetup
from ...objectives.scene import Scene
from ...simulation.twin.light import Eye, eye_of
from ...simulation.twin.light_rays import LightRays, rays_of
from ...simulation.twin.world import BODIES, CELL, ROBOT, TwinBody, TwinWorld, scene_world

_FAINT = 0.05  # signal in standard deviations up to which a piece cannot be noticed


class Seen(NamedTuple):
    """What the twin's sensors make of one piece at one place."""

    noticed: bool
    """Whether enough sensors reported it, with drawn noise."""
    best: float
    """Probability that enough do, by the best zone of each."""
    any: float
    """Probability that enough do, by any of their zones."""


@dataclass
class Twin:
    """A robot with a setup at a scene's first pose, and bodies that can be put anywhere."""

    scene: Scene
    setup: Setup
    detection: Detection
    bodies: Sequence[TwinBody]
    seed: int = 0
    world: TwinWorld = field(init=False)
    eyes: list[Eye] = field(init=False)

    def __post_init__(self) -> None:
        """Build the world, place it, and look where the robot and the cell block the rays."""
        self._rng = np.random.default_rng(self.seed)
        placed = PlacedSetup(self.scene, self.setup, 0, Path())
        units = [s.unit for s in placed.sensors]
        self._needs = needs = detectors(units, self.detection)
        # both ends of the bounds are equal here
        self._threshold, self._quantile = needs.threshold[:, 0], needs.quantile[:, 0]
        self.world = scene_world(placed, self.bodies)
        occlusion = self.scene.occlusion
        groups = [CELL] if occlusion == "ignore" else [ROBOT, CELL]
        rays: dict[Sensor, LightRays] = {}
        self.eyes = []
        for k, unit in enumerate(units):
            if unit not in rays:
                rays[unit] = rays_of(unit, int(needs.zones[k, 1]), self._rng)
            self.eyes.append(eye_of(self.world, k, unit, rays[unit], groups, occlusion == "blind"))

    def light(self, k: int, group: int = 0) -> Float[np.ndarray, " Z"]:
        """Return the light that returns from the bodies of a group into each zone of sensor ``k``,
        over that of a target at the range R that fills the zone."""
        reach, least = float(self._needs.reach[k]), float(self._needs.least[k])
        return self.eyes[k].light(self.world, [BODIES + group], reach, least)

    def near(self, centre: Float[np.ndarray, " 3"], radius: float) -> list[int]:
        """Return the sensors that may notice a body within ``radius`` m about a place: those whose
        beam it may meet, near enough to stand above the noise."""
        needs, kept = self._needs, []
        for k, eye in enumerate(self.eyes):
            v = centre - eye.apex
            away = float(np.linalg.norm(v))
            most = (needs.reach[k] / max(away - radius, 1e-9)) ** 2
            if most * (self._threshold[k] + self._quantile[k]) < _FAINT:
                continue
            wide = np.arccos(np.clip(eye.rays.direction[:, 2].min(), -1, 1))
            angle = np.arccos(np.clip(v @ eye.frame[:, 2] / max(away, 1e-9), -1, 1))
            if away <= radius or angle <= wide + np.arcsin(min(radius / away, 1.0)):
                kept.append(k)
        return kept

    def seen(self, lights: Sequence[tuple[int, Float[np.ndarray, " Z"]]]) -> Seen:
        """Return whether enough sensors report what sends this light into their zones.

        A report counts that noise alone would not have made.
        """
        noticed, best, several = 0, list[float](), list[float]()
        for k, light in lights:
            b, frames = self._threshold[k], int(self._needs.frames[k])
            signal = light[light > 0] * (b + self._quantile[k])
            noise = self._rng.standard_normal((frames, len(signal)))
            noticed += bool(((noise + signal > b) & (noise <= b)).any())
            missed = 1 - (ndtr(b) - ndtr(b - signal))
            best.append(1 - missed.min(initial=1.0) ** frames)
            several.append(1 - missed.prod() ** frames)
        k = self.detection.at_least
        return Seen(noticed >= k, _tail(best, k), _tail(several, k))


def _tail(chances: Sequence[float], k: int) -> float:
    """Return the probability that at least ``k`` of independent events happen."""
    count = np.ones(1)
    for p in chances:
        count = np.convolve(count, [1 - p, p])
    return float(count[k:].sum())
