"""What all target volumes have in common: weight, minimum coverage, importance and name."""

import re
import warnings
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import field, replace
from functools import cached_property
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import BeforeValidator, Field

from ..definitions.definition import Fault, definition, fault, refuse
from ..definitions.field_types import Text
from ..definitions.units import Key, Millimetres
from ..solids.base import Solid
from ..weight_field import WeightField
from .posed_robot import PosedRobot

KINDS: dict[str, type["Target"]] = {}
"""The class of each kind of target, by the name of the kind in files."""
WITH_RADIUS = ("V_S", "V_N")
"""The named volumes that have a radius."""
OWN = "V_R"
"""Name of the robot's own volume, which may be a part of a volume but is no target."""


def _by_whom(value: Any) -> Any:
    if not isinstance(value, bool) and value != "person":
        raise fault(value, "true, false or person")
    return value


@definition(kw_only=True)
class TargetTerms:
    """What a scene states of a target beside its name and its volume."""

    importance: WeightField | None = field(default=None, repr=False)
    """Weight field, made by ``weight_field``: how much each place matters; None: all the same."""
    reachable: Annotated[bool | Literal["person"], BeforeValidator(_by_whom)] = field(
        default=False, repr=False
    )
    """Whether only what is connected to the robot past the obstacles, and the polyhedra that it
    carries, counts; ``"person"``: only what the scene's ``person`` can touch."""
    weight: Annotated[float, Field(ge=0, le=1e6)] = 1.0
    """Relative weight in the mean over the targets; 0: only its minimum coverage counts."""
    at_least_percent: Annotated[float, Key("at_least", ge=0, le=100)] = 0.0
    """Minimum coverage that a search must keep, percent."""
    largest_gap: Annotated[float, Millimetres("largest_gap_mm", gt=0, lt=1000)] | None = None
    """Largest allowed diameter of a sphere with its centre in the target that no sensor sees, m;
    a search keeps it if it can; ``verify`` and a search's answer say whether it is kept."""


@definition(kw_only=True)
class Target(TargetTerms, ABC):
    """Common base of all target volumes; use one of its subclasses.

    Raises:
        InputError: for a value out of range, or a name that is taken by a named volume. A
            half-space has no end, so only a combination with another volume can be a target.
    """

    kind: ClassVar[str] = ""
    """Name of the kind of volume in files, such as ``V_S`` or ``box``."""
    own: ClassVar[bool] = True
    """Whether it is none of the named volumes."""
    in_files: ClassVar[bool] = True
    """Whether files can hold targets of the kind."""
    name: Text = ""
    """Name in reports and files; by default the kind of volume, such as ``box``."""

    def __init_subclass__(cls) -> None:
        if "kind" in vars(cls):
            KINDS[cls.kind] = cls

    def __post_init__(self) -> None:
        if not self.name:
            object.__setattr__(self, "name", self.kind)
        if self.own or self.name != self.kind:
            refuse(name_faults(self.name))

    @property
    def symbol(self) -> str:
        """The former name of ``kind``."""
        warnings.warn("symbol is now called kind", DeprecationWarning, stacklevel=2)
        return self.kind

    @property
    def goal(self) -> Self:
        """The target itself, which was wrapped before."""
        warnings.warn("a target is its own goal; leave out .goal", DeprecationWarning, stacklevel=2)
        return self

    @property
    def volume(self) -> Self:
        """The target itself, which was wrapped before."""
        warnings.warn("a target is a volume; leave out .volume", DeprecationWarning, stacklevel=2)
        return self

    @property
    def named(self) -> bool:
        """Whether it is a named volume under its own name."""
        return not self.own and self.name == self.kind

    @property
    def bounded(self) -> bool:
        """Whether the volume has an end in every direction."""
        return True

    @property
    def at_least(self) -> float:
        """Minimum coverage, in [0, 1]."""
        return self.at_least_percent / 100

    @cached_property
    def target(self) -> Self:
        """The target without its weight, minimum coverage and largest gap, which records and caches
        identify."""
        if self.weight == 1.0 and self.at_least_percent == 0.0 and self.largest_gap is None:
            return self
        return replace(self, weight=1.0, at_least_percent=0.0, largest_gap=None)

    @abstractmethod
    def solid(self, place: PosedRobot) -> Solid:
        """Return the volume as a solid in the base frame, without what is subtracted from all."""

    @abstractmethod
    def described(self) -> str:
        """Return what the volume is, such as ``a sphere of radius 1 m``."""

    def turned(self) -> Self:
        """Return the target turned by 180° about z of the base; a named one moves with the
        robot."""
        weights = None if self.importance is None else self.importance.turned()
        return replace(self, importance=weights, **self._turned())

    def _turned(self) -> dict[str, Any]:
        """Return the fields that half a turn about z changes."""
        return {}

    def parts(self) -> Iterator["Target"]:
        """Yield the target and, depth first, all volumes of which it is made."""
        yield self

    @property
    def names(self) -> frozenset[str]:
        """The kinds of all volumes of which the target is made."""
        return frozenset(part.kind for part in self.parts())

    @property
    def radii(self) -> tuple[float, ...]:
        """Radii of all V_S of which the target is made, m."""
        shells: Iterator[Any] = (part for part in self.parts() if part.kind == "V_S")
        return tuple(shell.radius for shell in shells)

    @property
    def plain(self) -> bool:
        """Whether the target is a named volume as it is."""
        return self.named and self.importance is None and not self.reachable

    @property
    def key(self) -> tuple[str, float | None]:
        """Name and radius under which records list the target.

        A named volume with a weight field, or cut by obstacles, has another name and no radius.
        """
        return (self.kind, getattr(self, "radius", None)) if self.plain else (str(self), None)

    def __str__(self) -> str:
        if not self.named:
            return self.name
        weighted = " weighted" if self.importance is not None else ""
        by = " by a person" if self.reachable == "person" else ""
        return self.described() + (f" reachable{by}" if self.reachable else "") + weighted


def standalone(target: Target) -> Target:
    """Return a target that can be more than a part of another one.

    Raises:
        ValueError: if it has no end, or is the robot's own volume.
    """
    if target.name == OWN:
        raise ValueError(f"found {OWN} alone, allowed: as a part of a Union, for example")
    if not target.bounded:
        raise ValueError(
            f"target {target.name} has no end; intersect its half-spaces with another volume"
        )
    return target


def key_text(name: str, radius: float | None) -> str:
    """Return the key of a target as text: ``V_S(0.5)`` or ``V_OT``."""
    return name if radius is None else f"{name}({radius:g})"


def named_kinds() -> tuple[str, ...]:
    """Return the names of the named volumes that may be targets."""
    return tuple(kind for kind, cls in KINDS.items() if not cls.own and kind != OWN)


def name_faults(name: str) -> Iterator[Fault]:
    """Yield the fault of a name that a target of one's own may not have."""
    taken = (*named_kinds(), OWN)
    if not re.fullmatch(r"\w[\w .-]*", name) or name in taken:
        allowed = f"letters, digits, spaces, _, - and ., but none of {', '.join(taken)}"
        yield ("name",), name, f"{allowed}, because the target has a volume of its own"
