"""The global stage on an accelerator: many candidates at once follow stochastic gradients of the
soft coverage, numbers of sensors included.

Each step draws a few points anew, and the width of the sigmoid falls. The numbers of sensors of a
candidate's rings are real values under a softmax whose sum is the budget; after each round they are
rounded. Between rounds the better candidates stay, and others arise from them by discrete moves of
rings and sensors.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from ...coverage.rings.ring_kinematics import RingArrays
from ...objectives.link_segments import ABOVE, BELOW, HIGH, LOW
from ...objectives.parameterization import at_tilt, decode
from ...objectives.soft_coverage import SoftCoverage
from ...objectives.soft_terms import Sample
from ..space.design import Candidate, Space
from ..space.feasible_set import Rng
from ..space.starts import fresh
from ..stop_token import StopToken

_PAIRS = 1 << 24  # of a candidate's ring and a point, whose gradients fit in 16 GB of memory
_POINTS = 1024  # drawn anew in each step, of each goal at each pose
_SHARP = 1e-4  # m, a width at which the soft coverage is the share of points
_JUDGED = 8192  # points on which candidates are compared after a round
_STEPS = (150, 100, 100)  # of the rounds
_WIDTHS = ((0.08, 0.015), (0.04, 0.01), (0.02, 0.003))  # m, first and last of each round
_RATES = (
    (0.03, 0.004),
    (0.015, 0.003),
    (0.006, 0.0004),
)  # first and last steps, as those of values
_SCALE = np.array([1.0, 1.3, 0.6, 1.5])  # of steps of positions, tilts, phases and counts
_KEPT = 8  # one candidate of so many stays

Device = Literal["auto", "cpu", "gpu"]


class _Batch(NamedTuple):
    """S candidates as arrays."""

    arrays: RingArrays
    """Rings and sensors."""
    values: Float[np.ndarray, "S 4 R"]
    """Positions, tilts, phases, and logarithms of the numbers of sensors."""
    low: Float[np.ndarray, "S R"]
    """Least tilts, rad."""
    high: Float[np.ndarray, "S R"]
    """Greatest tilts, rad."""
    by_tilt: Float[np.ndarray, "S R 4 T"]
    """Tables of the segments; see ``Segment``."""
    least: Float[np.ndarray, "S R"]
    """Least spacing by the rules."""
    segment: Int[np.ndarray, "S R"]
    """Number of the segment; below 0 for what does not move."""


def accelerated(device: Device) -> bool:
    """Return whether gradients lead the global stage: on ``auto`` where JAX finds an accelerator.

    Raises:
        ValueError: for ``gpu`` where JAX finds none.
    """
    if device == "cpu":
        return False
    backend = jax.default_backend()
    if device == "gpu" and backend == "cpu":
        raise ValueError("found gpu, but JAX finds none here, allowed: auto or cpu")
    return backend != "cpu"


def suits(space: Space, soft: SoftCoverage) -> bool:
    """Return whether gradients can lead the global stage: not where a sensor's own place on its
    ring matters, nor for a tilt that all rings share."""
    scene, aim = space.scene, soft.aim
    still = scene.obstacles or scene.robot.carried or scene.occlusion == "blind"
    shared = scene.rules.shared_tilt
    return not still and not shared and not aim.errors and aim.losing != "sensor"


def gradient_stage(
    space: Space,
    soft: SoftCoverage,
    starts: Sequence[Candidate],
    seed: int,
    brake: StopToken,
    batch: int | None = None,
) -> list[Candidate]:
    """Return candidates after all rounds, the best first.

    Args:
        space: the setups to choose from.
        soft: the soft coverage.
        starts: candidates to start from besides random ones.
        seed: random seed of the starts, the points and the moves.
        brake: ends the stage after a round.
        batch: number of candidates; by default as many as the memory of an accelerator holds.
    """
    rng, key = np.random.default_rng((seed, 8)), jax.random.PRNGKey(seed)
    terms, most = len(soft.all.points), _most(space, soft)
    size = batch or max(_PAIRS // (terms * _POINTS * most * max(space.places, 1)), 16)
    candidates = [*starts[:size], *(fresh(space, rng) for _ in range(size - len(starts)))]
    budget = (space.free if space.layout is None else 0, space.places)
    run = jax.jit(partial(_run, soft, most, budget), static_argnums=2)
    judge = jax.jit(partial(_judge, soft, most))
    for number, steps in enumerate(_STEPS):
        key, own = jax.random.split(key)
        made = _batch(space, candidates)
        ends = jnp.asarray([*_WIDTHS[number], *_RATES[number]], jnp.float32)
        values = np.asarray(run(made, own, steps, ends), float)
        candidates = [_candidate(space, c, v) for c, v in zip(candidates, values, strict=True)]
        share = np.asarray(judge(_batch(space, candidates)))
        candidates = [candidates[i] for i in np.argsort(-share, kind="stable")]
        if brake.on() or number == len(_STEPS) - 1:
            break
        kept = candidates[: max(size // _KEPT, 1)]
        rank = np.arange(len(kept), 0, -1.0)
        drawn = rng.choice(len(kept), size - len(kept), p=rank / rank.sum())
        others = (_child(space, kept[i], kept[rng.integers(len(kept))], rng) for i in drawn)
        candidates = [*kept, *others]
    return candidates


def _child(space: Space, a: Candidate, b: Candidate, rng: Rng) -> Candidate:
    """Return a candidate with the rings of ``a`` on some links and those of ``b`` on the others,
    where the search chooses the rings, and with one ring redrawn."""
    c, number = a, np.array([space.scene.robot.links.index(s.link) for s in space.segments])
    if space.layout is None:
        of_a = rng.uniform(size=number.max() + 1) < 0.5
        kept = [(a, i) for i in a.rings if of_a[number[a.segment[i]]]]
        kept += [(b, i) for i in b.rings if not of_a[number[b.segment[i]]]]
        if kept and len(kept) <= space.places:
            parts = [np.zeros_like(a.segment) - 1, np.zeros_like(a.count), np.zeros_like(a.values)]
            for k, (parent, i) in enumerate(kept):
                parts[0][k], parts[1][k], parts[2][:, k] = (
                    parent.segment[i],
                    parent.count[i],
                    parent.values[:, i],
                )
            mixed = Candidate(parts[0], parts[1], parts[2], a.sign)
            most = [space.most_on(space.segments[i].link) for i in mixed.segment[mixed.rings]]
            if space.least * len(kept) <= space.free <= sum(most):
                c = replace(mixed, count=_divided(space, mixed, np.log(np.maximum(parts[1], 1))))
    values, i = c.values.copy(), rng.choice(c.rings)
    low, high = space.box(c)
    values[:, i] = rng.uniform(low[:, i], high[:, i])
    return replace(c, values=values)


def _most(space: Space, soft: SoftCoverage) -> int:
    """Return how many sensors of a ring count at a point."""
    arrays, _ = space.arrays(fresh(space, np.random.default_rng(0)))
    return soft.near(arrays, space.most)


def _batch(space: Space, candidates: Sequence[Candidate]) -> _Batch:
    each = []
    for c in candidates:
        arrays, where = space.arrays(c)
        low, high = space.box(c)
        counts = np.log(np.maximum(np.pad(c.count, (0, len(space.held))), 1))
        values = np.concatenate([decode(where, space.values(c)), counts[None]])
        rules = (np.asarray(a) for a in (where.by_tilt, where.least, where.segment))
        each.append(_Batch(arrays, values, low[1], high[1], *rules))
    batch: _Batch = jax.tree.map(lambda *a: _narrow(np.stack(a)), *each)
    return batch


def _narrow(values: np.ndarray) -> np.ndarray:
    return values.astype(np.float32) if values.dtype.kind == "f" else values


def _candidate(space: Space, c: Candidate, values: Float[np.ndarray, "4 R"]) -> Candidate:
    """Return a candidate with other values, and with its sensors divided as these say."""
    if space.layout is None:
        c = replace(c, count=_divided(space, c, values[3, : len(c.segment)]))
    low, high = space.box(c)
    there = values[:3].copy()
    spacing = high[2, c.rings]  # a phase repeats after one spacing
    there[2, c.rings] = np.mod(there[2, c.rings], np.where(spacing > 0, spacing, 1.0))
    there[1:, c.rings] = np.clip(there[1:, c.rings], low[1:, c.rings], high[1:, c.rings])
    return space.moved(c, there)


def _divided(space: Space, c: Candidate, logits: Float[np.ndarray, " R"]) -> Int[np.ndarray, " R"]:
    """Return whole numbers of sensors nearest to real ones, with the same sum."""
    count, rings = c.count.copy(), c.rings
    most = np.array([space.most_on(space.segments[s].link) for s in c.segment[rings]])
    share = np.exp(logits[rings] - logits[rings].max())
    wanted = space.free * share / share.sum()
    count[rings] = np.clip(np.round(wanted), space.least, most)
    while (lack := int(space.free - count.sum())) != 0:
        off = wanted - count[rings]
        can = count[rings] < most if lack > 0 else count[rings] > space.least
        i = rings[np.argmax(np.where(can, math.copysign(1, lack) * off, -np.inf))]
        count[i] += int(math.copysign(1, lack))
    return count


def _lack_of_room(one: _Batch, values: Any) -> Any:
    """Return by how much rings of one segment are too near to each other, in sum."""
    position = values[0]
    row = at_tilt(one.by_tilt, jnp.arange(len(position)), values[1])
    least = jnp.maximum(row[:, None, ABOVE] + row[None, :, BELOW], one.least[None])
    gap = position[None] - position[:, None]
    each = jnp.arange(len(position))
    pair = (one.segment[:, None] == one.segment[None]) & (each[:, None] != each[None]) & (gap >= 0)
    return jnp.where(pair, jnp.maximum(least - gap, 0), 0).sum()


def _clipped(one: _Batch, values: Any) -> Any:
    """Return values within the bounds of their rings alone."""
    tilt = jnp.clip(values[1], one.low, one.high)
    row = at_tilt(one.by_tilt, jnp.arange(len(tilt)), tilt)
    return jnp.stack([jnp.clip(values[0], row[:, LOW], row[:, HIGH]), tilt, *values[2:]])


def _stepped(one: _Batch, values: Any, step: Any) -> Any:
    """Return values after a step of the rings that move."""
    return jnp.where(one.segment >= 0, _clipped(one, values + step), values)


def _loss(
    soft: SoftCoverage, most: int, budget: tuple[int, int], values: Any, one: _Batch, at: Any
) -> Any:
    """Return minus the soft coverage, and what lack of room costs.

    ``budget`` is the number of sensors to divide among a number of places; 0: counts are given.
    """
    (sample, width), (free, places) = at, budget
    counts = None
    if free:
        there = one.segment >= 0
        share = jax.nn.softmax(jnp.where(there, values[3], -jnp.inf))
        counts = jnp.where(there, free * share, 0.0)[:places]
    still = jax.lax.stop_gradient((values, counts))
    chosen = soft.terms.choose(one.arrays, still[0][:3], sample.points, width, most, still[1])
    value, _ = soft.terms.criterion(one.arrays, values[:3], sample, width, chosen, counts)
    return _lack_of_room(one, values) - value


def _run(
    soft: SoftCoverage,
    most: int,
    budget: tuple[int, int],
    batch: _Batch,
    key: Any,
    steps: int,
    ends: Any,
) -> Any:
    """Return the values of candidates after ``steps`` steps of Adam."""
    slope = jax.vmap(jax.grad(partial(_loss, soft, most, budget)), (0, 0, None))
    points = soft.all.points
    size = min(_POINTS, points.shape[1])

    def step(state: Any, i: Any) -> Any:
        values, mean, square, key = state
        key, own = jax.random.split(key)
        first = jax.random.randint(own, (), 0, points.shape[1] - size + 1)
        drawn = Sample(jax.lax.dynamic_slice_in_dim(points, first, size, 1))
        width = ends[0] * (ends[1] / ends[0]) ** (i / steps)
        rate = ends[2] * (ends[3] / ends[2]) ** (i / steps)
        by = slope(values, batch, (drawn, width))
        mean, square = 0.9 * mean + 0.1 * by, 0.99 * square + 0.01 * by * by
        deviation = jnp.sqrt(square / (1 - 0.99 ** (i + 1))) + 1e-7
        way = mean / (1 - 0.9 ** (i + 1)) / deviation * jnp.asarray(_SCALE, by.dtype)[None, :, None]
        values = jax.vmap(_stepped)(batch, values, -rate * way).astype(values.dtype)
        return (values, mean, square, key), None

    start = jnp.asarray(batch.values, jnp.float32)
    nothing = jnp.zeros_like(start)
    each = jnp.arange(steps, dtype=jnp.float32)
    return jax.lax.scan(step, (start, nothing, nothing, key), each)[0][0]


def _judge(soft: SoftCoverage, most: int, batch: _Batch) -> Any:
    """Return the criterion of candidates on a share of the points, with sharp beams."""
    sample = Sample(soft.all.points[:, :_JUDGED])

    def one(c: _Batch) -> Any:
        chosen = soft.terms.choose(c.arrays, c.values[:3], sample.points, _SHARP, most)
        return soft.terms.criterion(c.arrays, c.values[:3], sample, _SHARP, chosen)[0]

    return jax.lax.map(one, jax.tree.map(jnp.asarray, batch), batch_size=16)
