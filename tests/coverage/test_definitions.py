"""A definition reads what it writes, holds the same limits in Python and in files, and names the
place of what is wrong.
"""

import inspect
import math
import re
from dataclasses import fields, replace
from typing import Annotated

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from place_rings.coverage.definitions.definition import adapter, definition, refuse
from place_rings.coverage.definitions.errors import InputError, explain
from place_rings.coverage.definitions.field_types import Coordinate, Items, Metres, Pair, Point
from place_rings.coverage.definitions.units import Degrees, Percent
from place_rings.coverage.robots.built_in import robot
from place_rings.coverage.robots.separation_distance import Safety
from place_rings.objectives.motion_limits import Motion
from place_rings.objectives.scene import Scene
from pydantic import Field, TypeAdapter, ValidationError
from pydantic.dataclasses import rebuild_dataclass


@definition
class Pad:
    """A pad for these tests."""

    size: Metres
    """Side, m."""
    turn: Annotated[float, Degrees("turn_deg", gt=-90, lt=90)] = 0.0
    """Turn, rad."""
    angles: Items[Annotated[float, Degrees("angles_deg")]] = ()
    share: Annotated[float, Percent("share_percent")] | None = None
    outline: Annotated[Items[Pair[Coordinate]], Field(max_length=4)] = ()
    centre: Point = (0.0, 0.0, 0.0)
    count: int = 1

    def __post_init__(self):
        if self.count > 3:
            refuse([(("count",), self.count, "at most 3")])


def table_of(pad):
    """All keys of a pad, as a file states them."""
    return adapter(Pad).dump_python(pad, mode="json", by_alias=True)


def read(keys):
    return adapter(Pad).validate_python(keys)


coordinates = st.floats(-100, 100)
pads = st.builds(
    Pad,
    st.floats(1e-6, 100),
    st.floats(-1.57, 1.57),
    st.lists(st.floats(-7, 7)),
    st.none() | st.floats(0, 1),
    st.lists(st.tuples(coordinates, coordinates), max_size=4),
    st.tuples(coordinates, coordinates, coordinates),
    st.integers(0, 3),
)


@given(pads)
@example(Pad(1.0, 1e-275))  # which a file rounds to the default
def test_a_file_holds_what_python_holds(pad):
    again = read(table_of(pad))
    assert again.turn == pytest.approx(pad.turn, abs=1e-10)
    assert again.angles == pytest.approx(pad.angles, abs=1e-10)
    assert (again.share is None) == (pad.share is None)
    rest = {"turn": pad.turn, "angles": pad.angles, "share": pad.share}
    assert replace(again, **rest) == pad
    assert table_of(again) == table_of(pad)


@given(st.floats(-200, 200))
def test_limits_in_files_are_those_of_python(angle):
    inside = -90 < angle < 90
    for make in (lambda: read({"size": 1, "turn_deg": angle}), lambda: Pad(1, math.radians(angle))):
        if inside:
            assert make().turn == pytest.approx(math.radians(angle))
        elif not math.isclose(abs(angle), 90):
            with pytest.raises(ValueError, match="turn"):
                make()


def test_arrays_and_lists_and_scalars_of_numpy_are_as_good_as_tuples_and_numbers():
    plain = Pad(2.0, 0.5, (0.1, 0.2), None, ((1.0, 2.0),), (1.0, 2.0, 3.0), 2)
    arrays = (np.array([0.1, 0.2]), None, np.array([[1, 2]]), np.array([1, 2, 3]), np.int64(2))
    assert Pad(np.float32(2), np.float64(0.5), *arrays) == plain
    assert hash(Pad(2, 0.5, [0.1, 0.2], None, [[1, 2]], [1, 2, 3], 2)) == hash(plain)


FAULTS = [
    ({"size": -1.0}, "size"),
    ({"size": "1"}, "size"),
    ({"size": True}, "size"),
    ({"size": math.nan}, "size"),
    ({}, "size"),
    ({"size": 1.0, "turn": 100.0}, "turn"),
    ({"size": 1.0, "angles": [1.0, "a"]}, "angles[1]"),
    ({"size": 1.0, "share": 1.5}, "share"),
    ({"size": 1.0, "outline": [[1.0]]}, "outline[0]"),
    ({"size": 1.0, "outline": [[1.0, 2.0]] * 5}, "outline"),
    ({"size": 1.0, "centre": [1.0, 2.0]}, "centre"),
    ({"size": 1.0, "centre": [1.0, 2.0, 101.0]}, "centre[2]"),
    ({"size": 1.0, "count": 1.0}, "count"),
    ({"size": 1.0, "count": 4}, "count"),
    ({"size": 10**400}, "size"),
    ({"size": 1.0, "turn": 10**400}, "turn"),
    ({"size": 1.0, "turn": -(10**400)}, "turn"),
    ({"size": 1.0, "angles": 1.0}, "angles"),
    ({"size": 1.0, "colour": 1.0}, "colour"),
]
KEYS = {"turn": "turn_deg", "angles": "angles_deg", "share": "share_percent"}


@pytest.mark.parametrize(("arguments", "place"), FAULTS)
def test_a_fault_is_one_line_with_its_place_in_python_and_in_a_file(arguments, place):
    with pytest.raises(InputError, match=re.escape(f"Pad: {place}: ")):
        Pad(**arguments)
    with pytest.raises(ValidationError) as caught:
        read({KEYS.get(name, name): 200 if name in KEYS else v for name, v in arguments.items()})
    if place.split("[")[0] not in KEYS:
        assert str(explain("f", caught.value, Pad)).startswith(f"f: {place}: ")


def test_a_file_has_no_key_by_a_name_of_python_that_is_in_another_unit():
    with pytest.raises(ValidationError) as caught:
        read({"size": 1.0, "turn": 0.5})
    assert "turn_deg" in str(explain("f", caught.value, Pad))


def test_docstrings_of_fields_describe_keys_in_the_unit_of_files():
    keys = adapter(Pad).json_schema()["properties"]
    assert keys["size"]["description"] == "side, m"
    assert keys["turn_deg"]["description"] == "turn, degrees"


@pytest.mark.parametrize(
    ("keys", "line"),
    [
        ({"angles_deg": 3}, "f: angles_deg: found 3, allowed: a list"),
        ({"turn_deg": "3"}, 'f: turn_deg: found "3", allowed: a number'),
        ({"centre": []}, "f: centre: found a list of 0, allowed: a list of 3"),
    ],
)
def test_a_fault_of_a_file_shows_once_what_the_file_states(keys, line):
    """Not what marks its unit, nor each missing item of a list."""
    with pytest.raises(ValidationError) as caught:
        read({"size": 1.0, **keys})
    text = str(explain("f", caught.value, Pad))
    assert text.startswith(line)
    assert "more)" not in text


def test_help_of_a_key_keeps_symbols_and_has_the_unit_of_files():
    safety, motion = (adapter(cls).json_schema()["properties"] for cls in (Safety, Motion))
    assert safety["reaction_s"]["description"].startswith("T_r, ")
    assert safety["intrusion_m"]["description"].startswith("C, ")
    assert motion["speed_deg_s"]["description"].endswith(", degrees/s")


def test_the_signature_of_a_definition_has_the_names_of_its_fields():
    """Before it is first constructed and afterwards."""
    for cls in (definition(type("Late", (), {"__annotations__": {"size": float}})), Pad):
        for _ in range(2):
            names = list(inspect.signature(cls).parameters)
            assert names == [field.name for field in fields(cls)]
            cls(1.0)
    text = str(inspect.signature(Pad))
    assert text.startswith("(size: float, turn: float = 0.0, angles: tuple[float, ...] = ()")


def test_a_fault_is_an_input_error_however_the_class_was_built():
    """pydantic sets the constructor anew when a file or a schema builds the class first."""
    for build in (
        lambda cls: adapter(cls).json_schema(),
        lambda cls: adapter(cls).validate_python({"size": 1.0}),
        lambda cls: TypeAdapter(cls).rebuild(force=True),
        lambda cls: TypeAdapter(list[cls]).validate_python([{"size": 1.0}]),
        lambda cls: rebuild_dataclass(cls, force=True),
    ):
        cls = definition(type("Late", (), {"__annotations__": {"size": float}}))
        build(cls)
        for _ in range(2):
            with pytest.raises(InputError, match="Late: size: found"):
                cls("1")
            assert list(inspect.signature(cls).parameters) == ["size"]


def test_python_has_no_argument_by_the_key_of_files_in_another_unit():
    """The value would be read in Python's unit."""
    for key, name in (("turn_deg", "turn"), ("share_percent", "share")):
        with pytest.raises(InputError, match=rf"Pad: {key}: .*did you mean {name}, in another"):
            Pad(1.0, **{key: 0.5})


def test_an_array_of_the_wrong_shape_is_shown_by_its_shape():
    with pytest.raises(InputError, match=re.escape("found an array of shape (2, 2)")):
        Pad(np.zeros((2, 2)))


def test_more_arguments_than_fields_are_one_line():
    with pytest.raises(InputError, match="Pad: arguments: found 9, allowed: at most 7 by position"):
        Pad(1.0, 0.0, (), None, (), (0.0, 0.0, 0.0), 1, 9)


def test_what_holds_arrays_is_compared_by_their_values():
    ur10 = robot("ur10")
    chain = ur10.chain
    copied = replace(chain, origin=chain.origin.copy(), axis=chain.axis.copy())
    assert copied is not chain
    assert Scene(robot=replace(ur10, chain=copied)) == Scene(robot=ur10)
    assert replace(ur10, chain=replace(chain, axis=-chain.axis)) != ur10
    assert replace(ur10, home=None) != ur10 != replace(ur10, home=ur10.home + 0.1)
    assert ur10 != "ur10"
