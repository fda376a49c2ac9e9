"""Equality of dataclasses whose fields hold arrays.

Python writes the comparison itself, but that of two arrays is an array and has no truth value.
Where both have no value (nan), they are equal.
"""

import dataclasses
from typing import Any

import numpy as np


def equal_fields(self: Any, other: object) -> bool:
    """Return whether two instances of one class have equal fields: a class's ``__eq__``."""
    names = [field.name for field in dataclasses.fields(self) if field.compare]
    return self.__class__ is other.__class__ and all(
        _equal(getattr(self, name), getattr(other, name)) for name in names
    )


def _equal(one: Any, other: Any) -> bool:
    if one is other:
        return True
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        return np.array_equal(one, other, equal_nan=np.asarray(one).dtype.kind == "f")
    return bool(one == other)
