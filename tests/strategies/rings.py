"""Robots, poses, rings and setups."""

import math

import numpy as np
from hypothesis import strategies as st
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.robots.built_in import ROBOTS
from place_rings.coverage.sensors.sensor import Sensor

LINKS = ("upper_arm", "forearm", "tool")  # of every built-in robot
LONGEST = max(len(robot.chain) for robot in ROBOTS.values())  # joints
ROBOT_NAMES = st.sampled_from(list(ROBOTS))


def poses(joints: int = 6, most_deg: int = 180) -> st.SearchStrategy[np.ndarray]:
    """Joint angles (joints,) rad of up to ``most_deg`` degrees either way; simplest: all zero."""
    return st.tuples(*[st.integers(-most_deg, most_deg)] * joints).map(np.radians)


def ring(
    link: str,
    position: float,
    count: int,
    tilt_deg: int,
    phase_deg: int,
    radius_mm: int,
    fov_deg: int,
    range_mm: int,
) -> Ring:
    """A ring of sensors with round beams."""
    sensor = Sensor(math.radians(fov_deg), range_mm / 1000)
    tilt, phase = math.radians(tilt_deg), math.radians(phase_deg)
    return Ring(link, position, count, tilt, phase, radius_mm / 1000, sensor)


def setup(rings: list[Ring]) -> Setup:
    """A setup."""
    return Setup(tuple(rings))


SHARES = st.integers(0, 100).map(lambda percent: percent / 100)


def rings(most_sensors: int = 8) -> st.SearchStrategy[Ring]:
    """Rings of up to ``most_sensors`` sensors anywhere on a built-in robot."""
    return st.builds(
        ring,
        st.sampled_from(LINKS),
        SHARES,
        st.integers(1, most_sensors),
        tilt_deg=st.integers(-80, 80),
        phase_deg=st.integers(0, 345),
        radius_mm=st.integers(30, 150),
        fov_deg=st.integers(3, 115),
        range_mm=st.integers(200, 1600),
    )


def setups(most_sensors: int = 8, most_rings: int = 4) -> st.SearchStrategy[Setup]:
    """Setups of one ring or more, each of up to ``most_sensors`` sensors."""
    return st.lists(rings(most_sensors), min_size=1, max_size=most_rings).map(setup)
