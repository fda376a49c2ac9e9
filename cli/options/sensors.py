"""Sensors on the command line: a model of the catalogue or of a file, its light, its target."""

from pathlib import Path

from place_rings._catalogue import sensors

from ...coverage.definitions.errors import UserError
from ...coverage.sensors.catalogue import MODELS
from ...coverage.sensors.effective_range import Use, size_of
from ...coverage.sensors.sensor import Sensor, effective
from ...formats.model_reader import read_sensor


def resolve_sensor(
    name: str | None,
    ambient: str | None,
    reflectance: float | None,
    size: str | None,
    own: Sensor | None = None,
) -> Sensor | None:
    """Return the sensor of ``--sensor`` under the given conditions, or None if none is given.

    Args:
        name: model in the catalogue, or a sensor file (.toml).
        ambient: ambient light.
        reflectance: reflectance of the target.
        size: size of the target, WIDTHxHEIGHT in metres.
        own: the scene's sensor, to which conditions apply without ``--sensor``.

    Raises:
        UserError: for an invalid sensor file, or conditions for a sensor without a model.
    """
    given = {"--ambient": ambient, "--reflectance": reflectance, "--target-size": size}
    stated = {option: value for option, value in given.items() if value is not None}
    if name is None and not stated:
        return None
    base = own.use if name is None and own is not None else None
    if name is None and base is None:
        option, value = next(iter(stated.items()))
        raise UserError(
            f"{option} {value}: allowed only for a sensor of the catalogue or of a sensor file; add"
            " --sensor, or set model in [sensor] of the scene"
        )
    use = base or _use_of(str(name))
    try:
        target_size = use.target_size if size is None else size_of(size)
    except ValueError as error:
        raise UserError(f"--sensor {use.name}: {error}") from error
    return sensors.under(
        effective(use).sensor,
        ambient=use.ambient if ambient is None else ambient,
        reflectance=use.reflectance if reflectance is None else reflectance,
        target_size=target_size,
    )


def _use_of(name: str) -> Use:
    if name.lower().endswith(".toml"):
        return Use(read_sensor(Path(name)))
    if name not in MODELS:
        raise UserError(f"--sensor: found {name}, allowed: {', '.join(MODELS)}")
    return Use(name)
