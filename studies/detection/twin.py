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
from typing import Any, Literal, NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.special import ndtr

from ...coverage.detection.detection import Detection, detectors
from ...coverage.rings.ring import Setup
from ...coverage.sensors.sensor import Sensor
from ...formats.export.mjcf import mjcf
from ...formats.export.placed import PlacedSetup
from ...objectives.scene import Scene
from .rays import Rays, rays_of

Kind = Literal["box", "capsule", "cylinder"]
_ROBOT, _CELL, _BODY = 0, 1, 2  # groups of geoms; those of bodies follow
_FAINT = 0.05  # signal in standard deviations up to which a piece cannot be noticed
_AWAY = (0.0, 0.0, 1e3)  # m, where bodies are that are not in use


class TwinBody(NamedTuple):
    """A body of the twin that stands for a test piece, or for a part of a person."""

    kind: Kind
    """Shape; the axis of a capsule or cylinder is its z."""
    size: tuple[float, ...]
    """Half sizes, m; of a capsule or cylinder its radius and half its length."""
    group: int = 0
    """Bodies of one group are seen together."""


class Seen(NamedTuple):
    """What the twin's sensors make of one piece at one place."""

    noticed: bool
    """Whether enough sensors reported it, with drawn noise."""
    best: float
    """Probability that enough do, by the best zone of each."""
    any: float
    """Probability that enough do, by any of their zones."""


@dataclass(frozen=True)
class _Eye:
    """A sensor in the world."""

    apex: Float[np.ndarray, " 3"]
    """Apex, m."""
    frame: Float[np.ndarray, "3 3"]
    """Axes in columns: across, up, and the axis of the beam."""
    square: bool
    """Whether its beam is a pyramid."""
    rays: Rays
    """Its rays."""
    direction: Float[np.ndarray, "R 3"]
    """Directions of the rays in the base frame."""
    blocked: Float[np.ndarray, " R"]
    """Distance beyond which each ray sees nothing, m."""


@dataclass
class Twin:
    """A robot with a setup at a scene's first pose, and bodies that can be put anywhere."""

    scene: Scene
    setup: Setup
    detection: Detection
    bodies: Sequence[TwinBody]
    seed: int = 0
    model: Any = field(init=False)
    data: Any = field(init=False)
    eyes: list[_Eye] = field(init=False)

    def __post_init__(self) -> None:
        """Build the world, place it, and look where the robot and the cell block the rays."""
        import mujoco

        self._rng = np.random.default_rng(self.seed)
        placed = PlacedSetup(self.scene, self.setup, 0, Path())
        units = [s.unit for s in placed.sensors]
        self._needs = needs = detectors(units, self.detection)
        # both ends of the bounds are equal here
        self._threshold, self._quantile = needs.threshold[:, 0], needs.quantile[:, 0]
        self.model = _world(mjcf(placed)["scene.xml"].decode(), self.bodies)
        self.data = mujoco.MjData(self.model)
        mujoco.mj_resetDataKeyframe(self.model, self.data, 0)
        self.data.mocap_pos[:] = _AWAY
        mujoco.mj_kinematics(self.model, self.data)
        rays: dict[Sensor, Rays] = {}
        self.eyes = []
        for k, sensor in enumerate(placed.sensors):
            if sensor.unit not in rays:
                rows = int(self._needs.zones[k, 1])
                rays[sensor.unit] = rays_of(sensor.unit, rows, self._rng)
            self.eyes.append(self._eye(sensor.name, sensor.unit, rays[sensor.unit]))

    def _eye(self, name: str, unit: Sensor, rays: Rays) -> _Eye:
        site, occlusion = self.data.site(name), self.scene.occlusion
        apex, frame = site.xpos.copy(), site.xmat.reshape(3, 3).copy()
        direction = rays.direction @ frame.T
        groups = [_CELL] if occlusion == "ignore" else [_ROBOT, _CELL]
        blocked = self._cast(apex, direction, groups)
        if occlusion == "blind" and rays.zones == 1 and blocked.min() < unit.range_m:
            blocked = np.full_like(blocked, blocked.min())
        return _Eye(apex, frame, unit.square, rays, direction, blocked)

    def _cast(self, apex: Any, direction: Any, groups: Sequence[int]) -> Float[np.ndarray, " R"]:
        """Return the distance (R,) of the first body of some groups on each ray, m; infinite
        without one."""
        import mujoco

        n, wanted = len(direction), np.isin(np.arange(6), groups).astype(np.uint8)
        hit, distance = np.zeros(n, np.int32), np.zeros(n)
        vectors = np.ascontiguousarray(direction).ravel()
        # later versions can return normals too, and take an argument for them
        normals = (None,) if "normal" in (mujoco.mj_multiRay.__doc__ or "") else ()
        mujoco.mj_multiRay(
            self.model, self.data, apex, vectors, wanted, 1, -1, hit, distance, *normals, n, 1e3
        )
        return np.where(distance < 0, np.inf, distance)

    def put(
        self, body: int, centre: Float[np.ndarray, " 3"], frame: Float[np.ndarray, "3 3"]
    ) -> None:
        """Put a body at a place, m, with the axes in the columns of ``frame``; call ``place`` after
        the last one."""
        import mujoco

        self.data.mocap_pos[body] = centre
        mujoco.mju_mat2Quat(self.data.mocap_quat[body], np.ascontiguousarray(frame).ravel())

    def place(self) -> None:
        """Move the bodies to where they were put."""
        import mujoco

        mujoco.mj_kinematics(self.model, self.data)

    def light(self, k: int, group: int = 0) -> Float[np.ndarray, " Z"]:
        """Return the light that returns from the bodies of a group into each zone of sensor ``k``,
        over that of a target at the range R that fills the zone."""
        eye, needs = self.eyes[k], self._needs
        distance = self._cast(eye.apex, eye.direction, [_BODY + group])
        seen = (distance < eye.blocked) & (distance >= needs.least[k])
        light = np.where(seen, (needs.reach[k] / np.maximum(distance, 1e-9)) ** 2, 0.0)
        count = len(light) // eye.rays.zones
        return np.bincount(eye.rays.zone, light, eye.rays.zones) / count

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


def facing(eye: _Eye, centre: Float[np.ndarray, " 3"], slim: bool) -> Float[np.ndarray, "3 3"]:
    """Return the axes of a plate that faces a sensor, as the law has it: level with the sides of a
    square beam; of a round one, with its smaller side towards the axis.

    Args:
        eye: the sensor.
        centre: centre of the plate, m.
        slim: whether the plate's x is its smaller side.
    """
    across, _, axis = eye.frame.T
    if eye.square:
        return eye.frame
    v = centre - eye.apex
    out = v - (v @ axis) * axis
    out = out / np.linalg.norm(out) if np.linalg.norm(out) > 1e-9 else across
    side = np.cross(axis, out)
    return np.stack([out, side, axis] if slim else [-side, out, axis], axis=1)


def _tail(chances: Sequence[float], k: int) -> float:
    """Return the probability that at least ``k`` of independent events happen."""
    count = np.ones(1)
    for p in chances:
        count = np.convolve(count, [1 - p, p])
    return float(count[k:].sum())


def _world(xml: str, bodies: Sequence[TwinBody]) -> Any:
    """Return the model of a scene's MJCF with bodies that can be moved."""
    import mujoco

    spec = mujoco.MjSpec.from_string(xml)
    for geom in spec.geoms:
        geom.group = _CELL if geom.name.startswith("obstacle_") else _ROBOT
    for i, body in enumerate(bodies):
        held = spec.worldbody.add_body(name=f"piece_{i}", mocap=True)
        kind = getattr(mujoco.mjtGeom, f"mjGEOM_{body.kind.upper()}")
        size = [*body.size, 0.0, 0.0][:3]
        held.add_geom(type=kind, size=size, group=_BODY + body.group, mass=1.0)
    return spec.compile()
