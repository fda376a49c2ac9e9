"""What a user compares: results and arguments of the API, whose fields may hold arrays."""

import copy
import dataclasses
from collections.abc import Callable
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np
import place_rings as pr
import pytest
from place_rings.coverage.definitions.equality import equal_fields
from place_rings.simulation.detection import Timing
from place_rings.simulation.twin.sensor_twin import TwinFrame

PUBLIC = [v for name in pr.__all__ if dataclasses.is_dataclass(v := getattr(pr, name))]


def parts(hint: Any) -> list[Any]:
    """A type and those that it is made of; a function is compared as one."""
    of = () if get_origin(hint) is Callable else get_args(hint)
    return [hint, *(part for arg in of for part in parts(arg))]


def held(cls: type, found: dict[type, list[str]]) -> dict[type, list[str]]:
    """The classes that Python compares field by field with ``cls``, and their arrays' fields."""
    if cls in found or not dataclasses.is_dataclass(cls) or not cls.__dataclass_params__.eq:
        return found
    hints, found[cls] = get_type_hints(cls, include_extras=True), []
    for field in dataclasses.fields(cls):
        for part in parts(hints[field.name]) if field.compare else ():
            if part is np.ndarray or hasattr(part, "array_type"):
                found[cls].append(field.name)
            elif isinstance(part, type):
                held(part, found)
    return found


@pytest.mark.parametrize("cls", PUBLIC, ids=lambda cls: cls.__name__)
def test_arrays_in_what_a_user_has_are_compared_as_a_whole(cls):
    own = {one: names for one, names in held(cls, {}).items() if names}
    assert {one.__name__: own[one] for one in own if one.__eq__ is not equal_fields} == {}


def test_equal_readings_are_equal_also_where_there_is_none():
    distance, status = np.array([[100.0, np.nan]]), np.array([[0, 1]])
    frame = TwinFrame(np.zeros(1), distance, status, distance[..., None])
    assert frame == copy.deepcopy(frame)
    assert frame != dataclasses.replace(frame, distance_mm=distance + 1)
    assert frame != Timing
