"""Unions, intersections and differences of targets, and the target of an internal goal."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, cast

from ._errors import InputError, input_errors
from ._own_targets import Box, Cylinder, HalfSpace, Implicit, Mesh, OwnTarget, Sphere
from ._targets import (
    Near,
    ProtectiveVolume,
    ReachAndToolSpheres,
    ReachSphere,
    RobotVolume,
    Shell,
    TargetVolume,
    ToolSphere,
)
from .coverage.volumes import (
    BallVolume,
    BoxVolume,
    CombinedVolume,
    Coordinates,
    CylinderVolume,
    FunctionVolume,
    HalfSpaceVolume,
    MeshVolume,
    NamedVolume,
    Rule,
    Volume,
)
from .objectives.scene import Goal


@dataclass(frozen=True)
class _Combination(OwnTarget):
    """Targets combined by a rule, which is the class's symbol."""

    of: Sequence[TargetVolume]
    """Two or more targets, named ones among them; their own weights, minima and names are not
    used."""

    @property
    def volume(self) -> Volume:
        """The combination without its weight and name."""
        parts = list(self.of) if isinstance(self.of, Iterable) else []
        for part in parts:
            if not isinstance(part, TargetVolume):
                raise InputError(f"found {part!r}, allowed: target volumes", "of")
        with input_errors("of"):
            volumes = tuple(part.volume for part in parts)
            return CombinedVolume(cast(Rule, type(self).symbol), volumes)


@dataclass(frozen=True)
class UnionOf(_Combination):
    """The union of two or more targets.

    Example:
        >>> import place_rings as pr
        >>> len(pr.UnionOf([pr.Box((1, 1, 1)), pr.Shell(0.5)]).of)
        2
    """

    symbol: str = field(init=False, default="union", repr=False)


@dataclass(frozen=True)
class DifferenceOf(_Combination):
    """The first of two or more targets less all others.

    Example:
        >>> import place_rings as pr
        >>> far = pr.DifferenceOf([pr.Shell(1.5), pr.Shell(0.5)], name="far")
    """

    symbol: str = field(init=False, default="difference", repr=False)


@dataclass(frozen=True)
class IntersectionOf(_Combination):
    """The intersection of two or more targets.

    Example:
        >>> import place_rings as pr
        >>> front = pr.IntersectionOf([pr.Shell(0.5), pr.HalfSpace((-1, 0, 0))], name="in front")
    """

    symbol: str = field(init=False, default="intersection", repr=False)


_NAMED: dict[str, type[TargetVolume]] = {
    one.symbol: one
    for one in (ReachSphere, ToolSphere, ReachAndToolSpheres, ProtectiveVolume, RobotVolume)
}
_ROUND = {one.symbol: one for one in (Shell, Near)}
_COMBINED = {one.symbol: one for one in (UnionOf, DifferenceOf, IntersectionOf)}


def volume_of(goal: Goal) -> TargetVolume:
    """Return the target volume of an internal goal."""
    keys: dict[str, Any] = {
        "weight": goal.weight,
        "at_least_percent": round(100 * goal.at_least, 9),
        "importance": goal.target.importance,
        "reachable": goal.target.reachable,
    }
    if goal.target.volume is None:
        return _made(goal.target.volumes[0], keys)
    return _made(goal.target.volume, keys | {"name": goal.target.name})


def _made(volume: Volume, keys: Mapping[str, Any]) -> TargetVolume:
    """Return the target with a volume; ``keys`` holds weight, minimum and name."""
    match volume:
        case NamedVolume(name, radius):
            return _NAMED[name](**keys) if radius is None else _ROUND[name](radius, **keys)
        case BoxVolume(size, centre, rpy):
            return Box(size, centre, _degrees(rpy), **keys)
        case CylinderVolume(length, height, centre, rpy):
            return Cylinder(length, height, centre, _degrees(rpy), **keys)
        case BallVolume(length, centre):
            return Sphere(length, centre, **keys)
        case HalfSpaceVolume(normal, point):
            return HalfSpace(normal, point, **keys)
        case MeshVolume(vertices, faces):
            return Mesh(vertices, faces, **keys)
        case FunctionVolume(function, box):
            return Implicit(function, box, **keys)
        case CombinedVolume(rule, of):
            return _COMBINED[rule](tuple(_made(part, {}) for part in of), **keys)
    raise TypeError(f"no target of kind {type(volume).__name__}")


def _degrees(rpy: Coordinates) -> Coordinates:
    x, y, z = (round(math.degrees(angle), 9) + 0.0 for angle in rpy)
    return x, y, z
