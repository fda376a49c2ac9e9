"""Coordinate exchange, ring by ring, on the points where a ring matters beside the others.

One test of a place and a point leaves few pairs that need a closer look (ring_views), and what the
other rings see need not be recomputed. Trying another place for one ring is therefore cheap, needs
no compilation, and thousands of places fit into the time of one gradient. The exchange evaluates
the criterion itself on its points (exchange_criteria), with lines of sight and mounting errors.
"""

from copy import copy
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from ...coverage.rings.ring import Ring
from ...objectives.parameterization import Interval, decode, encode, positions
from .design import Candidate, Space
from .exchange_criteria import ExchangeCriterion, Rest, Tally, WorstPose, criterion_by_counts
from .exchange_points import Field, Fields
from .exchange_trials import Trials, drawn_trials, with_place
from .feasible_set import Rng
from .mount_points import MountPoints
from .moves import vary
from .ring_views import RingPlaces, Views, ring_views
from .round import Round
from .stop_token import StopToken

_AT_ONCE = 1 << 16  # tests in one batch, so that their arrays stay in cache
_STRETCHES = 16  # segments of rings that an exchange keeps: with 64 rings, 0.15 MB each
_SAME = 1e-9  # share of a link, and rad: a ring that moved by less stayed
_CHECKED = 2  # places of the best guessed values that are evaluated exactly


class _Batch(NamedTuple):
    """K places of one ring on one segment, with the points where it matters."""

    i: int
    """Number of the ring."""
    ring: Ring
    """The ring, at any place."""
    trial: Int[np.ndarray, " K"]
    """Index of each place among the trials."""
    places: Float[np.ndarray, "3 K"]
    """Positions, tilts and phases."""
    points: MountPoints
    """The points."""
    guessed: bool
    """Whether lines of sight can be guessed."""


class Exchange:
    """A candidate that improves by moving one ring at a time, while the criterion on a field
    grows."""

    def __init__(self, space: Space, c: Candidate, rng: Rng, criterion: ExchangeCriterion) -> None:
        self._space, self.rng, self.candidate, self.value = space, rng, c, -np.inf
        self._criterion, self._softness = criterion, 0.0
        self._rings, self._stretches = dict[tuple[int, int], Ring](), dict[bytes, Interval]()

    def look(self, field: Field, softness: float = 0.0, guess: bool = False) -> None:
        """Evaluate on the points of ``field`` from now on, with a soft worst pose or loss, and with
        guessed lines of sight if ``guess``."""
        self._field, self._softness, self._guess = field, softness, guess
        held, most, n = field.held, self._criterion.most, len(field.part)
        nothing, none = np.zeros(n, np.uint8), np.zeros(n, np.uint16)
        free = self._space.places
        # a last group sees nothing, so that there is one where no ring and nothing else is
        count = (*[nothing] * free, *np.minimum(held.count, np.uint8(most)), nothing)
        sensor = (*[none] * free, *held.sensor, none) if self._criterion.named else None
        self._tally, self._nothing = Tally(count, sensor), Views(nothing[None], none[None])
        self._places = np.full((3, self._space.places), np.nan)
        self.value = -np.inf
        self.offer(self.candidate)

    def _see(
        self,
        ring: Ring,
        i: int,
        places: Float[np.ndarray, "3 K"],
        points: MountPoints | None = None,
        index: Int[np.ndarray, " M"] | None = None,
        guess: bool = False,
    ) -> Views:
        """Return what ring ``i`` sees of ``points``, which have the numbers ``index``, by default
        of all, at places: positions, tilts and phases."""
        position, tilt, phase = places
        field, criterion = self._field, self._criterion
        height = position * self._space.scene.robot.mount(ring.link).length
        outlook = field.outlook.get(ring.link) if guess or self._guess else None
        views = ring_views(
            ring,
            points or field.points[ring.link],
            RingPlaces(height, tilt, phase),
            criterion.most,
            None if outlook else field.past.get(ring.link),
            field.errors[i] if field.errors else None,
            criterion.named,
        )
        if outlook:
            views.counts[:] *= outlook.clear(height, index)
        return views

    def _ring(self, c: Candidate, i: int) -> Ring:
        key = int(c.segment[i]), int(c.count[i])
        if key not in self._rings:
            self._rings[key] = self._space.ring(self._space.segments[key[0]].link, key[1])
        return self._rings[key]

    def _stretch(self, c: Candidate) -> Interval:
        key = c.segment.tobytes() + c.sign.tobytes() * self._space.scene.rules.shared_tilt
        if key not in self._stretches:
            while len(self._stretches) >= _STRETCHES:
                del self._stretches[next(iter(self._stretches))]
            self._stretches[key] = self._space.stretch(c)
        return self._stretches[key]

    def offer(self, c: Candidate) -> bool:
        """Replace the candidate by ``c`` if that is better; return whether it is."""
        places = np.asarray(decode(self._stretch(c), self._space.values(c)))[
            :, : self._space.places
        ]
        old = self.candidate
        other = (
            ~(np.abs(places - self._places) <= _SAME).all(axis=0)
            | (c.segment != old.segment)
            | (c.count != old.count)
        )
        tally = self._tally.changed(
            {
                i: self._see(self._ring(c, i), i, places[:, i : i + 1])
                if c.segment[i] >= 0
                else self._nothing
                for i in np.flatnonzero(other).tolist()
            }
        )
        value = self._criterion.value(self._field, tally, self._softness)
        if better := value > self.value:
            self.candidate, self.value, self._tally, self._places = c, value, tally, places
        return better

    def _others_kept(self, c: Candidate) -> Candidate:
        """Return ``c`` with the rings that it does not change at their positions so far, as far as
        the spacing allows."""
        where, values, same = self._stretch(c), self._space.values(c), self._unchanged(c)
        position = decode(where, values)[0]
        position[: len(same)][same] = self._places[0, same]
        along = encode(where, values, position)
        return replace(c, values=np.concatenate([along[None, : len(same)], c.values[1:]]))

    def _unchanged(self, c: Candidate) -> Bool[np.ndarray, " R"]:
        """Return which rings of ``c`` are as in the candidate."""
        was = self.candidate
        same: np.ndarray = (
            (c.segment == was.segment)
            & (c.count == was.count)
            & (c.values == was.values).all(axis=0)
        )
        return same

    def put(self, i: int, near: int, scale: float, anywhere: int) -> None:
        """Move ring ``i`` to the place where it adds most.

        The places tried are its own, ``near`` places close to it, and ``anywhere`` places in the
        feasible set. Where lines of sight are guessed first, it is the first of the most promising
        places that is better than its own.
        """
        field = self._field
        trials = drawn_trials(self._space, self.candidate, self.rng, i, near, scale, anywhere)
        rest = self._criterion.rest(field, self._tally, i, self._softness)
        (best,), winner = rest.values(self._tally.views(i, rest.index)), None
        batches = self._batches(i, trials, rest)
        guessed = any(batch.guessed for batch in batches) and not self._guess
        for batch in self._promising(batches, rest) if guessed else batches:
            value = self._values(batch, rest, False)
            if value.max() > best:
                best, winner = float(value.max()), batch.trial[int(value.argmax())]
                if guessed:  # the first of the promising places that is better will do
                    break
        if winner is not None:
            s, values, sign = (a[winner] for a in trials)
            moved = with_place(self.candidate, i, int(s), values, sign)
            if not self.offer(self._others_kept(moved)):
                self.offer(moved)

    def _batches(self, i: int, trials: Trials, rest: Rest) -> list[_Batch]:
        """Return the places to try for ring ``i``, in batches of one segment."""
        batches = []
        step = max(_AT_ONCE // max(len(rest.index), 1), 1)  # places tested at once
        for s in dict.fromkeys(trials.segment.tolist()):
            mine = np.flatnonzero(trials.segment == s)  # (K,), trials on this segment
            there = with_place(self.candidate, i, s, trials.values[0], 1.0)
            places = self._places_of(there, i, trials.values[mine], trials.sign[mine])  # (3, K)
            ring = self._ring(there, i)
            points = self._field.points[ring.link].some(rest.index)
            guessed = ring.link in self._field.outlook
            batches += [
                _Batch(i, ring, mine[k : k + step], places[:, k : k + step], points, guessed)
                for k in range(0, len(mine), step)
            ]
        return batches

    def _values(self, batch: _Batch, rest: Rest, guess: bool) -> Float[np.ndarray, " K"]:
        """Return the criterion for the places of a batch, with guessed lines of sight if
        ``guess``."""
        views = self._see(batch.ring, batch.i, batch.places, batch.points, rest.index, guess)
        return rest.values(views)

    def _promising(self, batches: list[_Batch], rest: Rest) -> list[_Batch]:
        """Return the few places whose guessed values are highest, the best first, each a batch."""
        guess = [self._values(batch, rest, True) for batch in batches]
        which = np.repeat(np.arange(len(batches)), [len(g) for g in guess])  # (K,)
        best = np.argsort(-np.concatenate(guess), kind="stable")[:_CHECKED]
        first = np.cumsum([0, *(len(g) for g in guess)])
        few = []
        for i in best.tolist():
            b, k = batches[which[i]], i - first[which[i]]
            few.append(b._replace(trial=b.trial[k : k + 1], places=b.places[:, k : k + 1]))
        return few

    def _places_of(
        self, c: Candidate, i: int, values: Float[np.ndarray, "K 3"], sign: Float[np.ndarray, " K"]
    ) -> Float[np.ndarray, "3 K"]:
        """Return position, tilt and phase (3, K) of ring ``i`` for values (K, 3) and signs (K,), as
        ``decode`` computes them."""
        where, others = self._stretch(c), self._space.values(c)
        if self._space.scene.rules.shared_tilt:
            own = sign * c.values[1, where.tilt_of[i]]
        else:
            own = values[:, 1]
        along, tilt = (np.tile(row, (len(values), 1)) for row in others[:2])  # (K, R)
        tilt = np.asarray(where.sign) * tilt[:, where.tilt_of]
        along[:, i], tilt[:, i] = values[:, 0], own
        same = np.flatnonzero(where.segment == where.segment[i])
        position = positions(where.some(same), along[:, same], tilt[:, same])
        return np.stack([position[:, np.searchsorted(same, i)], own, values[:, 2]])

    def move(self, near: int, scale: float, anywhere: int) -> None:
        """Vary one ring or move sensors between rings, improve the changed rings, and keep the
        result if it is better."""
        other, c = copy(self), vary(self._space, self.candidate, self.rng)
        other.value = -np.inf
        other.offer(other._others_kept(c))
        changed = ~self._unchanged(c)
        for i in c.rings[changed[c.rings]]:
            other.put(int(i), near, scale, anywhere)
        self._take(other)

    def move_pair(self, near: int, scale: float, anywhere: int) -> None:
        """Place one ring as if another saw nothing, then the other, then the first again; keep the
        result if it is better."""
        i, j = self.rng.choice(self.candidate.rings, 2, replace=False).tolist()
        other = copy(self)
        other._tally = self._tally.changed({j: self._nothing})
        other.value = self._criterion.value(self._field, other._tally, self._softness)
        other.put(i, near, scale, anywhere)
        other._places = other._places.copy()
        other._places[:, j] = np.nan  # so that what the other ring sees is computed again
        other.value = -np.inf
        other.offer(other.candidate)
        other.put(j, near, scale, anywhere)
        other.put(i, near, scale, 0)
        self._take(other)

    def _take(self, other: "Exchange") -> None:
        """Continue with the candidate of ``other`` if it is better."""
        if other.value > self.value:
            self.candidate, self.value = other.candidate, other.value
            self._tally, self._places = other._tally, other._places

    def active_poses(self, wide: Field, poses: int) -> Int[np.ndarray, " P"]:
        """Return the ``poses`` worst poses by the points of ``wide``."""
        self.look(wide)
        return self.worst_poses(wide, poses)

    def worst_poses(self, wide: Field, poses: int) -> Int[np.ndarray, " P"]:
        """Return the ``poses`` worst poses by the points of ``wide``, at which it looks."""
        assert isinstance(self._criterion, WorstPose)
        every, zeta = self._criterion.by_pose(wide, self._tally)
        return every[np.argsort(zeta, kind="stable")[:poses]]

    def sweep(self, r: Round, brake: StopToken) -> None:
        """Improve every ring once, in random order, and try the round's moves, until a stop."""
        rings = self.rng.permutation(self.candidate.rings)
        pairs = r.pairs if len(rings) > 1 else 0
        puts = [partial(self.put, int(i)) for i in rings]
        for step in (*puts, *[self.move] * r.moves, *[self.move_pair] * pairs):
            if brake.on():
                return
            step(r.near, r.scale, r.anywhere)  # type: ignore[operator]  # partials and methods alike


def share_of(space: Space, fields: Fields, c: Candidate) -> float:
    """Return the criterion of a candidate on all points, reduced for missed floors."""
    criterion = criterion_by_counts(fields.scene, fields.aim)
    here = Exchange(space, c, np.random.default_rng(0), criterion)
    here.look(fields.all)
    return here.value
