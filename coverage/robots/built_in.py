"""The built-in robots, by name: every robot that a file of the library states."""

import pkgutil
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import fields, replace
from functools import cache
from importlib import import_module

import numpy as np
from jaxtyping import Float

from . import library
from .calibration import DhTable, dh_table, dh_table_of, measured_axes, tool_pose, with_kinematics
from .kinematics import Chain
from .library.ur10 import UR10, UR10_DH
from .robot import Robot

__all__ = ["PAPER_ROBOTS", "ROBOTS", "UR10", "UR10_DH", "built_in", "robot"]

PAPER_ROBOTS = ("ur10", "ur10_dh")  # two possible readings of the paper's UR10


def _library() -> Iterator[Robot]:
    """Yield the robots of the library, the paper's first."""
    yield from (UR10, UR10_DH)
    for module in sorted((m.name for m in pkgutil.iter_modules(library.__path__)), reverse=True):
        names = vars(import_module(f"{library.__name__}.{module}"))
        yield from (value for value in names.values() if isinstance(value, Robot))


ROBOTS = {robot.name: robot for robot in _library()}


def robot(name: str) -> Robot:
    """Return the built-in robot ``name``; raise a ``ValueError`` that lists the known names."""
    if name not in ROBOTS:
        raise ValueError(f"unknown robot {name!r}; known: {', '.join(ROBOTS)}")
    return ROBOTS[name]


def built_in(arm: Robot) -> bool:
    """Return whether this object is a built-in robot, with either description of its links in use,
    so that its name identifies it."""
    known = ROBOTS.get(arm.name)
    if known is None:
        return False
    names = [field.name for field in fields(known)]
    return any(
        all(getattr(arm, name) is getattr(described, name) for name in names)
        for described in (known, known.with_links(True), known.with_links(False))
    )


def calibrated_chain(chain: Chain, measured: Float[np.ndarray, "7 4 4"]) -> Chain:
    """Return a chain with the joint axes and the flange that its controller states.

    A tool beyond the flange stays as it is. Where the flange is, the built-in model of the same
    lengths says; without one, it is at the TCP.

    Args:
        chain: the model's chain.
        measured: as in ``with_kinematics``.

    Raises:
        ValueError: if the chain is no arm of Universal Robots, or differs too much.
    """
    return with_kinematics(chain, measured, _flange(chain))


def controller_table(robot: Robot) -> DhTable:
    """Return the Denavit-Hartenberg table that the controller of a robot states, with the robot's
    calibration if it has one.

    Raises:
        ValueError: if the robot is no arm of Universal Robots.
    """
    model = robot.nominal.chain
    flange = _flange(model)
    table = dh_table(model)
    table = replace(table, d=np.array([*table.d[:5], flange]))
    if robot.calibration is None:
        return table
    return dh_table_of(measured_axes(robot.chain, model, flange), table)


def T_flange_tcp(robot: Robot) -> Float[np.ndarray, "4 4"]:
    """Return the TCP of an arm of Universal Robots in its controller's flange frame (4, 4) m, whose
    z axis points out of the flange.

    Raises:
        ValueError: if the robot is none of them.
    """
    chain = robot.nominal.chain
    return tool_pose(chain, _flange(chain))


def _flange(chain: Chain) -> float:
    """Return the distance of the flange from the axis of joint 4, m."""
    table = dh_table(chain)
    for known in _known_tables():
        if np.allclose([*known.a, *known.d[:5]], [*table.a, *table.d[:5]], rtol=0, atol=1e-4):
            return float(known.d[5])
    return float(table.d[5])


@cache
def _known_tables() -> tuple[DhTable, ...]:
    """Return the tables of the built-in arms of Universal Robots."""
    tables = []
    for known in ROBOTS.values():
        with suppress(ValueError):
            tables.append(dh_table(known.chain))
    return tuple(tables)
