"""What a search may choose from and how long it may take, from the options."""

import math

from ...formats.errors import UserError
from ...objectives.scene import Rules, Scene
from ...placement.search.design import Space
from ...placement.search.layout import ring_layout

RINGS_PER_LINK = 2
SENSORS_PER_RING = 16  # where neither the command nor a scene's rule says more


def resolve_time(seconds: float | None) -> float:
    """``--time`` as a cap, infinity where none is given."""
    if seconds is not None and not 0 < seconds < math.inf:
        raise UserError(f"--time: found {seconds:g}, allowed: a positive number of seconds")
    return math.inf if seconds is None else seconds


def resolve_reach(reach: float | None, sensors: int | None) -> float | None:
    """``--reach`` as a share; UserError where it is none, or where the number of sensors is given
    too.
    """
    if reach is None:
        return None
    if not 0 < reach < 100:
        raise UserError(f"--reach: found {reach:g}, allowed: percent, above 0 and below 100")
    if sensors is not None:
        raise UserError(
            f"--reach: found {reach:g} with --sensors {sensors}, allowed: only one of them"
        )
    return reach / 100


def resolve_space(
    scene: Scene,
    rings_per_link: int | None,
    sensors_per_ring: int | None,
    sensors: int | None,
    free: bool = False,
) -> Space | None:
    """The setups that a search may choose from; None where also the number of sensors is ``free``.

    Raises:
        InfeasibleError: where the rules leave none.
        UserError: where the rings asked for have more sensors than a scene's rule allows, or fewer,
            or are asked for beside
            free ones.
    """
    if sensors is not None or free:
        for option, rule, given in (
            ("--rings-per-link", "rings_per_link", rings_per_link),
            ("--sensors-per-ring", "sensors_per_ring", sensors_per_ring),
        ):
            if given is not None:
                beside = "--reach" if free else f"--sensors {sensors}"
                raise UserError(
                    f"{option}: found {given} with {beside}, allowed: one of the two; rings are"
                    f" free there, within rules.{rule} of a scene"
                )
        return None if free else Space(scene, sensors=sensors)
    least, most = scene.rules.sensors
    asked = (
        min(max(SENSORS_PER_RING, least), most) if sensors_per_ring is None else sensors_per_ring
    )
    if not least <= asked <= most and (least, most) != Rules().sensors:
        raise UserError(
            f"--sensors-per-ring: found {asked}, allowed: {least} to {most}, the scene's"
            " rules.sensors_per_ring"
        )
    return Space(scene, ring_layout(scene, rings_per_link or RINGS_PER_LINK, asked))
