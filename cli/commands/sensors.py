"""The command sensors."""

from typing import Annotated

from cyclopts import Parameter

from ..options.common import Json
from ..options.detection import NO_DETECTION, DetectionOptions


def sensors(
    sensor: Annotated[
        str | None,
        Parameter(help="Sensor of the catalogue, or sensor file (.toml) to check. Default: all."),
    ] = None,
    /,
    *,
    ambient: Annotated[
        str | None, Parameter(help="Ambient light on the sensors, with --detect, such as 5klx.")
    ] = None,
    reflectance: Annotated[
        float | None,
        Parameter(help="Reflectance of the test piece, above 0 up to 1. Default: its own."),
    ] = None,
    detection: DetectionOptions = NO_DETECTION,
    as_json: Json = False,
) -> None:
    """List the sensor catalogue: beam, zones, ranges by light and target, rates, and their sources.

    With ``--detect`` it states how far each sensor detects a test piece, and what that rests on.

    For example:

    ```bash
    place-rings sensors
    place-rings sensors mine.toml
    place-rings sensors vl53l5cx --detect hand --ambient 5klx
    place-rings verify n2_16_25 --sensor vl53l1x --ambient 50kcps
    ```

    ``place-rings --help`` explains the terms.
    """
    from ..options.groups import SensorOptions
    from ..runs.sensors import detected, sensors, uses_of

    conditions = SensorOptions(ambient=ambient, reflectance=reflectance)
    question = detection.resolve(conditions)
    uses = uses_of(sensor)
    if question is not None:
        detected(uses, question, as_json)
        return
    conditions.refuse_alone()
    sensors(uses, as_json, sensor is None)
