"""What a beam collects from a field of prices, at all positions and azimuths of a link at once.

In cylindrical coordinates about a link's mount axis, a ring that moves along the axis or turns
about it shifts its beams, so the integral of a field over a beam of one tilt is a correlation:

    V(p, a) = sum over rho, theta, z of K(rho, theta - a, z - p) lambda(rho, theta, z).

K is the volume of each cell within the beam at azimuth 0 and position 0. The correlation is a
product of Fourier transforms, so one pass gives V at thousands of positions and azimuths.

The field is taken at the centres of the cells, and K cuts cells by the planes that touch the beam's
surface. Over a beam the errors within cells cancel but for the cells at its surface: the sum errs
by about step^2 / 24 times the integral of the field's slope over the surface (the Euler-Maclaurin
formula). ``error`` states that with the steepest slope, all of one sign. The cells' sides do not
all equal ``step`` and the surface is curved, so it is an estimate. The tests hold it against the
tables of ``BlurredBeam``, which are bounds.
"""

import math

import numpy as np
from jaxtyping import Complex, Float
from scipy import fft
from scipy.ndimage import map_coordinates

from .blurred_beam import STEEPEST, BlurredBeam, sweeps
from .families import Family
from .price_field import PriceField


class LinkCylinder:
    """Cells about the mount axis of a link, which hold a field of prices."""

    def __init__(
        self, family: Family, beam: BlurredBeam, field: PriceField, step: float, azimuths: int
    ) -> None:
        """Lay cells about a link.

        Args:
            family: the link's rings.
            beam: beam of each of their sensors.
            field: lattice of the prices.
            step: side of the cells along the axis and away from it, at most, m.
            azimuths: number of cells around the axis.
        """
        self.family, self.beam, self.field, self.azimuths = family, beam, field, azimuths
        length = family.mount.length
        parts = max(math.ceil(length / step), 1) if length > 0 else 0
        self.step = length / parts if parts else step
        self._positions = np.linspace(0, 1, parts + 1)
        rho, z = self._lattice()
        profile = beam.profile
        reach = float(np.hypot(profile.along, profile.radius).max()) + self.step
        first, last = max(z[0], -reach), min(z[1], length + reach)
        self._before = max(math.ceil(-first / self.step), 0)  # cells below position 0
        cells = self._before + max(math.ceil(last / self.step), parts) + 1
        rings = math.ceil(min(rho, reach + family.radius) / self.step)
        self._rho = ((np.arange(rings) + 0.5) * self.step).astype(np.float32)
        self._theta = (np.arange(azimuths) * (2 * math.pi / azimuths)).astype(np.float32)
        self._z = ((np.arange(cells) - self._before) * self.step).astype(np.float32)
        # kernels reach over ``parts`` more cells, which may wrap around onto each other
        self._shape = azimuths, int(fft.next_fast_len(cells + parts, real=True))
        self._cells = cells
        self._offset = np.arange(-self._before - parts, cells - self._before)  # of kernels
        keep = np.zeros(parts + 1, bool)  # near the family's positions
        for low, high in family.positions:
            a, b = math.floor(low * parts + 1e-9), math.ceil(high * parts - 1e-9)
            keep[max(a, 0) : min(b, parts) + 1] = True
        self._keep = np.flatnonzero(keep)
        self._spectrum: Complex[np.ndarray, "R A F"] | None = None

    def _lattice(self) -> tuple[float, tuple[float, float]]:
        """Return the largest distance from the axis, and the lowest and highest z, m, at which the
        lattice has prices."""
        m, T = self.family.mount, self.family.T_base_link
        axes = np.stack([m.zero, m.side, m.axis], axis=1)
        x, y, z = (((self.field.points - T[:3, 3]) @ T[:3, :3] - m.start) @ axes).T
        margin = 3 * self.field.sigma
        rho = float(np.hypot(x, y).max()) + margin
        return rho, (float(z.min()) - margin, float(z.max()) + margin)

    @property
    def places(self) -> Float[np.ndarray, " P"]:
        """Positions (P,) in [0, 1] of the rows of ``collected``: they enclose the family's."""
        kept: np.ndarray = self._positions[self._keep]
        return kept

    @property
    def error(self) -> float:
        """Error of what one beam collects, as a share of the target; an estimate."""
        surface = float(self.beam.profile.surface[2].sum())
        slope = STEEPEST / self.field.sigma
        return self.step**2 / 24 * slope * surface / self.field.grid.volume

    def load(self, prices: Float[np.ndarray, " J"], surface: bool = False) -> None:
        """Take a field of prices; with ``surface`` the prices on the target's surface only."""
        parts = max(math.ceil(self.field.spacing / self.step), 2)
        values, corner, side = self.field.sampled(prices, parts)
        m, T = self.family.mount, self.family.T_base_link
        axes = T[:3, :3] @ np.stack([m.zero, m.side, m.axis], axis=1)  # columns, base frame
        origin = T[:3, :3] @ m.start + T[:3, 3]
        spectrum = []
        for rho in self._rho:
            flat = rho * (
                np.cos(self._theta)[:, None] * axes[:, 0]
                + np.sin(self._theta)[:, None] * axes[:, 1]
            )
            points = flat[:, None] + self._z[:, None] * axes[:, 2] + origin
            points = points.reshape(-1, 3)
            cells = map_coordinates(values, ((points - corner) / side).T, order=1)
            grid = self.field.grid
            cells *= grid.steps(points) if surface else grid.inside(points)
            spectrum.append(fft.rfft2(cells.reshape(len(self._theta), -1), self._shape))
        self._spectrum = np.stack(spectrum).astype(np.complex64)

    def kernel(self, tilt: float) -> Complex[np.ndarray, "R A F"]:
        """Return the transform of the volumes of the cells within a beam of this tilt, as shares
        of the target."""
        p, half = self.beam.profile, self.azimuths // 2 + 1
        c, s = np.float32(math.cos(tilt)), np.float32(math.sin(tilt))
        z = (self._offset * self.step).astype(np.float32)
        cos, sin = np.cos(self._theta[:half]), np.sin(self._theta[:half])
        volume = self.step**2 * 2 * math.pi / self.azimuths / self.field.grid.volume
        slopes = np.gradient(p.radius, p.along)
        size, depth = self._shape
        spectrum = np.zeros((len(self._rho), size, depth // 2 + 1), np.complex64)
        for i, rho in enumerate(self._rho):
            x, y = rho * cos[:, None] - np.float32(self.family.radius), rho * sin[:, None]
            along, across = x * c + z * s, np.hypot(x * s - z * c, y)
            near = (along > p.along[0] - self.step) & (along < p.along[-1] + self.step)
            near &= across < p.radius.max() + self.step
            if not near.any():
                continue
            along, across = along[near], across[near]
            slope = np.interp(along, p.along, slopes)
            f = (across - np.interp(along, p.along, p.radius)) / np.sqrt(1 + slope * slope)
            inside = np.clip(0.5 - f / self.step, 0, 1)
            for end in (along - p.along[-1], p.along[0] - along):
                inside *= np.clip(0.5 - end / self.step, 0, 1)
            cells = np.zeros(near.shape, np.float32)
            cells[near] = inside * (rho * volume)
            whole = np.zeros(self._shape, np.float32)
            whole[:half, self._offset] = cells
            mirrored = self.azimuths - half + 1
            whole[half:] = whole[1:mirrored][::-1]
            spectrum[i] = fft.rfft2(whole)
        return spectrum

    def collected(
        self, tilt: float, kernel: Complex[np.ndarray, "R A F"] | None = None
    ) -> Float[np.ndarray, "P A"]:
        """Return what a beam of this tilt collects at each of ``places`` and each azimuth, as a
        share of the target.

        Raises:
            RuntimeError: before ``load``.
        """
        return self._correlated(self.kernel(tilt) if kernel is None else kernel)

    def _correlated(self, kernel: Complex[np.ndarray, "R A F"]) -> Float[np.ndarray, "P A"]:
        """Return the correlation of a kernel with the field at each place and azimuth."""
        if self._spectrum is None:
            raise RuntimeError("load a field of prices first")
        product = np.einsum("raf,raf->af", kernel.conj(), self._spectrum)
        values: np.ndarray = fft.irfft2(product, self._shape)
        return values[:, self._before + self._keep].T

    def edges(
        self, tilt: float, step: float, turn: float
    ) -> tuple[Float[np.ndarray, "P A"], Float[np.ndarray, "P A"]]:
        """Return how much what a beam collects may exceed the values at nodes because the price
        steps to 0 at the target's surface, after ``load`` with ``surface``.

        The surface adds the integral of |v| |v . n| times the price to -V'', over the curve where
        the beam's surface crosses it, with the velocity v of the beam's points.

        Args:
            tilt: tilt of the beam, rad.
            step: distance of the nodes along the link, m.
            turn: angle between them about its axis, rad.

        Returns:
            The excess between neighbouring places and azimuths (P, A), as a share of the target,
            and that by the tilt, divided by the square of the step in rad.

        Raises:
            RuntimeError: before ``load``.
        """
        p, n, area = self.beam.profile.surface
        c, s = math.cos(tilt), math.sin(tilt)
        radius, cell = self.family.radius, 2 * math.pi / self.azimuths
        x, y, z = radius - s * p[:, 0] + c * p[:, 2], p[:, 1], c * p[:, 0] + s * p[:, 2]
        by_position, by_tilt, by_azimuth = sweeps(p, n, tilt, radius)
        flat = by_azimuth * turn**2
        if self.family.mount.length > 0:
            flat = flat + by_position * step**2
        rows = np.rint(np.hypot(x, y) / self.step - 0.5).astype(int)
        around = np.rint(np.arctan2(y, x) / cell).astype(int) % self.azimuths
        column = np.rint(z / self.step).astype(int)
        near = (rows < len(self._rho)) & (column >= self._offset[0]) & (column <= self._offset[-1])
        where = np.maximum(rows[near], 0), around[near], column[near] % self._shape[1]
        shape = (len(self._rho), *self._shape)
        index = np.ravel_multi_index(where, shape)
        each = []
        for weight in (flat, by_tilt):
            weight = (weight * area)[near] / (4 * self.field.grid.volume)
            cells = np.bincount(index, weight, math.prod(shape)).reshape(shape)
            kernel = fft.rfft2(cells.astype(np.float32)).astype(np.complex64)
            each.append(np.maximum(self._correlated(kernel), 0.0))
        return each[0], each[1]
