"""Cones, poses and setups by a generator, for laws that draw a seed."""

import math

import numpy as np
from hypothesis import strategies as st
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.coverage.solids.cones import Cones

from ..strategies.units import uniform_directions

seeds = st.integers(0, 2**32 - 1)


unit = uniform_directions


def cones(rng: np.random.Generator, n: int) -> Cones:
    """Cones of any width and reach, narrow and wide ones among them."""
    half = rng.uniform(math.radians(0.5), math.radians(80), n)
    return Cones(rng.uniform(-0.5, 0.5, (n, 3)), unit(rng, n), half, rng.uniform(0.1, 1.5, n))


def pose(rng: np.random.Generator, joints: int = 6) -> np.ndarray:
    """Joint angles of an arm of so many joints, rad."""
    return rng.uniform(-math.pi, math.pi, joints)


def setup(rng: np.random.Generator, most_sensors: int = 8) -> Setup:
    """One to four rings anywhere on a robot that is built in."""

    def ring() -> Ring:
        return Ring(
            link=str(rng.choice(["upper_arm", "forearm", "tool"])),
            position=float(rng.uniform(0, 1)),
            count=int(rng.integers(1, most_sensors + 1)),
            tilt=float(rng.uniform(-1.4, 1.4)),
            phase=float(rng.uniform(0, 6)),
            radius=float(rng.uniform(0.03, 0.15)),
            sensor=Sensor(float(rng.uniform(0.05, 2.0)), float(rng.uniform(0.2, 1.6))),
        )

    return Setup(tuple(ring() for _ in range(rng.integers(1, 5))))
