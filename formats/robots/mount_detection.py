"""Tube-like intervals of a link, around which a ring can be closed, from its cross sections."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from .enclosing_circle import across, circle_centre

STATIONS = 100  # cross sections along an axis
SHORTEST = 0.03  # m, least length of a tube
ROUND = 0.06  # largest difference of a round section's widths, as a share of the largest width
_FINE = 1000  # cross sections that limit a tube to the interval clear of the housings
_BULGE = 1.01  # largest ratio of the surface's distance from the axis and the tube's radius
# largest ratio of the radii of a tube's sections, offset from the axis included
_THICKER = 1.06
_LONGER = 1.25  # least length of a tube, in radii
_ROUNDS = 4  # iterations of fitting the axis to the sections
_STRAIGHT = 1 - 1e-8  # cosine of the rotation below which the axis has converged
_DIRECTIONS = np.stack([f(np.linspace(0, 2 * np.pi, 64, endpoint=False)) for f in (np.cos, np.sin)])


@dataclass(frozen=True)
class MountTube:
    """An interval of a link whose sections lie about one axis."""

    start: Float[np.ndarray, " 3"]
    """Start on the axis, m."""
    end: Float[np.ndarray, " 3"]
    """End on the axis, m."""
    radius: float
    """Largest distance of the surface from the axis, m."""
    round: float = 1.0
    """Share of the interval whose sections are round within ``ROUND``."""

    @property
    def length(self) -> float:
        """Length, m."""
        return float(np.linalg.norm(self.end - self.start))

    @property
    def axis(self) -> Float[np.ndarray, " 3"]:
        """Unit vector (3,) from start to end."""
        unit: np.ndarray = (self.end - self.start) / self.length
        return unit


@dataclass(frozen=True)
class Sections:
    """Outermost points of a surface's cross sections."""

    points: Float[np.ndarray, "N 3"]
    """Points, m."""
    station: Int[np.ndarray, " N"]
    """Number of each point's section."""
    level: Float[np.ndarray, " S"]
    """Positions of the sections along the axis, m."""

    def envelope(
        self, through: Float[np.ndarray, " 3"], axis: Float[np.ndarray, " 3"]
    ) -> Float[np.ndarray, " S"]:
        """Return the largest distance (S,) m of each section's points from the line through
        ``through`` (3,) m along ``axis`` (3,)."""
        distance: np.ndarray = self.envelopes(through[None], axis)[0]
        return distance

    def envelopes(
        self, through: Float[np.ndarray, "L 3"], axis: Float[np.ndarray, " 3"]
    ) -> Float[np.ndarray, "L S"]:
        """Return the same (L, S) m for the lines through each of ``through`` (L, 3) m."""
        largest = np.full((len(through), len(self.level)), np.inf)
        which, first = np.unique(self.station, return_index=True)
        if not len(which):
            return largest
        frame = across(axis)
        xy, lines = self.points @ frame.T, through @ frame.T  # (N, 2), (L, 2)
        away = np.hypot(*np.moveaxis(xy[None] - lines[:, None], -1, 0))
        largest[:, which] = np.maximum.reduceat(away, first, axis=1)
        return largest

    def circles(
        self, axis: Float[np.ndarray, " 3"]
    ) -> tuple[Float[np.ndarray, "S 3"], Float[np.ndarray, " S"]]:
        """Return the centres (S, 3) m and radii (S,) m of circles around the sections; centre 0 and
        an infinite radius for empty sections."""
        centre, radius = np.zeros((len(self.level), 3)), np.full(len(self.level), np.inf)
        which, first, count = np.unique(self.station, return_index=True, return_counts=True)
        if not len(which):
            return centre, radius
        # sections of fewer points repeat their first one
        inside = np.arange(count.max()) < count[:, None]
        points = self.points[
            np.where(inside, first[:, None] + np.arange(count.max()), first[:, None])
        ]
        frame = across(axis)
        xy = points @ frame.T
        middle = circle_centre(xy)
        centre[which] = middle @ frame + self.level[which, None] * axis
        radius[which] = np.linalg.norm(points - centre[which][:, None], axis=-1).max(axis=1)
        return centre, radius

    def widths(self, axis: Float[np.ndarray, " 3"]) -> Float[np.ndarray, "S 32"]:
        """Return the widths (S, 32) m of each section in 32 directions across ``axis``; NaN for
        empty sections."""
        reach = (self.points @ across(axis).T) @ _DIRECTIONS
        support = np.full((len(self.level), reach.shape[1]), np.nan)
        which, first = np.unique(self.station, return_index=True)
        support[which] = np.maximum.reduceat(reach, first, axis=0)
        half = reach.shape[1] // 2
        widths: np.ndarray = support[:, :half] + support[:, half:]
        return widths


def cut_across(
    triangles: Float[np.ndarray, "T 3 3"], axis: Float[np.ndarray, " 3"], stations: int
) -> Sections:
    """Cut a surface across ``axis`` at ``stations`` evenly spaced positions; keep the outermost
    points in 64 directions."""
    along, frame = triangles @ axis, across(axis)
    low, step = float(along.min()), float(np.ptp(along)) / stations
    level = low + step * (np.arange(stations) + 0.5)
    a, b = (np.concatenate([triangles[:, i] for i in order]) for order in ((0, 1, 2), (1, 2, 0)))
    ta, tb = a @ axis, b @ axis
    first = np.ceil((np.minimum(ta, tb) - level[0]) / step).astype(int).clip(0)
    last = np.floor((np.maximum(ta, tb) - level[0]) / step).astype(int).clip(max=stations - 1)
    times = np.where(ta != tb, np.maximum(last - first + 1, 0), 0)
    edge = np.repeat(np.arange(len(a)), times)
    station = first[edge] + np.arange(len(edge)) - np.repeat(np.cumsum(times) - times, times)
    t = ((level[station] - ta[edge]) / (tb[edge] - ta[edge]))[:, None]
    points = a[edge] * (1 - t) + b[edge] * t
    order = np.argsort(station, kind="stable")
    kept = [
        i[np.unique(np.argmax((points[i] @ frame.T) @ _DIRECTIONS, axis=0))]
        for i in np.split(order, np.searchsorted(station[order], np.arange(1, stations)))
        if len(i) > 2
    ]
    each = np.concatenate(kept) if kept else np.zeros(0, int)
    return Sections(points[each], station[each], level)


def _run(fits: np.ndarray, k: int) -> tuple[int, int]:
    """Return the first and last index of the run of true values around ``k``."""
    no = np.flatnonzero(~fits)
    return int(max(no[no < k], default=-1)) + 1, int(min(no[no > k], default=len(fits))) - 1


def _along(
    triangles: Float[np.ndarray, "T 3 3"], axis: Float[np.ndarray, " 3"], stations: int
) -> MountTube | None:
    """Return the best tube roughly along a direction, if any."""
    best: MountTube | None = None
    for _ in range(_ROUNDS):
        if float(np.ptp(triangles @ axis)) < SHORTEST:
            break
        cut = cut_across(triangles, axis, stations)
        centre, thick = cut.circles(axis)
        each = cut.envelopes(centre, axis)
        longest: tuple[float, int, int] | None = None
        for k in np.flatnonzero(np.isfinite(thick)):
            like = (each[k] <= _THICKER * thick[k]) & (thick * _THICKER >= thick[k])
            a, b = _run(like, int(k))
            length = float(cut.level[b] - cut.level[a])
            long = length >= max(SHORTEST, _LONGER * float(thick[k]))
            if long and (longest is None or length / thick[k] > longest[0]):
                longest = (length / float(thick[k]), a, b)
        if longest is None:
            break
        _, a, b = longest
        t = cut.level[a : b + 1]
        slope = np.polynomial.polynomial.polyfit(t, centre[a : b + 1], 1)
        through, to = slope[0] + slope[1] * t[0], slope[0] + slope[1] * t[-1]
        settled = (to - through) / np.linalg.norm(to - through)
        radius = float(cut.envelope(through, settled)[a : b + 1].max())
        better = best is None or (t[-1] - t[0]) / radius > best.length / best.radius
        best = MountTube(through, to, radius) if better else best
        if not better or float(settled @ axis) > _STRAIGHT:
            break
        axis = settled
    return best


def _clear(triangles: Float[np.ndarray, "T 3 3"], tube: MountTube) -> MountTube | None:
    """Return the part of a tube that is clear of the housings at its ends, with its radius and
    roundness; None if it is too short.

    Between its ends no vertex and no fine section is farther from the axis than the tube.
    """
    axis, cut = tube.axis, cut_across(triangles, tube.axis, _FINE)
    v = triangles.reshape(-1, 3) - tube.start
    along = np.concatenate([v @ axis, cut.level - tube.start @ axis])
    away = np.concatenate(
        [np.linalg.norm(v - (v @ axis)[:, None] * axis, axis=1), cut.envelope(tube.start, axis)]
    )
    wide, middle = along[away > _BULGE * tube.radius], tube.length / 2
    step = float(cut.level[1] - cut.level[0])
    low = max([0.0, *(wide[wide < middle] + step)])
    high = min([tube.length, *(wide[wide >= middle] - step)])
    if high - low < SHORTEST:
        return None
    inside, level = (along >= low) & (along <= high), cut.level - tube.start @ axis
    widths = cut.widths(axis)[(level >= low) & (level <= high)]
    alike = np.nanmin(widths, axis=1) >= (1 - ROUND) * np.nanmax(widths, axis=1)
    ends = tube.start + low * axis, tube.start + high * axis
    return MountTube(*ends, float(away[inside].max()), float(alike.mean()))


def find_tube(
    triangles: Float[np.ndarray, "T 3 3"],
    axes: Sequence[Float[np.ndarray, " 3"]],
    stations: int = STATIONS,
) -> MountTube | None:
    """Return the interval of a link that is most like a tube: longest relative to its thickness.

    The link is cut across each direction at evenly spaced positions, and a circle is fitted around
    each section. On the line through each circle's centre, a run of sections qualifies if they lie
    hardly farther from the line than that circle and are hardly smaller. The line is then fitted to
    the centres of the run, and the link is cut across it again. Finally the run is limited to the
    part that is clear of the housings.

    Args:
        triangles: corners (T, 3, 3) of the surface's triangles, m.
        axes: unit vectors (3,), approximate directions of tubes.
        stations: sections along each direction.

    Returns:
        The tube, oriented along the direction on which it was found; None if no run is ``SHORTEST``
            long.
    """
    tubes = [tube for axis in axes if (tube := _along(triangles, axis, stations)) is not None]
    best = max(tubes, key=lambda tube: tube.length / tube.radius, default=None)
    return None if best is None else _clear(triangles, best)
