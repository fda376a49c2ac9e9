"""The command sensors."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ..options.common import Json


def sensors(
    file: Annotated[
        Path | None, Parameter(help="Sensor file (.toml) to check and list instead.")
    ] = None,
    /,
    *,
    as_json: Json = False,
) -> None:
    """List the sensor catalogue: beam, zones, ranges by light and target, rates, and their sources.

    For example:

    ```bash
    place-rings sensors
    place-rings sensors mine.toml
    place-rings verify n2_16_25 --sensor vl53l1x --ambient 50kcps
    ```

    ``place-rings --help`` explains the terms.
    """
    from ..runs.sensors import sensors as run

    run(as_json, file)
