"""Measured stops: what is summed up by condition, and the time that counts."""

import math
import statistics

import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.robots.built_in import UR10
from place_rings.coverage.robots.separation_distance import Safety, separation, stopping_time
from place_rings.coverage.robots.stop_times import StopTime, by_condition, repeated
from place_rings.objectives.scene import Scene

from tests.support.refusals import refused

SHARES = st.sampled_from((33.0, 66.0, 100.0))
STOPS = st.lists(
    st.builds(
        StopTime,
        joint=st.sampled_from(UR10.chain.joints[:2]),
        extension_percent=SHARES,
        load_percent=SHARES,
        speed_percent=SHARES,
        stop_s=st.floats(0.01, 2),
        stop_rad=st.floats(0, 3),
        repeat=st.integers(1, 20),
    ),
    min_size=1,
    max_size=30,
    unique_by=lambda stop: (stop.condition, stop.repeat),
).map(tuple)


def a_stop(**other):
    shares = dict.fromkeys(("extension_percent", "load_percent", "speed_percent"), 66)
    values = {"joint": UR10.chain.joints[0], "stop_s": 0.4, "stop_rad": 0.3, "repeat": 1}
    return StopTime(**shares | values | other)


@given(STOPS, st.data())
def test_more_measurements_never_lower_the_time_that_counts(stops, data):
    some = stops[: data.draw(st.integers(1, len(stops)))]
    fewer, more = (stopping_time(Safety(stop_times=s), "ur10", 1.0) for s in (some, stops))
    assert fewer <= more == max(stop.stop_s for stop in stops)
    assert all(one.largest_s <= more for one in by_condition(stops))


@given(STOPS)
def test_conditions_hold_each_measurement_once(stops):
    rows = by_condition(stops)
    assert sum(row.measurements for row in rows) == len(stops)
    keys = [(r.joint, r.extension_percent, r.load_percent, r.speed_percent) for r in rows]
    assert keys == sorted({stop.condition for stop in stops})
    for row, key in zip(rows, keys, strict=True):
        same = [stop for stop in stops if stop.condition == key]
        assert row.mean_s == pytest.approx(statistics.fmean(s.stop_s for s in same))
        assert row.largest_s == max(s.stop_s for s in same)
        assert row.largest_rad == max(s.stop_rad for s in same)
        assert row.largest_m is None
        assert row.enough == (len(same) >= 10)


def test_measured_stops_take_the_place_of_the_table_and_count_on_any_robot():
    safety = Safety(stop_times=(a_stop(), a_stop(repeat=2, stop_s=0.9)))
    assert stopping_time(safety, "r2d2", 99.0) == 0.9
    assert math.isclose(separation(safety, 1.0, 0.9).S_h, 1.6 * (0.1 + 0.9))


def test_stops_that_contradict_are_refused():
    assert repeated((a_stop(), a_stop(repeat=2), a_stop(stop_s=0.1))) == 2
    with refused("stop_times[1].repeat 1 once"):
        Safety(stop_times=(a_stop(), a_stop()))
    with refused("stopping 0.3 stop_times"):
        Safety(stopping=0.3, stop_times=(a_stop(),))
    with refused("stop_rad nothing stop_m"):
        a_stop(stop_rad=None)
    with refused('safety.stop_times[0].joint "tail" ur10'):
        Scene(safety=Safety(stop_times=(a_stop(joint="tail"),)))
