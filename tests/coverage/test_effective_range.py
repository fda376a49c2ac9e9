"""Effective ranges: the sourced figures come back, rules only ever take away, nothing is
extrapolated in silence.
"""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.definitions.definition import adapter
from place_rings.coverage.sensors.catalogue import MODELS, model
from place_rings.coverage.sensors.effective_range import Use, size_of
from place_rings.coverage.sensors.sensor import Sensor, effective
from place_rings.coverage.sensors.sensor_model import diagonal_of_sides, side_of_diagonal

NAMES = st.sampled_from(sorted(MODELS))
REFLECTANCE = st.none() | st.floats(0.01, 1.0)
SIZE = st.none() | st.tuples(st.floats(0.01, 3.0), st.floats(0.01, 3.0))


DRAWN = st.tuples(NAMES, st.integers(-1, 5), REFLECTANCE, SIZE)


def use_of(drawn):
    """A use from what was drawn: which of the lights, if any."""
    name, which, reflectance, size = drawn
    lights = [*model(name).levels]
    return Use(name, None if which < 0 else lights[which % len(lights)], reflectance, size)


def slant_m(found):
    """How far it sees along a ray, m: the range before the beam's flat base is set."""
    return found.steps[-2].range_m


# the worked examples beside the datasheets
@pytest.mark.parametrize(("size", "wanted"), [((0.45, 0.70), 2.45), ((0.04, 10.0), 1.16)])
def test_fill_rule_gives_the_worked_examples(size, wanted):
    # they take sides of 27°/√2
    own = replace(model("vl53l1x"), name="worked", diagonal_deg=None, fov_deg=27 / math.sqrt(2))
    own = replace(own, fov_up_deg=own.fov_deg)
    assert slant_m(effective(replace(Use(own), target_size=size))) == pytest.approx(
        wanted, abs=0.006
    )


@pytest.mark.parametrize(
    ("ambient", "wanted"), [("dark", 3.6), ("50kcps", 1.66), ("200kcps", 0.73), ("51kcps", 0.73)]
)
def test_light_is_that_of_the_next_stronger_figure(ambient, wanted):
    assert slant_m(effective(Use("vl53l1x", ambient))) == wanted


def test_reflectance_gives_what_was_measured_and_never_more():
    assert slant_m(effective(Use("vl53l1x", "dark", 0.17))) == 1.70
    assert slant_m(effective(Use("tfmini", "dark", 0.10))) == 5.0
    assert slant_m(effective(Use("vl53l1x", "50kcps", 0.17))) == pytest.approx(
        1.66 * math.sqrt(0.17 / 0.88)
    )


def test_the_law_of_reflectance_is_below_every_figure_it_can_be_held_against():
    held = 0
    for m in MODELS.values():
        for light in m.levels:
            same = sorted((r for r in m.ranges if r.ambient == light), key=lambda r: r.reflectance)
            for dark, bright in itertools.pairwise(same):
                assert (
                    bright.range_m * math.sqrt(dark.reflectance / bright.reflectance)
                    <= dark.range_m
                )
                held += 1
    assert held >= 2


@given(DRAWN)
def test_each_rule_only_takes_away_and_the_last_is_used(drawn):
    use = use_of(drawn)
    found = effective(use)
    ranges = [step.range_m for step in found.steps]
    assert ranges == sorted(ranges, reverse=True)
    assert found.range_m == ranges[-1] == found.sensor.range_m > 0


@given(DRAWN)
def test_fill_rule_solves_its_equation(drawn):
    use = use_of(drawn)
    found = effective(use)
    if use.target_size is None:
        return
    before, after = found.steps[-3].range_m, found.steps[-2].range_m
    fill = math.prod(
        min(1.0, s / (2 * after * math.tan(math.radians(deg) / 2)))
        for s, deg in zip(use.target_size, found.model.zone_deg, strict=True)
    )
    assert fill * (before / after) ** 2 == pytest.approx(1.0, rel=1e-9)


@given(DRAWN, st.floats(0.1, 1.0), st.floats(0.1, 1.0))
def test_a_darker_or_smaller_target_is_seen_no_farther(drawn, darker, smaller):
    use = use_of(drawn)
    rho, size = use.reflectance or 0.88, use.target_size or (1.0, 1.0)
    least = effective(
        Use(use.model, use.ambient, rho * darker, (size[0] * smaller, size[1]))
    ).range_m
    assert least <= effective(Use(use.model, use.ambient, rho, size)).range_m * (1 + 1e-12)


@given(NAMES)
def test_stronger_light_is_never_seen_through_farther(name):
    ranges = [effective(Use(name, light)).range_m for light in model(name).levels]
    assert ranges == sorted(ranges, reverse=True)


@given(DRAWN)
def test_the_flat_base_lies_within_the_range(drawn):
    use = use_of(drawn)
    found = effective(use)
    along, up = (math.tan(math.radians(side) / 2) for side in found.model.sides_deg)
    corner = found.range_m * np.array([1, along, up if found.model.square else 0.0])
    assert np.linalg.norm(corner) <= slant_m(found) * (1 + 1e-12)


def test_side_of_a_diagonal_is_that_of_the_square_within():
    # the geometry that the facts state
    assert side_of_diagonal(60.74) == pytest.approx(45.0, abs=0.05)
    assert side_of_diagonal(78.46) == pytest.approx(60.0, abs=0.05)


@pytest.mark.parametrize(
    ("sides", "diagonal"), [((45, 45), 65), ((60, 60), 90), ((55, 42), 71)], ids=str
)
def test_the_makers_squares_are_consistent_by_its_own_rule_only(sides, diagonal):
    assert diagonal_of_sides(*sides, "sines") == pytest.approx(diagonal, abs=0.6)
    assert abs(diagonal_of_sides(*sides) - diagonal) > 3


@given(st.floats(0.1, 175), st.sampled_from(["tangents", "sines"]))
def test_side_and_diagonal_are_inverse(diagonal, corners):
    side = side_of_diagonal(diagonal, corners)
    assert diagonal_of_sides(side, side, corners) == pytest.approx(diagonal, rel=1e-9)


@pytest.mark.parametrize("name", MODELS)
def test_the_beam_of_the_catalogue_lies_within_the_stated_one(name):
    m = model(name)
    along, up = (math.radians(side) / 2 for side in m.sides_deg)
    edge = np.linspace(-1, 1, 41)
    for x, y in itertools.product(edge * math.tan(along), edge * math.tan(up) * m.square):
        ray = np.array([x, y, 1.0]) / math.hypot(x, y, 1.0)
        if m.corners == "sines":  # ST's square, in the components of a direction
            assert abs(ray[0]) <= math.sin(along) + 1e-12
            assert abs(ray[1]) <= math.sin(up) + 1e-12
        if m.diagonal_deg is not None:
            assert math.acos(ray[2]) <= math.radians(m.diagonal_deg / 2) + 1e-9
    stated = (m.fov_deg, m.fov_up_deg)
    assert all(s is None or side <= s for side, s in zip(m.sides_deg, stated, strict=True))
    if m.square and m.diagonal_deg is not None:
        across = diagonal_of_sides(*m.sides_deg, m.corners)
        assert across == pytest.approx(m.diagonal_deg, abs=1.0)
    assert m.zones * m.rows == 1 or m.square


@pytest.mark.parametrize(
    ("use", "found"),
    [
        (("vl53l1x", "300kcps"), "300kcps"),
        (("vl53l1x", "5klx"), "5klx"),
        (("vl53l4cd", "1klx"), "1klx"),
        (("vl53l0x", "sunny"), "sunny"),
        (("vl53l1x", None, 0.0), "reflectance"),
        (("vl53l1x", None, 1.2), "1.2"),
        (("vl53l1x", None, None, (0.0, 1.0)), "target_size"),
        (("vl53l1x", None, None, (math.inf, 1.0)), "inf"),
        (("vl6180x",), "vl6180x"),
    ],
)
def test_what_is_not_sourced_is_refused(use, found):
    with pytest.raises(ValueError, match=found):
        effective(Use(*use))


def test_a_target_darker_than_any_measured_is_reported():
    (step,) = (
        s for s in effective(Use("vl53l1x", reflectance=0.018)).steps if s.rule == "reflectance"
    )
    assert not step.measured


@pytest.mark.parametrize("text", ["0.1", "0.1x", "x", "0x1", "-1x1", "1x1x1", "ax1", "nanx1"])
def test_a_size_that_is_none_is_refused(text):
    with pytest.raises(ValueError, match=repr(text)):
        size_of(text)


@given(DRAWN)
def test_a_sensor_of_the_catalogue_reads_back_from_a_file(drawn):
    use = use_of(drawn)
    sensor = effective(use).sensor
    of = adapter(Sensor)
    assert of.validate_python(of.dump_python(sensor, exclude_none=True)) == sensor


def test_every_figure_has_a_source():
    assert all(m.source and m.ranges for m in MODELS.values())
