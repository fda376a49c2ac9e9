"""Targets as tables of files, and combinations of targets, whose parts are such tables too."""

from collections.abc import Iterator, Mapping
from dataclasses import fields, replace
from functools import reduce
from typing import Annotated, Any, ClassVar, Self

from pydantic import Field, WithJsonSchema
from pydantic_core import core_schema

from ..definitions.definition import adapter, definition, read_as, refuse
from ..definitions.errors import schema_of
from ..definitions.field_types import Items, Metres, Text
from ..solids.base import Difference, Intersection, Solid, Union
from . import named, own
from .posed_robot import PosedRobot
from .target import KINDS, WITH_RADIUS, Target, TargetTerms, name_faults, named_kinds

_OF_TARGET = {field.name for field in fields(Target)}  # not of a part


class PartTable:
    """Annotation of a volume that files state as a table by its ``kind``."""

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        return core_schema.no_info_plain_validator_function(
            _part_of, serialization=core_schema.plain_serializer_function_ser_schema(_table_of)
        )

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> Any:
        tables: list[tuple[str, type]] = [(kind, KINDS[kind]) for kind in _kinds()]
        kinds = {"type": "string", "enum": _kinds(), "description": "kind of the volume"}
        return {
            "type": "object",
            "properties": {"kind": kinds},
            "required": ["kind"],
            "oneOf": [_schema_of(*pair) for pair in (*tables, ("mesh", own.MeshFile))],
        }


Part = Annotated[Target, PartTable()]
_Inner = Annotated[Part, WithJsonSchema({"type": "object", "description": "as volume"})]


def _kinds() -> list[str]:
    """Return the kinds of volumes that files can state, one's own first."""
    return sorted(
        (kind for kind, cls in KINDS.items() if cls.in_files), key=lambda k: not KINDS[k].own
    )


def _schema_of(kind: str, cls: type) -> dict[str, Any]:
    """Return the JSON Schema of a part's table."""
    whole = schema_of(cls)
    keys = {
        k: v for k, v in whole.get("properties", {}).items() if k not in {"at_least", *_OF_TARGET}
    }
    return {
        "title": cls.__name__,
        "description": whole.get("description", "").partition("\n\n")[0],
        "properties": {"kind": {"const": kind}, **keys},
        "required": ["kind", *whole.get("required", ())],
        "additionalProperties": False,
    }


def _part_of(value: Any) -> Target:
    if isinstance(value, Target):
        return value
    kinds = ", ".join(_kinds())
    if not isinstance(value, Mapping):
        refuse([((), value, f"a target volume, or a table with a kind among {kinds}")])
    kind = value.get("kind")
    if not isinstance(kind, str) or kind not in _kinds():
        refuse([(("kind",), kind, kinds)])
    keys = {key: v for key, v in value.items() if key != "kind"}
    table: Any = KINDS[kind]
    if kind == "mesh" and not {"vertices", "faces"} & keys.keys():
        table = own.MeshFile
    stated = table.__pydantic_fields__.items()
    known = [field.alias or name for name, field in stated if name not in _OF_TARGET]
    if odd := [key for key in keys if key not in known]:
        allowed = f"{', '.join(known) or 'no other key'}, because the kind is {kind}"
        refuse([((), odd[0], allowed)])
    part = read_as(table, keys)
    if isinstance(part, Target):
        return part
    refuse([(("file",), part.file, "vertices and faces, where no file is read")])
    raise AssertionError


def _table_of(part: Target) -> dict[str, Any]:
    """Return the table of a part, with the keys that differ from their defaults."""
    keys = adapter(type(part)).dump_python(
        part, mode="json", by_alias=True, exclude_defaults=True, exclude=_OF_TARGET
    )
    return {"kind": part.kind, **keys}


def _listed(parts: list[str]) -> str:
    return " and ".join(filter(None, [", ".join(parts[:-1]), parts[-1]]))


@definition
class _Combination(Target):
    """Targets combined by a rule, which is the kind."""

    join: ClassVar[Any]

    of: Annotated[Items[_Inner], Field(min_length=2, max_length=100)]
    """Two or more targets, named ones among them; their own weights, minima and names are not
    used."""

    def solid(self, place: PosedRobot) -> Solid:
        whole: Solid = reduce(self.join, [part.solid(place) for part in self.of])
        return whole

    def _turned(self) -> dict[str, Any]:
        return {"of": tuple(part.turned() for part in self.of)}

    def parts(self) -> Iterator[Target]:
        yield self
        for part in self.of:
            yield from part.parts()

    def described(self) -> str:
        return f"the {self.kind} of {_listed([part.described() for part in self.of])}"


@definition
class UnionOf(_Combination):
    """The union of two or more targets.

    Example:
        >>> import place_rings as pr
        >>> len(pr.UnionOf([pr.Box((1, 1, 1)), pr.Shell(0.5)]).of)
        2
    """

    kind = "union"
    join = Union

    @property
    def bounded(self) -> bool:
        return all(part.bounded for part in self.of)


@definition
class DifferenceOf(_Combination):
    """The first of two or more targets less all others.

    Example:
        >>> import place_rings as pr
        >>> far = pr.DifferenceOf([pr.Shell(1.5), pr.Shell(0.5)], name="far")
    """

    kind = "difference"
    join = Difference

    @property
    def bounded(self) -> bool:
        return self.of[0].bounded

    def described(self) -> str:
        first, *others = (part.described() for part in self.of)
        return f"{first} less {_listed(others)}"


@definition
class IntersectionOf(_Combination):
    """The intersection of two or more targets.

    Example:
        >>> import place_rings as pr
        >>> front = pr.IntersectionOf([pr.Shell(0.5), pr.HalfSpace((-1, 0, 0))], name="in front")
    """

    kind = "intersection"
    join = Intersection

    @property
    def bounded(self) -> bool:
        return any(part.bounded for part in self.of)


@definition(kw_only=True)
class TargetTable(TargetTerms):
    """A target as files state it: a named one, or the name and the volume of one's own."""

    volume: Part | None = None
    """A volume of one's own, for a name of one's own."""
    name: Text
    """Name of the target volume: V_O, V_T, V_OT, V_S, V_N, V_P, or that of one's own."""
    radius: Metres | None = None
    """For V_N (distance from the robot's bodies) and V_S (of its discs) only, m."""

    def __post_init__(self) -> None:
        if self.volume is not None:
            refuse(name_faults(self.name))
            if not self.volume.bounded:
                allowed = "a volume with an end; intersect a half-space with another"
                refuse([(("volume",), self.volume.kind, allowed)])
        elif self.name not in named_kinds():
            allowed = f"{', '.join(named_kinds())}, or any name with a volume of one's own"
            refuse([(("name",), self.name, allowed)])
        if (self.radius is None) == (self.name in WITH_RADIUS):
            need = "a radius in metres" if self.radius is None else "no radius"
            refuse([(("radius",), self.radius, f"{need}, because the target is {self.name}")])

    def target(self) -> Target:
        """Return the target that the table states."""
        terms: dict[str, Any] = {field.name: getattr(self, field.name) for field in _TERMS}
        if self.volume is None:
            return named.named_target(self.name, self.radius, **terms)
        return replace(self.volume, name=self.name, **terms)

    @classmethod
    def of(cls, target: Target) -> Self:
        """Return the table of a target."""
        terms: dict[str, Any] = {field.name: getattr(target, field.name) for field in _TERMS}
        radius = getattr(target, "radius", None)
        keys: dict[str, Any] = {"radius": radius} if target.named else {"volume": target}
        return cls(name=target.name, **keys, **terms)


class _InFiles:
    """Annotation of a target that files state as a ``TargetTable``."""

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        def read(value: Any, table: Any) -> Target:
            return value if isinstance(value, Target) else table(value).target()

        def write(target: Target, table: Any) -> dict[str, Any]:
            keys = table(TargetTable.of(target))
            return {key: keys[key] for key in _ORDER if key in keys}

        return core_schema.no_info_wrap_validator_function(
            read,
            handler.generate_schema(TargetTable),
            serialization=core_schema.wrap_serializer_function_ser_schema(write),
        )


_TERMS = fields(TargetTerms)
_ORDER = (
    "volume",
    "importance",
    "reachable",
    "name",
    "radius",
    "weight",
    "at_least",
    "largest_gap_mm",
)
TargetInFiles = Annotated[Target, _InFiles()]


def stated_keys(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keys of a target's table that differ from their defaults."""
    defaults = {"reachable": False, "weight": 1.0, "at_least": 0.0}
    return {key: value for key, value in table.items() if value != defaults.get(key)}


def own_keys(target: Target) -> dict[str, Any]:
    """Return the keys of a target's table beyond its name, radius, weight and minimum coverage."""
    table = stated_keys(adapter(TargetInFiles).dump_python(target.target, mode="json"))
    return {key: value for key, value in table.items() if key not in ("name", "radius")}
