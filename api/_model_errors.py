"""Errors of files' models in the terms of Python: attributes and radians in place of keys and
degrees."""

import math
from collections.abc import Iterator
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from ._errors import InputError
from .coverage.angles import radians_hint
from .coverage.definitions.errors import explain, key_path
from .formats.schema.base_model import StrictModel
from .formats.schema.mapping import MappedModel, domain_field


def model_error(subject: str, error: ValidationError, model: type[BaseModel]) -> InputError:
    """Return the error of an argument from that of the model of its file.

    Args:
        subject: class or argument at fault, for the message.
        error: the error, of ``model`` or of a table in it.
        model: the model of the whole.
    """
    fault = error.errors(include_url=False)[0]
    own, outer = _tables(model).get(error.title, (model, []))
    path = key_path(fault["loc"])
    line = str(explain("", error, own)).removeprefix(": ").removeprefix(f"{path}: ")
    names = [*outer, *_attributes(own, fault["loc"])]
    if any(isinstance(key, str) and "_deg" in key for key in fault["loc"]):
        line = f"in degrees, {line}{_hint(fault)}"
    return InputError(": ".join([subject, *filter(None, [key_path(tuple(names))]), line]))


def _hint(fault: Any) -> str:
    """Return what would state the angle that was given in degrees in place of radians, or ""."""
    value = fault.get("ctx", {}).get("found", fault.get("input"))
    try:
        return radians_hint(round(math.radians(float(value)), 6))
    except (TypeError, ValueError):
        return ""


def _tables(model: type[BaseModel]) -> dict[str, tuple[type[BaseModel], list[str]]]:
    """Return a model and those of the tables in it by their names, each with its path."""
    found, new = {model.__name__: (model, list[str]())}, [model]
    while new:
        outer = new.pop(0)
        for key, info in outer.model_fields.items():
            for inner in _models_in(info.annotation):
                if inner.__name__ not in found:
                    found[inner.__name__] = inner, [*found[outer.__name__][1], key]
                    new.append(inner)
    return found


def _models_in(annotation: Any) -> Iterator[type[StrictModel]]:
    if isinstance(annotation, type) and issubclass(annotation, StrictModel):
        yield annotation
    for inner in get_args(annotation):
        yield from _models_in(inner)


def _attributes(model: type[BaseModel], loc: tuple[int | str, ...]) -> Iterator[int | str]:
    """Yield the attributes of the domain's objects at the place of an error."""
    at: type[BaseModel] | None = model
    for part in loc:
        if at is None or isinstance(part, int) or part not in at.model_fields:
            yield part.removesuffix("_deg") if isinstance(part, str) else part
            continue
        scene = at.__name__ == "SceneModel"  # ``Scene`` has the names of the keys
        yield domain_field(at, part) if issubclass(at, MappedModel) and not scene else part
        at = next(_models_in(at.model_fields[part].annotation), None)
