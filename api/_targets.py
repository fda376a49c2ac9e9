"""Target volumes: what the sensors should cover. All exclude the robot's own volume V_R and the
obstacles of the scene.
"""

import math
from dataclasses import dataclass, field

from ._arguments import number
from ._errors import InputError, input_errors
from .coverage.targets import Target
from .objectives.scene import Goal


@dataclass(frozen=True, kw_only=True)
class TargetVolume:
    """What all target volumes have in common; make one of the classes below.

    weight: relative weight in the mean over the targets, 0 or more. at_least_percent: coverage in
    percent that a search shall keep as a floor; 0 for none.

    Raises:
        InputError: for a weight or a floor out of range.
    """

    weight: float = 1.0
    at_least_percent: float = 0.0
    symbol: str = field(init=False, default="", repr=False)

    def __post_init__(self) -> None:
        for name, value, most in (
            ("weight", self.weight, 1e6),
            ("at_least_percent", self.at_least_percent, 100.0),
        ):
            number(name, value, f"0 to {most:g}")
            if not (math.isfinite(value) and 0 <= value <= most):
                raise InputError(f"found {value:g}, allowed: 0 to {most:g}", name)

    @property
    def target(self) -> Target:
        """The target volume by the name that files and commands use."""
        return Target(self.symbol)

    @property
    def goal(self) -> Goal:
        """The volume with its weight and its floor."""
        return Goal(self.target, self.weight, self.at_least_percent / 100)


@dataclass(frozen=True)
class Shell(TargetVolume):
    """V_S: all that lies within ``radius`` m of the pose curve, from the base to the TCP.

    Example:
        >>> import place_rings as pr
        >>> pr.Shell(0.5, weight=0.6).target
        Target(name='V_S', radius=0.5)
    """

    radius: float
    symbol: str = field(init=False, default="V_S", repr=False)

    @property
    def target(self) -> Target:
        """V_S of this radius."""
        with input_errors("radius"):
            return Target(self.symbol, float(self.radius))

    def __post_init__(self) -> None:
        super().__post_init__()
        self.target  # noqa: B018  (a bad radius is refused here)


@dataclass(frozen=True)
class ReachSphere(TargetVolume):
    """V_O: the sphere of the robot's reach about its base.

    Example:
        >>> import place_rings as pr
        >>> pr.ReachSphere().target.name
        'V_O'
    """

    symbol: str = field(init=False, default="V_O", repr=False)


@dataclass(frozen=True)
class ToolSphere(TargetVolume):
    """V_T: the sphere of one sensor range (1.5 m) about the TCP.

    Example:
        >>> import place_rings as pr
        >>> pr.ToolSphere(weight=2).weight
        2
    """

    symbol: str = field(init=False, default="V_T", repr=False)


@dataclass(frozen=True)
class ReachAndToolSpheres(TargetVolume):
    """V_OT: the union of the sphere of the robot's reach and that about the TCP.

    Example:
        >>> import place_rings as pr
        >>> pr.ReachAndToolSpheres(at_least_percent=40).goal.at_least
        0.4
    """

    symbol: str = field(init=False, default="V_OT", repr=False)


@dataclass(frozen=True)
class ProtectiveVolume(TargetVolume):
    """V_P: all that is nearer to a link than its separation distance, which follows from the
    scene's ``safety`` and the speeds of its poses. No safety rating follows.

    Example:
        >>> import place_rings as pr
        >>> pr.ProtectiveVolume().target.name
        'V_P'
    """

    symbol: str = field(init=False, default="V_P", repr=False)


_CLASSES: dict[str, type[TargetVolume]] = {
    one.symbol: one for one in (ReachSphere, ToolSphere, ReachAndToolSpheres, ProtectiveVolume)
}


def volume_of(goal: Goal) -> TargetVolume:
    """The target volume that a goal stands for."""
    percent = round(100 * goal.at_least, 9)
    if goal.target.radius is not None:
        return Shell(goal.target.radius, weight=goal.weight, at_least_percent=percent)
    return _CLASSES[goal.target.name](weight=goal.weight, at_least_percent=percent)
