"""The search's variables: positions, tilts and phases of the rings, and the setup that they stand for."""

import math
from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int

from ..coverage.rings import Ring, Setup, ring_values
from ..objectives.scene import Scene

PAPER_TILTS_DEG = (55.0, 25.0, 0.0)


def ring_layout(scene: Scene, rings_per_link: int, sensors_per_ring: int) -> Setup:
    """Rings as evenly placed as the paper's, without tilt, on every link with a length; one ring on each other link."""
    rings = []
    for mount in scene.robot.mounts:
        n = rings_per_link if mount.length > 0 else 1
        low, high = scene.limits_of(mount.link).position
        places = np.linspace(low, high, n) if n > 1 else [(low + high) / 2 if mount.length > 0 else 0.0]
        rings += [Ring(mount.link, float(p), sensors_per_ring, 0.0, 0.0, scene.ring_radius, scene.sensor) for p in places]
    return Setup(tuple(rings))


def bounds(scene: Scene, setup: Setup) -> tuple[Float[np.ndarray, "3 R"], Float[np.ndarray, "3 R"]]:
    """Lower and upper bounds of positions, tilts and phases. A phase may turn by one sensor's spacing either way: what
    lies beyond repeats."""
    low, high = np.zeros((2, 3, len(setup.rings)))
    for i, ring in enumerate(setup.rings):
        limits = scene.limits_of(ring.link)
        along = limits.position if scene.robot.mount(ring.link).length > 0 else (0.0, 0.0)
        turn = 2 * math.pi / ring.count
        low[:, i], high[:, i] = (along[0], limits.tilt[0], -turn), (along[1], limits.tilt[1], turn)
    return low, high


def place(setup: Setup, values: Float[np.ndarray, "3 R"]) -> Setup:
    """``setup`` with its rings at ``values`` (positions, tilts, phases): each phase in [0, spacing), the rings of
    a link from proximal to distal."""
    rings = [
        replace(ring, position=position, tilt=tilt, phase=phase % (2 * math.pi / ring.count))
        for ring, position, tilt, phase in zip(setup.rings, *values.tolist(), strict=True)
    ]
    links = list(dict.fromkeys(ring.link for ring in rings))
    return Setup(tuple(sorted(rings, key=lambda ring: (links.index(ring.link), ring.position))))


def starts(scene: Scene, setup: Setup, count: int, seed: int) -> Float[np.ndarray, "count 3 R"]:
    """``count`` starting points within the bounds: the paper's tilts for this layout first, then random ones."""
    low, high = bounds(scene, setup)
    values = ring_values(setup)
    even = np.stack([values.position, values.tilt, values.phase])
    found = []
    for tilt_deg in PAPER_TILTS_DEG:
        middle = np.array([np.mean(scene.limits_of(r.link).position) for r in setup.rings])
        toward = np.sign(np.round(middle - even[0], 9)) * (high[0] > low[0])
        found.append(np.clip(np.stack([even[0], toward * math.radians(tilt_deg), even[2]]), low, high))
    rng = np.random.default_rng(seed)
    found += [rng.uniform(low, high) for _ in range(count - len(found))]
    return np.stack(found[:count])


def variants(
    scene: Scene, setup: Setup, values: Float[np.ndarray, "S 3 R"], count: int, rng: np.random.Generator
) -> Float[np.ndarray, "count 3 R"]:
    """``count`` setups that differ from one of ``values`` in one ring, which is drawn anew within the bounds.

    Climbs settle into few combinations of rings, and from a good one to a better one it often takes one ring.
    """
    low, high = bounds(scene, setup)
    each, ring = np.arange(count), rng.integers(len(setup.rings), size=count)
    varied = values[rng.integers(len(values), size=count)]
    varied[each, :, ring] = rng.uniform(low, high, (count, *low.shape))[each, :, ring]
    return varied


def unlike_first(
    setup: Setup, values: Float[np.ndarray, "S 3 R"], apart: float, known: Float[np.ndarray, "K 3 R"] | None = None
) -> Int[np.ndarray, " S"]:
    """An order of ``values``: the first of each kind come first, that is those unlike all ``known`` and all before them.

    Two setups are unlike when a position (0 to 1) or a tilt (rad) differs by more than ``apart``. Equal rings on one link
    may change places, so both are compared in order of size. Phases do not count: they repeat by a sensor's spacing, and
    climbs that differ in nothing else end within a few hundredths of a percent of each other.
    """
    sorts = [(ring.link, ring.count, ring.radius, ring.sensor) for ring in setup.rings]
    equal = [[i for i, other in enumerate(sorts) if other == sort] for sort in dict.fromkeys(sorts)]

    def kind(some: np.ndarray) -> np.ndarray:
        return np.concatenate(
            [np.sort(some[:, :2, rings], axis=2).reshape(len(some), 2 * len(rings)) for rings in equal], axis=1
        )

    kinds, unlike, first = kind(values), np.ones(len(values), bool), np.zeros(len(values), bool)
    for other in () if known is None else kind(known):
        unlike &= np.abs(kinds - other).max(axis=1) > apart
    for i in range(len(values)):
        if unlike[i]:
            first[i] = True
            unlike &= np.abs(kinds - kinds[i]).max(axis=1) > apart
    return np.argsort(~first, kind="stable")
