"""The share of a Gaussian ball of points that lies in a beam, and how sharply it can bend.

A price field (``price_field``) is a sum of Gaussians about the points of a lattice. Its integral
over a beam is therefore a sum of one function: the probability that a point drawn from a normal
distribution about p lies in the beam. Beams are bodies of revolution here, so this probability
depends on two coordinates of p only, along the beam's axis and away from it. It is tabulated once:

    share(d, rho) = integral over the beam of N(t - d; s) F(r(t), rho; s) dt,

with r(t) the beam's radius at t, and F the probability that a normal point at distance rho from the
axis lies within r of it: a noncentral chi-squared distribution with two degrees of freedom.

A beam that is no body of revolution is replaced by one that holds it. A bound stays a bound, as a
larger beam covers more.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float
from scipy.special import chndtr

from ...coverage.sensors.sensor import Sensor

TAIL = 5.0
"""Standard deviations from the beam at which the table ends; beyond, a share is below 3e-7."""
SMALL = 2e-6
"""Shares below this count as this."""
_STEPS = 64  # steps of the table per standard deviation
_NODES = 160  # least number of nodes of the quadrature along the axis
_PER_SIGMA = 4  # least number of nodes per standard deviation
_MOST = 2000  # most nodes
# bilinear interpolation errs by at most (step^2 / 8) (|f_dd| + |f_rr|), and each of these second
# derivatives is at most 0.25 / sigma^2; plus 32-bit rounding
_MARGIN = 0.5 / 8 / _STEPS**2 + 1e-6
STEEPEST = 0.445
"""Bound of the gradient of a price field, times sigma: the largest lattice sum of the positive part
of a Gaussian's derivative. Its mean over all offsets is 1 / sqrt(2 pi) = 0.399; it is largest half
way between two lattice planes, 0.442 for the ``WIDTH`` 0.7 of a price field."""


@dataclass(frozen=True)
class Profile:
    """A body of revolution about the beam's axis that holds the beam: radius against distance."""

    along: Float[np.ndarray, " N"]
    """Nodes of a quadrature along the axis, from the apex, m."""
    weight: Float[np.ndarray, " N"]
    """Weights of the nodes, m."""
    radius: Float[np.ndarray, " N"]
    """Radius of the body at each node, m."""

    @staticmethod
    def of(sensor: Sensor, sigma: float = math.inf) -> "Profile":
        """Return the smallest body of revolution known to hold the beam of ``sensor``.

        Its nodes resolve Gaussians of standard deviation ``sigma``, if ``resolves`` is true.
        """
        low, high = sensor.near_m, sensor.range_m
        if not sensor.form.ends_flat:
            high = sensor.farthest
            low = min(0.0, high * math.cos(sensor.half_angle))
        node, weight = np.polynomial.legendre.leggauss(
            min(max(_NODES, math.ceil(_PER_SIGMA * (high - low) / sigma)), _MOST)
        )
        along = low + (high - low) * (node + 1) / 2
        radius = sensor.form.radius(sensor.sizes, along)
        return Profile(along, weight * (high - low) / 2, np.maximum(radius, 0.0))

    def resolves(self, sigma: float) -> bool:
        """Return whether the nodes resolve Gaussians of standard deviation ``sigma`` m."""
        return len(self.along) * sigma >= _PER_SIGMA * float(self.weight.sum())

    @cached_property
    def volume(self) -> float:
        """Volume of the body, m^3."""
        return float(math.pi * (self.weight * self.radius**2).sum())

    @cached_property
    def cloud(self) -> tuple[np.ndarray, np.ndarray]:
        """Points (M, 3) m in the body and their volumes (M,) m^3; the axis of the body is z."""
        some = np.linspace(0, len(self.along) - 1, 49)
        ends = np.interp(some, np.arange(len(self.along)), self.along)
        middle, thick = (ends[1:] + ends[:-1]) / 2, np.diff(ends)
        radius = np.interp(middle, self.along, self.radius)
        turn = np.arange(40) * (math.pi * (3 - math.sqrt(5)))  # a sunflower's seeds
        out = np.sqrt((np.arange(40) + 0.5) / 40)
        disc = np.stack([out * np.cos(turn), out * np.sin(turn)], axis=1)
        points = np.empty((48, 40, 3))
        points[..., :2] = radius[:, None, None] * disc
        points[..., 2] = middle[:, None]
        volumes = np.repeat(math.pi * radius**2 * thick / 40, 40)
        return points.reshape(-1, 3), volumes * (self.volume / volumes.sum())

    @cached_property
    def surface(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Points (M, 3) m on the body's surface, their normals (M, 3) and areas (M,) m^2.

        The axis of the body is z. The lateral surface is made of frustums between the nodes, and
        discs close the ends.
        """
        turn = (np.arange(48) + 0.5) * (2 * math.pi / 48)
        ring = np.stack([np.cos(turn), np.sin(turn), np.zeros(48)], axis=1)
        points, normals, areas = [], [], []
        t = np.concatenate([self.along[:1], self.along, self.along[-1:]])
        r = np.concatenate([[0.0], self.radius, [0.0]])
        parts = 12  # the end discs are wide: they need several rings
        for a, b, p, q in zip(t[:-1], t[1:], r[:-1], r[1:], strict=True):
            for i in range(parts if a == b else 1):
                n = parts if a == b else 1
                r0, r1 = p + (q - p) * i / n, p + (q - p) * (i + 1) / n
                slant, middle = math.hypot(b - a, r1 - r0), (r0 + r1) / 2
                if slant == 0:
                    continue
                normal = ring * ((b - a) / slant)
                normal[:, 2] = -(r1 - r0) / slant
                points.append(ring * middle + np.array([0, 0, (a + b) / 2]))
                normals.append(normal)
                areas.append(np.full(48, slant * middle * 2 * math.pi / 48))
        return np.concatenate(points), np.concatenate(normals), np.concatenate(areas)


class BlurredBeam:
    """The share of a Gaussian ball in a beam, as a table that never lies below it."""

    def __init__(self, sensor: Sensor, sigma: float) -> None:
        """Tabulate the share for Gaussians of standard deviation ``sigma`` m."""
        self.profile, self.sigma = Profile.of(sensor, sigma), sigma
        p, step = self.profile, sigma / _STEPS
        wide, margin = float(p.radius.max()), TAIL * sigma
        self._low, self._step = float(p.along[0]) - margin, step
        d = self._low + step * np.arange(
            math.ceil((p.along[-1] - p.along[0] + 2 * margin) / step) + 1
        )
        rho = step * np.arange(math.ceil((wide + margin) / step) + 1)
        across = chndtr((p.radius / sigma)[:, None] ** 2, 2.0, (rho / sigma)[None] ** 2)
        across = np.where(p.radius[:, None] > 0, across, 0.0)
        along = np.exp(-(((d[:, None] - p.along) / sigma) ** 2) / 2)
        along *= p.weight / (math.sqrt(2 * math.pi) * sigma)
        table = np.minimum(np.maximum(along @ np.nan_to_num(across), 0.0) + _MARGIN, 1.0)
        self._table = table.astype(np.float32)
        # where the share is below SMALL: it falls with the distance from the axis
        wide = np.count_nonzero(table > SMALL + _MARGIN, axis=1)
        wide = np.maximum(np.maximum(wide, np.append(wide[1:], 0)), np.insert(wide[:-1], 0, 0))
        wide = np.minimum(wide * step, rho[-2])
        wide[0] = wide[-2:] = 0.0
        self._limit = (wide * wide).astype(np.float32)

    def share(
        self, along: Float[np.ndarray, "*shape"], square: Float[np.ndarray, "*shape"]
    ) -> Float[np.ndarray, "*shape"]:
        """Return an upper bound of the share of each Gaussian in the beam, 32 bits.

        Args:
            along: component of the vector from apex to centre along the beam's axis, m.
            square: its squared distance from the axis, m^2.
        """
        rows, columns = self._table.shape
        x = (along - np.float32(self._low)) * np.float32(1 / self._step)
        row = np.clip(x, 0, rows - 1).astype(np.int32)
        inside = np.flatnonzero(square < self._limit[row])
        share = np.full(x.size, np.float32(SMALL))
        i, x = row.ravel()[inside], x.ravel()[inside]
        y = np.sqrt(np.maximum(square.ravel()[inside], 0)) * np.float32(1 / self._step)
        x -= i
        j = y.astype(np.int32)
        y -= j
        flat, at = self._table.ravel(), i * np.int32(columns) + j
        low, high = flat[at], flat[at + 1]
        low += (flat[at + columns] - low) * x
        high += (flat[at + (columns + 1)] - high) * x
        share[inside] = low + (high - low) * y
        return share.reshape(along.shape)

    def bends(self, tilts: Float[np.ndarray, " T"], radius: float) -> Float[np.ndarray, " 3"]:
        """Return bounds of how sharply the integral of a price field over the beam can bend.

        For a field with a gradient of at most G, the integral V over a beam that moves along a
        one-parameter group of rigid motions with the velocity field v has the derivative integral
        of (grad . v) over the beam. In a step the beam gains and loses what its surface sweeps, so
        -V'' <= G * integral over the surface of |v| |v . n| (Reynolds' transport theorem).

        Args:
            tilts: tilts (T,) rad over which to take the largest value.
            radius: radius of the ring, m.

        Returns:
            Bounds of -V'' by the position, m^3/m^2, by the tilt and by the azimuth, m^3/rad^2.
        """
        p, n, area = self.profile.surface
        most = np.zeros(3)
        for tilt in tilts:
            each = sweeps(p, n, float(tilt), radius)
            most = np.maximum(most, [(v * area).sum() for v in each])
        return most * (1.02 * STEEPEST / self.sigma)


def sweeps(
    points: Float[np.ndarray, "M 3"],
    normals: Float[np.ndarray, "M 3"],
    tilt: float,
    radius: float,
) -> Float[np.ndarray, "3 M"]:
    """Return |v| |v . n| at points of a beam's surface that moves by its ring's position (without
    unit), tilt and azimuth (m^2/rad^2); in the beam's frame, whose z is its axis."""
    # columns: mount axis, radial, tangent
    c, s = math.cos(tilt), math.sin(tilt)
    mount, radial = np.array([c, 0.0, s]), np.array([-s, 0.0, c])
    fields = (
        np.broadcast_to(mount, points.shape),
        np.cross(np.array([0.0, 1.0, 0.0]), points),
        np.cross(mount, points + radius * radial),
    )
    return np.stack([np.linalg.norm(v, axis=1) * np.abs((v * normals).sum(axis=1)) for v in fields])
