"""Which joint, sensor or topic a name in a rig's file means."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from ...coverage.definitions.errors import UserError, shown
from ...coverage.rings.ring import Setup
from ...coverage.robots.robot import Robot

STEPS = "/place_rings/step"
_PAIR = re.compile(r"(?P<name>[^=]{1,200})=(?P<source>.{1,500})")
_RING, _SENSOR = "{ring}", "{sensor}"
_JOINT = "_joint"
_EVERY = f"tof_{_RING}_{_SENSOR}"


@dataclass(frozen=True)
class RigNames:
    """Names in the files of a rig."""

    joints: dict[str, int]
    """Index of the robot's joint by name."""
    sensors: dict[str, tuple[int, int]]
    """Ring and sensor by the name of the sensor's frame or topic, without a slash at its front."""
    steps: str
    """Topic of the check's steps."""

    def sensor(self, frame: str, topic: str) -> tuple[int, int] | None:
        """Return ring and sensor of a reading; None if it is of no sensor of the setup."""
        return self.sensors.get(_plain(frame)) or self.sensors.get(_plain(topic))


def rig_names(
    setup: Setup, robot: Robot, rings: Sequence[str], pairs: Sequence[str] = ()
) -> RigNames:
    """Return the names of a rig: those of the exported URDF, unless ``pairs`` state others.

    Args:
        setup: the rings.
        robot: whose joints are named as in its chain, with or without ``_joint``.
        rings: names of the rings and single sensors.
        pairs: texts NAME=SOURCE. NAME is a joint, a sensor such as ``tof_0_3``, a ring, for all of
            its sensors, ``tof_{ring}_{sensor}`` for all, or ``steps``; SOURCE is the name in the
            file, with ``{ring}`` and ``{sensor}`` for their numbers.

    Raises:
        UserError: if a text is no pair, names nothing of the rig, or two sensors have one source.
    """
    sources = {f"tof_{i}_{k}": f"tof_{i}_{k}" for i, k in setup.labels}
    joints, steps = dict(_joint_names(robot)), STEPS
    for text in pairs:
        match = _PAIR.fullmatch(text)
        if match is None:
            raise _refuse(text, "NAME=SOURCE, like tof_0_3=/left/range_3")
        name, source = match["name"], match["source"]
        some = _sensors(name, setup, rings)
        if some and len({_filled(source, at) for at in some}) == len(some):
            sources |= {f"tof_{i}_{k}": _filled(source, (i, k)) for i, k in some}
        elif some:
            raise _refuse(text, f"a source with {_SENSOR}, one name for each sensor")
        elif name in robot.chain.joints:
            index = robot.chain.joints.index(name)
            joints = {n: i for n, i in joints.items() if i != index} | {source: index}
        elif name == "steps":
            steps = source
        else:
            allowed = f"a joint ({', '.join(robot.chain.joints)}), a ring ({', '.join(rings)})"
            raise _refuse(text, f"{allowed}, a sensor like tof_0_3, {_EVERY}, or steps")
    sensors = {_plain(sources[f"tof_{i}_{k}"]): (i, k) for i, k in setup.labels}
    if len(sensors) < setup.sensors:
        raise UserError("--map: found one source for two sensors, wanted: one for each")
    return RigNames(joints, sensors, steps)


def _refuse(text: str, wanted: str) -> UserError:
    return UserError(f"--map: found {shown(text)}, wanted: {wanted}")


def _plain(name: str) -> str:
    return name.removeprefix("/")


def _filled(source: str, at: tuple[int, int]) -> str:
    return source.replace(_RING, str(at[0])).replace(_SENSOR, str(at[1]))


def _sensors(name: str, setup: Setup, rings: Sequence[str]) -> list[tuple[int, int]]:
    """Return the sensors that a name means."""
    return [(i, k) for i, k in setup.labels if name in (_EVERY, rings[i], f"tof_{i}_{k}")]


def _joint_names(robot: Robot) -> dict[str, int]:
    """Return the index of each joint by its name, with and without ``_joint``."""
    names = dict[str, int]()
    for i, name in enumerate(robot.chain.joints):
        for one in (name, name.removesuffix(_JOINT), name.removesuffix(_JOINT) + _JOINT):
            names.setdefault(one, i)
    return names
