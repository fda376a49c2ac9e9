"""The global stage on an accelerator: many candidates at once follow stochastic gradients of the
soft coverage, where links and counts of the rings are given.

Each step draws a few points anew, and the width of the sigmoid falls. Between rounds the better
candidates stay, and others arise from them by one ring redrawn.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from ...coverage.occlusion.occlusion_mode import REPORTING
from ...coverage.rings.ring_kinematics import RingArrays
from ...objectives.criterion import Criterion
from ...objectives.link_segments import ABOVE, BELOW, HIGH, LOW
from ...objectives.parameterization import at_tilt, decode
from ...objectives.soft_coverage import SoftCoverage
from ...objectives.soft_terms import Sample, SoftTerms
from ..space.design import Candidate, Space
from ..space.feasible_set import Rng
from ..space.starts import fresh
from ..stop_token import StopToken

_TERMS = 4  # goals at poses, one after the other in each step: 200 took minutes
_MOST = 128  # candidates; more took longer and found no more
_PAIRS = 1 << 24  # of all candidates' rings and points, whose gradients fit in 2 GB of memory
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
_SCALE = np.array([1.0, 1.3, 0.6])  # of steps of positions, tilts and phases
_KEPT = 8  # one candidate of so many stays

Device = Literal["auto", "cpu", "gpu"]


class _Batch(NamedTuple):
    """S candidates as arrays."""

    arrays: RingArrays
    """Rings and sensors."""
    values: Float[np.ndarray, "S 3 R"]
    """Positions, tilts and phases."""
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


def suits(space: Space, aim: Criterion) -> bool:
    """Return whether gradients should lead the global stage: not where a sensor's own place on its
    ring matters, nor for a tilt that all rings share, nor where a test piece is to be detected.

    Where links and counts are free, the exchange finds more; for many poses it takes less time.
    """
    scene = space.scene
    if space.layout is None or len(scene.targets) * len(scene.poses) > _TERMS:
        return False
    still = scene.obstacles or scene.robot.carried or scene.occlusion in REPORTING
    shared = scene.rules.shared_tilt
    plain = not aim.errors and aim.losing != "sensor" and aim.detection is None
    return plain and not still and not shared


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
        batch: number of candidates; by default 128, or as many as memory holds.
    """
    rng, key = np.random.default_rng((seed, 8)), jax.random.PRNGKey(seed)
    points, first = soft.all.points, fresh(space, rng)
    most = soft.near(space.arrays(first)[0])
    held = _PAIRS // (len(points) * _POINTS * most * max(space.places, 1))
    size = batch or min(max(held, 16), _MOST)
    candidates = [*starts, first, *(fresh(space, rng) for _ in range(size - len(starts) - 1))][
        :size
    ]
    for number, steps in enumerate(_STEPS):
        key, own = jax.random.split(key)
        made = _batch(space, candidates)
        ends = jnp.asarray([*_WIDTHS[number], *_RATES[number]], jnp.float32)
        values = np.asarray(_run(soft.terms, points, most, made, own, steps, ends), float)
        candidates = [_candidate(space, c, v) for c, v in zip(candidates, values, strict=True)]
        share = np.asarray(_judge(soft.terms, points[:, :_JUDGED], most, _batch(space, candidates)))
        candidates = [candidates[i] for i in np.argsort(-share, kind="stable")]
        if brake.on() or number == len(_STEPS) - 1:
            break
        kept = candidates[: max(size // _KEPT, 1)]
        rank = np.arange(len(kept), 0, -1.0)
        drawn = rng.choice(len(kept), size - len(kept), p=rank / rank.sum())
        candidates = [*kept, *(_child(space, kept[i], rng) for i in drawn)]
    return candidates


def _child(space: Space, c: Candidate, rng: Rng) -> Candidate:
    """Return a candidate with one ring redrawn."""
    values, i = c.values.copy(), rng.choice(c.rings)
    low, high = space.box(c)
    values[:, i] = rng.uniform(low[:, i], high[:, i])
    return replace(c, values=values)


def _batch(space: Space, candidates: Sequence[Candidate]) -> _Batch:
    each = []
    for c in candidates:
        arrays, where = space.arrays(c)
        low, high = space.box(c)
        values = decode(where, space.values(c))
        rules = (np.asarray(a) for a in (where.by_tilt, where.least, where.segment))
        each.append(_Batch(arrays, values, low[1], high[1], *rules))
    batch: _Batch = jax.tree.map(lambda *a: _narrow(np.stack(a)), *each)
    return batch


def _narrow(values: np.ndarray) -> np.ndarray:
    return values.astype(np.float32) if values.dtype.kind == "f" else values


def _candidate(space: Space, c: Candidate, values: Float[np.ndarray, "3 R"]) -> Candidate:
    """Return a candidate with other values."""
    low, high = space.box(c)
    there = values.copy()
    spacing = high[2, c.rings]  # a phase repeats after one spacing
    there[2, c.rings] = np.mod(there[2, c.rings], np.where(spacing > 0, spacing, 1.0))
    there[1:, c.rings] = np.clip(there[1:, c.rings], low[1:, c.rings], high[1:, c.rings])
    return space.moved(c, there)


def _lack_of_room(one: _Batch, values: Any) -> Any:
    """Return by how much rings of one segment are too near to each other, in sum."""
    position = values[0]
    row = at_tilt(one.by_tilt, jnp.arange(len(position)), values[1])
    least = jnp.maximum(row[:, None, ABOVE] + row[None, :, BELOW], one.least[None])
    gap = position[None] - position[:, None]
    each = jnp.arange(len(position))
    pair = (one.segment[:, None] == one.segment[None]) & (each[:, None] != each[None]) & (gap >= 0)
    return jnp.where(pair, jnp.maximum(least - gap, 0), 0).sum()


def _stepped(one: _Batch, values: Any, step: Any) -> Any:
    """Return values after a step of the rings that move, within the bounds of each alone."""
    along, tilt, phase = values + step
    tilt = jnp.clip(tilt, one.low, one.high)
    row = at_tilt(one.by_tilt, jnp.arange(len(tilt)), tilt)
    there = jnp.stack([jnp.clip(along, row[:, LOW], row[:, HIGH]), tilt, phase])
    return jnp.where(one.segment >= 0, there, values)


def _loss(terms: SoftTerms, most: int, values: Any, one: _Batch, at: Any) -> Any:
    """Return minus the soft coverage, and what lack of room costs."""
    sample, width = at
    still = jax.lax.stop_gradient(values)
    chosen = terms.choose(one.arrays, still, sample.points, width, most)
    value, _ = terms.criterion(one.arrays, values, sample, width, chosen)
    return _lack_of_room(one, values) - value


# The scene and the points are arguments, and the number of steps is: what is compiled then serves
# all rounds, seeds, and scenes of one shape.
@partial(jax.jit, static_argnames="most")
def _run(
    terms: SoftTerms,
    points: Any,
    most: int,
    batch: _Batch,
    key: Any,
    steps: Any,
    ends: Any,
) -> Any:
    """Return the values of candidates after ``steps`` steps of Adam."""
    slope = jax.vmap(jax.grad(partial(_loss, terms, most)), (0, 0, None))
    size = min(_POINTS, points.shape[1])

    def step(number: Any, state: Any) -> Any:
        values, mean, square, key = state
        key, own = jax.random.split(key)
        first = jax.random.randint(own, (), 0, points.shape[1] - size + 1)
        drawn = Sample(jax.lax.dynamic_slice_in_dim(points, first, size, 1))
        i = number.astype(jnp.float32)
        width = ends[0] * (ends[1] / ends[0]) ** (i / steps)
        rate = ends[2] * (ends[3] / ends[2]) ** (i / steps)
        by = slope(values, batch, (drawn, width))
        mean, square = 0.9 * mean + 0.1 * by, 0.99 * square + 0.01 * by * by
        deviation = jnp.sqrt(square / (1 - 0.99 ** (i + 1))) + 1e-7
        way = mean / (1 - 0.9 ** (i + 1)) / deviation * jnp.asarray(_SCALE, by.dtype)[None, :, None]
        values = jax.vmap(_stepped)(batch, values, -rate * way).astype(values.dtype)
        return values, mean, square, key

    start = jnp.asarray(batch.values, jnp.float32)
    nothing = jnp.zeros_like(start)
    return jax.lax.fori_loop(0, steps, step, (start, nothing, nothing, key))[0]


@partial(jax.jit, static_argnames="most")
def _judge(terms: SoftTerms, points: Any, most: int, batch: _Batch) -> Any:
    """Return the criterion of candidates on points, with sharp beams."""

    def one(c: _Batch) -> Any:
        chosen = terms.choose(c.arrays, c.values, points, _SHARP, most)
        return terms.criterion(c.arrays, c.values, Sample(points), _SHARP, chosen)[0]

    return jax.lax.map(one, jax.tree.map(jnp.asarray, batch), batch_size=16)
