"""Line-of-sight table on a grid of mount positions, an approximation for the exchange.

The sensor positions of a link lie on a cylinder about its mount. For each position on a grid, the
table stores whether the line of sight to each point is clear of all bodies and obstacles, or, for
sensors that occluders blind, the distance at which a sensor of a given tilt is blinded. A sensor is
looked up at the nearest grid position.
"""

import math
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from ...coverage.occlusion.first_return import Beam, capsule_in_beam, polyhedron_in_beam
from ...coverage.occlusion.occluders import Occluders
from ...coverage.robots.robot import Mount
from ...coverage.sensors.sensor import Sensor
from ...coverage.solids.segments import segment_to_segment

# grid size: heights along the mount, azimuths around it, tilts from end to end of the mount
_HEIGHTS, _TURNS, _TILTS = 12, 24, 9
# m, by which bodies are shrunk: the apex of a sensor on a board lies no deeper in its link
_SLACK = 0.002
# start, end (B, 3) m and radius (B,) m of capsules, and normals (F, 3) and offsets (F,) m of the
# faces of each obstacle
Bodies = tuple[tuple[jax.Array, jax.Array, jax.Array] | None, list[tuple[jax.Array, jax.Array]]]


@dataclass(frozen=True)
class VisibilityTable:
    """Lines of sight of one link's sensors, on a grid of H heights and A azimuths.

    Either ``clear`` or ``stop`` is set.
    """

    length: float
    """Length of the mount, m."""
    pose: Int[np.ndarray, " N"]
    """Pose of each point."""
    clear: Bool[np.ndarray, "C N"] | None
    """Whether the line of sight from each grid position (H * A) to each point (N) is clear."""
    stop: Float[np.ndarray, "P C T"] | None
    """Distance at which a sensor is blinded, m, for P poses, H * A grid positions and T tilts."""

    def sees(
        self,
        number: Int[np.ndarray, " M"],
        height: Float[np.ndarray, " M"],
        azimuth: Float[np.ndarray, " M"],
        tilt: Float[np.ndarray, " M"],
        square: Float[np.ndarray, " M"],
    ) -> Bool[np.ndarray, " M"]:
        """Return whether each of M sensors has a line of sight to a point in its cone.

        Args:
            number: numbers (M,) of the points.
            height: heights (M,) of the sensors along the mount, m.
            azimuth: azimuths (M,) of the sensors, rad.
            tilt: tilts (M,) of the sensors, rad.
            square: squared distances (M,) from sensor to point, m^2.
        """
        up = np.rint(height * ((_HEIGHTS - 1) / self.length)).astype(int) if self.length else 0
        cell = up * _TURNS + np.rint(azimuth * (_TURNS / (2 * math.pi))).astype(int) % _TURNS
        if self.clear is not None:
            clear: np.ndarray = self.clear[cell, number]
            return clear
        assert self.stop is not None
        way = np.rint((tilt / math.pi + 0.5) * (_TILTS - 1)).astype(int)
        reached: np.ndarray = square <= self.stop[self.pose[number], cell, way] ** 2
        return reached


def build_visibility_table(
    mount: Mount,
    radius: float,
    sensor: Sensor,
    frames: Float[np.ndarray, "P 4 4"],
    occluders: list[Occluders],
    points: list[Float[np.ndarray, "N 3"]],
    pose: list[int],
    blinded: bool,
) -> VisibilityTable:
    """Compute the line-of-sight table of the sensors on a mount.

    Args:
        mount: the mount.
        radius: radius of the rings, m.
        sensor: sensor of the rings.
        frames: frame of the mount's link at each of P poses, T_base_frame.
        occluders: bodies and obstacles at each pose.
        points: points of each term, m in the base frame; each term has the same number.
        pose: pose of each term.
        blinded: whether an occluder in a sensor's cone blinds it (first return) instead of casting
            a shadow.
    """
    heights = np.linspace(0, mount.length, _HEIGHTS if mount.length else 1)
    turns = np.arange(_TURNS) * (2 * math.pi / _TURNS)
    radial = np.cos(turns)[:, None] * mount.zero + np.sin(turns)[:, None] * mount.side
    seat = (mount.start + heights[:, None, None] * mount.axis + radius * radial).reshape(-1, 3)
    stops, clear = [], []
    if blinded:
        tilts = np.linspace(-math.pi / 2, math.pi / 2, _TILTS)
        look = np.cos(tilts)[:, None] * radial[:, None] + np.sin(tilts)[:, None] * np.asarray(
            mount.axis
        )
        look = np.tile(look, (len(heights), 1, 1))
        stops = [
            _stop(seat @ T[:3, :3].T + T[:3, 3], look @ T[:3, :3].T, sensor, o)
            for T, o in zip(frames, occluders, strict=True)
        ]
    else:
        for some, p in zip(points, pose, strict=True):
            apex = seat @ frames[p, :3, :3].T + frames[p, :3, 3]
            clear.append(
                np.asarray(
                    _clear(
                        *(jnp.asarray(a, jnp.float32) for a in (apex, some)), _bodies(occluders[p])
                    )
                )
            )
    each = np.repeat(pose, [len(some) for some in points])
    return VisibilityTable(
        mount.length,
        each,
        np.concatenate(clear, axis=1) if clear else None,
        np.stack(stops) if stops else None,
    )


def _stop(
    apex: Float[np.ndarray, "C 3"],
    look: Float[np.ndarray, "C T 3"],
    sensor: Sensor,
    occluders: Occluders,
) -> Float[np.ndarray, "C T"]:
    """Return the distance at which each tilted sensor is blinded, m."""
    beam = Beam(
        np.repeat(apex, _TILTS, axis=0),
        look.reshape(-1, 3),
        *(
            np.full(look.shape[0] * _TILTS, v)
            for v in (sensor.inscribed_half_angle, sensor.range_m)
        ),
    )
    nearest = np.full(len(beam.apex), np.inf)
    if (bodies := occluders.bodies) is not None:
        wide = Beam(*(a[:, None] for a in beam))
        nearest = capsule_in_beam(
            wide, bodies.start[None], bodies.end[None], bodies.radius[None] - _SLACK
        )[0].min(axis=1)
    for body in occluders.obstacles:
        nearest = np.minimum(nearest, polyhedron_in_beam(beam, body))
    return nearest.reshape(len(apex), _TILTS)


def _bodies(occluders: Occluders) -> Bodies:
    bodies, planes = occluders.bodies, [(o.normal, o.offset) for o in occluders.obstacles]
    capsules = None if bodies is None else (bodies.start, bodies.end, bodies.radius - _SLACK)
    both: Bodies = jax.tree.map(lambda a: jnp.asarray(a, jnp.float32), (capsules, planes))
    return both


@jax.jit
def _clear(
    apex: Float[jax.Array, "C 3"], points: Float[jax.Array, "N 3"], bodies: Bodies
) -> Bool[jax.Array, "C N"]:
    """Return whether the line of sight from each apex (C, 3) to each point (N, 3) is clear
    (C, N)."""
    capsules, planes = bodies

    def of_one(a: Float[jax.Array, " 3"]) -> Bool[jax.Array, " N"]:
        hidden = jnp.zeros(len(points), bool)
        if capsules is not None:
            start, end, radius = capsules
            gaps = (
                segment_to_segment(a[None, None], points[:, None], start[None], end[None])
                - radius[None]
            )
            hidden |= (gaps < 0).any(axis=1)
        for normal, offset in planes:
            here, there = (normal @ a - offset)[None], points @ normal.T - offset[None]
            steep = there - here
            place = -here / jnp.where(steep == 0, 1.0, steep)
            enter = jnp.where(steep < 0, place, 0.0).max(axis=1, initial=0.0)
            leave = jnp.where(steep > 0, place, 1.0).min(axis=1, initial=1.0)
            hidden |= (enter < leave) & ~((steep == 0) & (here > 0)).any(axis=1)
        return ~hidden

    clear: jax.Array = jax.lax.map(of_one, apex)
    return clear
