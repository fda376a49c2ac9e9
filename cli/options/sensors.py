"""Sensors on the command line: a model of the catalogue, its light and its target."""

from ..._catalogue import sensors
from ...coverage.sensors.effective_range import size_of
from ...coverage.sensors.sensor import Sensor, Use
from ...formats.errors import UserError


def resolve_sensor(
    name: str | None,
    ambient: str | None,
    reflectance: float | None,
    size: str | None,
    own: Sensor | None = None,
) -> Sensor | None:
    """What ``--sensor`` and what goes with it mean; None where nothing is asked. The others alone
    are about ``own``, the scene's sensor, if that is one of the catalogue."""
    given = {"--ambient": ambient, "--reflectance": reflectance, "--target-size": size}
    asked = {option: value for option, value in given.items() if value is not None}
    if name is None and not asked:
        return None
    base = own.use if name is None and own is not None else None
    if name is None and base is None:
        option, value = next(iter(asked.items()))
        raise UserError(
            f"{option}: found {value}, allowed: only with --sensor, or a scene whose sensor names"
            " its model"
        )
    use = base or Use(str(name))
    try:
        target_size = use.size if size is None else size_of(size)
    except ValueError as error:
        raise UserError(f"--sensor {use.model}: {error}") from error
    return sensors.under(
        use.model,
        ambient=use.ambient if ambient is None else ambient,
        reflectance=use.reflectance if reflectance is None else reflectance,
        target_size=target_size,
    )
