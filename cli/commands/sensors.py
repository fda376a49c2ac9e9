"""The command sensors."""

from ..options.common import Json


def sensors(*, as_json: Json = False) -> None:
    """Print the catalogue of sensors: beams, ranges by light and target, rates, and where each
    figure is from.

    Example: place-rings sensors
    """
    from ..runs.sensors import sensors as run

    run(as_json)
