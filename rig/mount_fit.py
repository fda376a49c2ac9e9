"""How rings are truly mounted: the errors that bring what is expected nearest to what was read, with their uncertainty.

Least squares over the readings that the known cell returns, ring by ring, as no ring's readings depend on another's.
Distances jump where a beam grazes an edge, so that a robust loss leads to the neighbourhood of the answer; there what is off
by more than five deviations is left out, as is what grazes, and plain least squares has the last word. Uncertainty follows
from the slopes and is scaled by the residuals themselves: noise larger than thought, or a cell that is not quite as told,
widens it.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy import stats
from scipy.optimize import least_squares

from ..coverage.rings import Ring, Setup
from ..objectives.scene import Scene
from .expected import CELL, expected
from .mount_model import LIMITS, NAMES, free, grazing, moved, slopes
from .noise import Noise
from .readings import Stops
from .wiring import Order, best_order, costs, mixed, reseated

CONFIDENCE = 0.95
_COARSE = 0.04  # m, by which a ring that is mounted a little wrong may read other than expected
_FINE = 0.003  # m, by which a fitted one may
_WIDEST = 4.0  # times ``LIMITS``: no error is sought beyond
_OUT = 5.0  # deviations
_FARTHEST = 8.0  # times a stage's width: what a jump may cost at most, so that no step is barred by one
_WIDTHS = (10.0, 3.0, 3.0)  # deviations, beyond which the robust loss is linear, stage by stage
_PLAIN = 6  # stages of plain least squares, at most
_SETTLED = 1e-3  # of ``LIMITS``, by which the values move in the last of them
_SEATINGS = 3  # rounds of fitting and asking who sits where
_STILL = 6.0  # deviations, within which a sensor that always tells the same varies
_OFTEN = 3  # stops at which a sensor that reads nothing at all should have read something
_ASTRAY = 4.0  # mean cost of a stop, above which that is not what its seat should tell


@dataclass(frozen=True)
class RingFit:
    """A ring as it was found to be mounted.

    nominal, ring: as proposed, and as built. names: of the p errors that were estimated, ``values`` (p,) m and rad with
    their ``covariance`` (p, p), from ``used`` readings with residuals of ``scale`` deviations. order, seat (n,): of each
    wire the seat. mixed: wires that sit elsewhere than the order says. dead: wires that tell nothing, or always the same.
    """

    nominal: Ring
    ring: Ring
    names: tuple[str, ...]
    values: Float[np.ndarray, " p"]
    covariance: Float[np.ndarray, "p p"]
    used: int
    scale: float
    order: Order
    seat: Int[np.ndarray, " n"]
    mixed: tuple[tuple[int, ...], ...]
    dead: tuple[int, ...]

    @property
    def freedom(self) -> int:
        """Degrees of freedom of the residuals."""
        return self.used - len(self.names)

    def margins(self, confidence: float = CONFIDENCE) -> Float[np.ndarray, " p"]:
        """By how much each value may be off by itself, m and rad, by Student's t."""
        return stats.t.ppf((1 + confidence) / 2, self.freedom) * np.sqrt(np.diag(self.covariance))

    def statistic(self, truth: Float[np.ndarray, " p"]) -> float:
        """How far ``truth`` (p,) is from the values, squared, in deviations, for each of them: of the F distribution."""
        off = truth - self.values
        return float(off @ np.linalg.solve(self.covariance, off)) / len(off)

    def holds(self, truth: Float[np.ndarray, " p"], confidence: float = CONFIDENCE) -> bool:
        """Does the joint region of all values hold ``truth`` (p,)? An ellipsoid, by the F distribution."""
        return bool(self.statistic(truth) <= stats.f.ppf(confidence, len(self.values), self.freedom))

    @property
    def open(self) -> tuple[str, ...]:
        """Errors that the readings do not tell: not known within what a careful mount keeps."""
        return tuple(name for name, m in zip(self.names, self.margins(), strict=True) if not m <= LIMITS[NAMES.index(name)])


class MountError(ValueError):
    """Readings that say nothing of how a ring is mounted."""


def fit_mount(scene: Scene, setup: Setup, stops: Stops, noise: Noise | None = None) -> tuple[RingFit, ...]:
    """How each ring of ``setup`` is mounted, from what was read at the stops of a mount check.

    Args:
        scene: with the known cell.
        setup: as proposed.
        stops: readings, wire by wire.
        noise: of the sensors, as far as it is known: only how it grows with distance matters.

    Raises:
        MountError: naming a ring of which too little was read.
    """
    noise, first = noise or Noise(), np.cumsum([0, *(r.count for r in setup.rings)])
    fits = []
    for i, ring in enumerate(setup.rings):
        k = slice(int(first[i]), int(first[i + 1]))
        try:
            mute = (stops.failed[:, k] == stops.total[:, k]).all(axis=0)
            fits.append(_fit(scene, ring, stops.joints, stops.distance[:, k], stops.valid[:, k], mute, noise))
        except MountError as error:
            raise MountError(f"ring {i} ({ring.link}): {error}") from error
    return tuple(fits)


@dataclass(frozen=True)
class _Read:
    """What a ring's n seats read at P stops, m, nan where nothing, and the deviation of each."""

    joints: Float[np.ndarray, "P J"]
    distance: Float[np.ndarray, "P n"]
    sigma: Float[np.ndarray, "P n"]


def _fit(
    scene: Scene,
    ring: Ring,
    joints: Float[np.ndarray, "P J"],
    measured: Float[np.ndarray, "P n"],
    valid: Int[np.ndarray, "P n"],
    mute: Bool[np.ndarray, " n"],
    noise: Noise,
) -> RingFit:
    """The fit of a ring of n sensors; ``mute`` ones never answered."""
    sigma = noise.at(np.nan_to_num(measured)) * math.sqrt(math.pi / 2) / np.sqrt(np.maximum(valid, 1))
    none, turned = ~np.isfinite(measured).any(axis=0), replace(ring, tilt=-ring.tilt)
    tables = {
        f: costs(measured, expected(scene, Setup((turned if f else ring,)), joints).distance, _COARSE) for f in (False, True)
    }
    order = best_order(tables, np.flatnonzero(none))
    start, seat, values = turned if order.flipped else ring, order.seat(ring.count), np.zeros(4)
    each = tables[order.flipped][np.arange(ring.count), seat] / len(joints)
    same = _still(measured, sigma)
    silent = np.flatnonzero(none | (same & (each > _ASTRAY)))
    read_by_wire = np.where(np.isin(np.arange(ring.count), silent), np.nan, measured)
    for _ in range(_SEATINGS):
        back = np.argsort(seat)
        read = _Read(joints, read_by_wire[:, back], sigma[:, back])
        values, covariance, used, scale = _least_squares(scene, start, read, values)
        built = moved(scene, start, values)
        wanted = expected(scene, Setup((built,)), joints).distance + values[3]
        spread = np.sqrt(
            (scale * noise.at(np.where(np.isfinite(wanted), wanted, 0.0))) ** 2 / max(_count(valid), 1) + _FINE**2
        )
        table = costs(measured, wanted, spread)
        again = reseated(table, seat, silent)
        if (again == seat).all():
            break
        seat = again
    some, often = free(scene, ring), np.isfinite(wanted).sum(axis=0)[seat] >= _OFTEN
    astray = table[np.arange(ring.count), seat] / len(joints) > _ASTRAY
    dead = mute | (none & often) | (same & astray)
    return RingFit(
        ring,
        built,
        tuple(NAMES[k] for k in some),
        values[some],
        covariance,
        used,
        scale,
        order,
        seat,
        tuple(mixed(order, seat)),
        tuple(int(i) for i in np.flatnonzero(dead)),
    )


def _count(valid: np.ndarray) -> float:
    """Readings of a median, as a rule."""
    return float(np.median(valid[valid > 0])) if (valid > 0).any() else 0.0


def _still(measured: Float[np.ndarray, "P n"], sigma: Float[np.ndarray, "P n"]) -> Bool[np.ndarray, " n"]:
    """Which wires told the same at all stops; so does a sensor that sees its own link."""
    read = np.isfinite(measured)
    low, high = (f(np.where(read, measured, fill), axis=0) for f, fill in ((np.min, np.inf), (np.max, -np.inf)))
    return (read.sum(axis=0) > 2) & (high - low <= _STILL * sigma.max(axis=0))


def _least_squares(
    scene: Scene, ring: Ring, read: _Read, values: Float[np.ndarray, " 4"]
) -> tuple[Float[np.ndarray, " 4"], Float[np.ndarray, "p p"], int, float]:
    """Errors (4,), covariance of those that are free, readings used, and the scale of their residuals."""
    some, scale = free(scene, ring), math.inf
    values = values.copy()
    for width in (*_WIDTHS, *[math.inf] * _PLAIN):
        loss, before = "soft_l1" if width < math.inf else "linear", values.copy()
        seen = expected(scene, Setup((moved(scene, ring, values),)), read.joints)
        with np.errstate(invalid="ignore"):
            off = (read.distance - values[3] - seen.distance) / read.sigma
        which = np.isfinite(off) & (seen.what == CELL)
        if loss == "linear":
            which &= np.abs(off) <= _OUT * max(_deviation(off[which]), 1e-9)
        which[which] = ~grazing(slopes(scene, moved(scene, ring, values), read.joints, which)[1])
        if which.sum() < 3 * len(some):
            raise MountError(f"found {int(which.sum())} readings of the cell, allowed: {3 * len(some)} and more")
        problem = _Problem(scene, ring, read, which, some, values, _FARTHEST * (width if width < math.inf else _OUT))
        found = least_squares(
            problem.residuals,
            np.clip(values[some] / LIMITS[some], -0.99 * _WIDEST, 0.99 * _WIDEST),
            problem.slopes,
            bounds=(-_WIDEST, _WIDEST),
            loss=loss,
            f_scale=min(width, 1e3),
            xtol=1e-5,
            ftol=1e-5,
            max_nfev=30,
        )
        values[some] = found.x * LIMITS[some]
        if loss == "linear" and np.all(np.abs(values - before) <= _SETTLED * LIMITS):
            break
    residuals = problem.residuals(found.x)
    scale = math.sqrt(float(residuals @ residuals) / (len(residuals) - len(some)))
    by = problem.slopes(found.x) / LIMITS[some]
    return values, scale**2 * _inverse(by.T @ by), len(residuals), scale


def _inverse(information: Float[np.ndarray, "p p"]) -> Float[np.ndarray, "p p"]:
    """The inverse, very large along what nothing is known of."""
    unit = LIMITS[-len(information) :]
    value, vector = np.linalg.eigh(information * unit[:, None] * unit)
    return (vector / np.maximum(value, 1e-9)) @ vector.T * unit[:, None] * unit


def _deviation(values: np.ndarray) -> float:
    """Standard deviation, by the median."""
    return 1.4826 * float(np.median(np.abs(values))) if len(values) else 0.0


class _Problem:
    """Residuals and slopes, in deviations, of the readings ``which`` by errors in ``LIMITS``; the last answer is kept."""

    def __init__(
        self, scene: Scene, ring: Ring, read: _Read, which: np.ndarray, some: np.ndarray, values: np.ndarray, most: float
    ):
        self.scene, self.ring, self.read, self.which, self.some = scene, ring, read, which, some
        self.fixed, self.most = values.copy(), most
        self.wanted, self.sigma = read.distance[which], read.sigma[which]
        self._at: np.ndarray | None = None

    def _look(self, x: np.ndarray) -> None:
        if self._at is None or not np.array_equal(x, self._at):
            self.fixed[self.some] = x * LIMITS[self.some]
            found, by = slopes(self.scene, moved(self.scene, self.ring, self.fixed), self.read.joints, self.which)
            off = (found + self.fixed[3] - self.wanted) / self.sigma
            self._residuals = np.clip(off, -self.most, self.most)
            told = (np.abs(off) < self.most) & ~grazing(by)
            self._slopes = np.where(told[:, None], (by * LIMITS)[:, self.some] / self.sigma[:, None], 0.0)
            self._at = x.copy()

    def residuals(self, x: np.ndarray) -> np.ndarray:
        self._look(x)
        return self._residuals

    def slopes(self, x: np.ndarray) -> np.ndarray:
        self._look(x)
        return self._slopes
