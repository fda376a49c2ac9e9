"""The named target volumes, which move with the robot. All exclude the robot's own volume V_R, or
its bodies, and the scene's obstacles.
"""

from typing import Any

from ..definitions.definition import definition
from ..definitions.field_types import Metres
from ..solids.base import Solid, Union
from .posed_robot import PosedRobot
from .target import KINDS, OWN, WITH_RADIUS, Target, key_text, named_kinds


class _Named(Target):
    """Common base of the named volumes."""

    own = False

    def described(self) -> str:
        return key_text(self.kind, getattr(self, "radius", None))


@definition
class ReachSphere(_Named):
    """V_O: the sphere around the robot's base with the radius of its reach.

    Example:
        >>> import place_rings as pr
        >>> pr.ReachSphere().name
        'V_O'
    """

    kind = "V_O"

    def solid(self, place: PosedRobot) -> Solid:
        return place.reach_sphere()


@definition
class ToolSphere(_Named):
    """V_T: the sphere around the TCP with a radius of 1.5 m, the range of the paper's sensor.

    Example:
        >>> import place_rings as pr
        >>> pr.ToolSphere(weight=2).weight
        2.0
    """

    kind = "V_T"

    def solid(self, place: PosedRobot) -> Solid:
        return place.tool_sphere()


@definition
class ReachAndToolSpheres(_Named):
    """V_OT: the union of V_O and V_T.

    Example:
        >>> import place_rings as pr
        >>> pr.ReachAndToolSpheres(at_least_percent=40).at_least
        0.4
    """

    kind = "V_OT"

    def solid(self, place: PosedRobot) -> Solid:
        return Union(place.reach_sphere(), place.tool_sphere())


@definition
class Shell(_Named):
    """V_S: the paper's shell, discs of ``radius`` across the pose curve from the base to the TCP.

    It is cut flat at both ends: most of the space ahead of the tool does not belong to it. Its
    radius must be larger than that of V_R (0.15 m).

    Raises:
        InputError: for a radius that is not positive.

    Example:
        >>> import place_rings as pr
        >>> str(pr.Shell(0.5, weight=0.6))
        'V_S(0.5)'
    """

    kind = "V_S"

    radius: Metres
    """Radius of the discs, m."""

    def solid(self, place: PosedRobot) -> Solid:
        return place.tube(self.radius)


@definition
class Near(_Named):
    """V_N: all points within ``radius`` of the robot's bodies, also ahead of the tool.

    The bodies are the capsules of its links and what is attached to it, such as a gripper; mounted
    rings are none. The bodies are excluded, V_R is not.

    Raises:
        InputError: for a radius that is not positive.

    Example:
        >>> import place_rings as pr
        >>> str(pr.Near(0.3, weight=0.6))
        'V_N(0.3)'
    """

    kind = "V_N"

    radius: Metres
    """Distance from the robot's bodies, m."""

    def solid(self, place: PosedRobot) -> Solid:
        return place.near(self.radius)


@definition
class ProtectiveVolume(_Named):
    """V_P: all points closer to a link than its separation distance.

    The distance follows from the scene's ``safety`` and the speeds of its poses, by ISO
    10218-2:2025 (form of ISO/TS 15066).
    It confers no safety rating.

    Example:
        >>> import place_rings as pr
        >>> pr.ProtectiveVolume().name
        'V_P'
    """

    kind = "V_P"

    def solid(self, place: PosedRobot) -> Solid:
        return place.protective[0]


@definition
class RobotVolume(_Named):
    """V_R: the robot's own volume. It is no target, but may be a part of one.

    Example:
        >>> import place_rings as pr
        >>> around = pr.UnionOf([pr.Box((1, 1, 1)), pr.RobotVolume()])
    """

    kind = OWN

    def solid(self, place: PosedRobot) -> Solid:
        return place.tube(place.shape.robot_radius)


def named_target(name: str, radius: float | None = None, **keys: Any) -> Target:
    """Return the named volume of a name, and of a radius in m if it has one.

    Raises:
        ValueError: if the name is unknown, or a radius is missing, not allowed or not positive.
    """
    names = named_kinds()
    if name not in names:
        raise ValueError(f"unknown target {name!r}; known: {', '.join(names)}")
    if (radius is None) == (name in WITH_RADIUS):
        need = "needs a radius in metres" if name in WITH_RADIUS else "takes no radius"
        raise ValueError(f"target {name} {need}")
    return KINDS[name](**keys if radius is None else {"radius": radius, **keys})
