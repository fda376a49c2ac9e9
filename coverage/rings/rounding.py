"""Setups in files: rounded to the precision of files, so that the verified setup is the written
one, and with what they take from their scene."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from ..definitions.definition import Fault, adapter
from ..definitions.units import OF_SCENE, as_in_file
from ..robots.robot import Robot
from ..sensors.sensor import Sensor, effective
from .ring import RING_RADIUS, Setup


def rounded(setup: Setup, sensor: Sensor) -> Setup:
    """Return the setup as it reads back from a proposal file of a scene with ``sensor``."""
    read = Setup(tuple(map(as_in_file, setup.rings)), setup.singles)
    return read.with_sensors(lambda own: sensor if own == sensor else _rounded(own))


def _rounded(sensor: Sensor) -> Sensor:
    """Return a sensor as it reads back: by its use if from the catalogue, else by its angles."""
    if sensor.use is not None:
        model = effective(sensor.use).sensor
        return replace(model, board=sensor.board or model.board)
    return as_in_file(sensor)


def of_scene(setup: Setup, sensor: Sensor) -> Setup:
    """Return the setup as a file of a scene with ``sensor`` states it, which is not repeated."""
    return setup.with_sensors(lambda own: OF_SCENE if own == sensor else own)


def table_of(setup: Setup, sensor: Sensor, lean: bool = False) -> dict[str, Any]:
    """Return the keys ``rings`` and ``sensors`` of ``of_scene``; ``lean`` leaves out keys without a
    value."""
    own = of_scene(setup, sensor)
    table: dict[str, Any] = adapter(Setup).dump_python(own, mode="json", exclude_none=lean)
    return table


def within_files(setup: Setup) -> None:
    """Check that files can state a setup, of which one in Python may be beyond the limits.

    Raises:
        ValidationError: otherwise.
    """
    adapter(Setup).validate_python(adapter(Setup).dump_python(setup))


def with_scene(setup: Setup, sensor: Sensor, radius: float = RING_RADIUS) -> Setup:
    """Return the setup of a file: what it does not state is that of the scene.

    Raises:
        ValueError: if the scene's sensor needs an ``up`` that a single sensor lacks.
    """
    rings = (replace(r, radius=radius) if r.radius is OF_SCENE else r for r in setup.rings)
    stated = Setup(tuple(rings), setup.singles)
    return stated.with_sensors(lambda own: sensor if own is OF_SCENE else own)


def setup_faults(
    setup: Setup, robot: Robot, sensor: Sensor, keys: tuple[str, str] = ("rings", "sensors")
) -> Iterator[Fault]:
    """Yield links that the robot lacks, and beams of the scene's sensor without their ``up``.

    Args:
        setup: the setup of a file.
        robot: the scene's robot.
        sensor: the scene's sensor.
        keys: keys of the rings and of the single sensors.
    """
    for i, ring in enumerate(setup.rings):
        if ring.link not in robot.links:
            allowed = f"a link of {robot.name}: {', '.join(robot.links)}"
            yield (keys[0], i, "link"), ring.link, allowed
    for i, one in enumerate(setup.singles):
        if one.link not in robot.frames:
            yield (keys[1], i, "link"), one.link, frames_text(robot)
        if one.sensor is OF_SCENE and one.up is None and sensor.oriented:
            allowed = "the direction of fov_up_deg, because the scene's sensor is not round"
            yield (keys[1], i, "up"), None, allowed


def frames_text(robot: Robot) -> str:
    """Return the links that may carry a single sensor."""
    return f"a link of {robot.name}: {', '.join(robot.frames)}"
