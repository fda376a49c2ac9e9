"""Target volumes, which the sensors should cover. All exclude the robot's own volume V_R, or its
bodies, and the scene's obstacles.
"""

import math
from dataclasses import dataclass, field

from ._arguments import number
from ._errors import InputError, input_errors
from .coverage.targets import Reachable, Target
from .coverage.volumes import NamedVolume, Volume
from .coverage.weight_field import WeightField
from .objectives.scene import Goal


@dataclass(frozen=True, kw_only=True)
class TargetVolume:
    """Common base of all target volumes; use one of its subclasses.

    Raises:
        InputError: for a weight or a minimum coverage out of range.
    """

    weight: float = 1.0
    """Relative weight in the mean over the targets, 0 or more."""
    at_least_percent: float = 0.0
    """Minimum coverage that a search must keep, percent; 0 for none."""
    importance: WeightField | None = field(default=None, repr=False)
    """How much each place matters, made by ``weight_field``; None: all the same."""
    reachable: Reachable = field(default=False, repr=False)
    """Whether only what is connected to the robot past the obstacles belongs to the target;
    ``"person"``: only what the scene's ``person`` can touch."""
    symbol: str = field(init=False, default="", repr=False)
    """Name of the volume in files and commands, such as ``V_S``."""

    def __post_init__(self) -> None:
        for name, value, most in (
            ("weight", self.weight, 1e6),
            ("at_least_percent", self.at_least_percent, 100.0),
        ):
            number(name, value, f"0 to {most:g}")
            if not (math.isfinite(value) and 0 <= value <= most):
                raise InputError(f"found {value:g}, allowed: 0 to {most:g}", name)
        if not isinstance(self.reachable, bool) and self.reachable != "person":
            raise InputError(f"found {self.reachable!r}, allowed: False, True, person", "reachable")
        if not isinstance(self.importance, WeightField | None):
            raise InputError(f"found {self.importance!r}, allowed: weight_field(...)", "importance")

    @property
    def target(self) -> Target:
        """The target volume under its name in files and commands."""
        return Target(self.symbol, None, None, self.importance, self.reachable)

    @property
    def volume(self) -> Volume:
        """The volume without its weight, as a part of others."""
        return NamedVolume(self.symbol)

    @property
    def goal(self) -> Goal:
        """The volume with its weight and its minimum coverage."""
        return Goal(self.target, self.weight, self.at_least_percent / 100)


@dataclass(frozen=True)
class _WithRadius(TargetVolume):
    """Common base of the named volumes with a radius."""

    radius: float
    """Radius, m."""

    @property
    def target(self) -> Target:
        """The volume under its name in files and commands."""
        with input_errors("radius"):
            return Target(self.symbol, float(self.radius), None, self.importance, self.reachable)

    @property
    def volume(self) -> Volume:
        """The volume without its weight, as a part of others."""
        return NamedVolume(self.symbol, self.target.radius)

    def __post_init__(self) -> None:
        super().__post_init__()
        number("radius", self.radius, "a positive number of metres")
        self.target  # noqa: B018  (raises for a bad radius)


@dataclass(frozen=True)
class Near(_WithRadius):
    """V_N: all points within ``radius`` of the robot's bodies, also ahead of the tool.

    The bodies are the capsules of its links and what is attached to it, such as a gripper; mounted
    rings are none. The bodies are excluded, V_R is not.

    Raises:
        InputError: for a radius that is not positive.

    Example:
        >>> import place_rings as pr
        >>> pr.Near(0.3, weight=0.6).target
        Target(name='V_N', radius=0.3)
    """

    symbol: str = field(init=False, default="V_N", repr=False)


@dataclass(frozen=True)
class Shell(_WithRadius):
    """V_S: the paper's shell, discs of ``radius`` across the pose curve from the base to the TCP.

    It is cut flat at both ends: most of the space ahead of the tool does not belong to it. Its
    radius must be larger than that of V_R (0.15 m).

    Raises:
        InputError: for a radius that is not positive.

    Example:
        >>> import place_rings as pr
        >>> pr.Shell(0.5, weight=0.6).target
        Target(name='V_S', radius=0.5)
    """

    symbol: str = field(init=False, default="V_S", repr=False)


@dataclass(frozen=True)
class ReachSphere(TargetVolume):
    """V_O: the sphere around the robot's base with the radius of its reach.

    Example:
        >>> import place_rings as pr
        >>> pr.ReachSphere().target.name
        'V_O'
    """

    symbol: str = field(init=False, default="V_O", repr=False)


@dataclass(frozen=True)
class ToolSphere(TargetVolume):
    """V_T: the sphere around the TCP with a radius of 1.5 m, the range of the paper's sensor.

    Example:
        >>> import place_rings as pr
        >>> pr.ToolSphere(weight=2).weight
        2
    """

    symbol: str = field(init=False, default="V_T", repr=False)


@dataclass(frozen=True)
class ReachAndToolSpheres(TargetVolume):
    """V_OT: the union of V_O and V_T.

    Example:
        >>> import place_rings as pr
        >>> pr.ReachAndToolSpheres(at_least_percent=40).goal.at_least
        0.4
    """

    symbol: str = field(init=False, default="V_OT", repr=False)


@dataclass(frozen=True)
class ProtectiveVolume(TargetVolume):
    """V_P: all points closer to a link than its separation distance.

    The distance follows from the scene's ``safety`` and the speeds of its poses, by ISO/TS 15066.
    It confers no safety rating.

    Example:
        >>> import place_rings as pr
        >>> pr.ProtectiveVolume().target.name
        'V_P'
    """

    symbol: str = field(init=False, default="V_P", repr=False)


@dataclass(frozen=True)
class RobotVolume(TargetVolume):
    """V_R: the robot's own volume. It is no target, but may be a part of one.

    Example:
        >>> import place_rings as pr
        >>> around = pr.UnionOf([pr.Box((1, 1, 1)), pr.RobotVolume()])
    """

    symbol: str = field(init=False, default="V_R", repr=False)

    @property
    def target(self) -> Target:
        """Not available: V_R is no target."""
        raise InputError("found V_R alone, allowed: as a part of a Union, for example", "targets")
