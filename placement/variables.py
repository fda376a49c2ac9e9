"""The search's variables: positions, tilts and phases of the rings, and the setup that they stand for."""

import math
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from ..coverage.rings import Ring, Setup, ring_values
from ..objectives.scene import Scene


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


def starts(scene: Scene, setup: Setup, count: int, seed: int) -> list[Float[np.ndarray, "3 R"]]:
    """``count`` starting points within the bounds: the paper's tilts for this layout first, then random ones."""
    low, high = bounds(scene, setup)
    values = ring_values(setup)
    even = np.stack([values.position, values.tilt, values.phase])
    found = []
    for tilt_deg in (55.0, 25.0, 0.0):
        middle = np.array([np.mean(scene.limits_of(r.link).position) for r in setup.rings])
        toward = np.sign(np.round(middle - even[0], 9)) * (high[0] > low[0])
        found.append(np.clip(np.stack([even[0], toward * math.radians(tilt_deg), even[2]]), low, high))
    rng = np.random.default_rng(seed)
    found += [rng.uniform(low, high) for _ in range(count - len(found))]
    return found[:count]
