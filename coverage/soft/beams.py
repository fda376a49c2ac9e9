"""Beams with or without occlusion, and the classes that evaluate them for the soft estimator."""

from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp

from ..occlusion.occlusion_mode import Occlusion
from ..solids.capsules import Capsules
from ..solids.cones import Cones
from ..solids.polyhedra import Polyhedron
from ..solids.sensor_beams import MixedBeams, SpecialBeams
from .cones import SoftBeams
from .first_return import soft_stop
from .obstacle_occlusion import CellBeams
from .pyramids import SquareBeams
from .robot_occlusion import HiddenBeams
from .special_beams import SpecialSoftBeams


@partial(
    jax.tree_util.register_dataclass, data_fields=("cones", "bodies"), meta_fields=("occlusion",)
)
@dataclass(frozen=True)
class Hidden:
    """Beams and the bodies that occlude them at the same pose."""

    cones: Cones
    """Cones or mixed beams."""
    bodies: Capsules
    """The robot's bodies, one axis of N capsules."""
    occlusion: Occlusion
    """The occlusion model, a compile-time constant."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class InCell:
    """Beams among obstacles, with or without occlusion by bodies."""

    seen: Cones | Hidden
    """Cones or mixed beams, or these with the robot's bodies."""
    obstacles: tuple[Polyhedron, ...]
    """The obstacles."""


Seen = Cones | Hidden | InCell


def soft_beams(seen: Seen) -> SoftBeams:
    """Return the soft estimator's beams for cones or mixed beams, with or without occlusion.

    Under ``blind``, obstacles blind single-zone sensors, as the robot's bodies do, and cast shadows
    for the others only.
    """
    if isinstance(seen, Hidden):
        return _hidden(seen, ())
    if not isinstance(seen, InCell):
        return _free(seen)
    hidden = seen.seen if isinstance(seen.seen, Hidden) else None
    cones = seen.seen.cones if isinstance(seen.seen, Hidden) else seen.seen
    dtype = cones.apex.dtype
    obstacles = jax.tree.map(
        lambda a: jnp.asarray(a, dtype if a.dtype.kind == "f" else None), seen.obstacles
    )
    if hidden is None or hidden.occlusion != "blind":
        return CellBeams(soft_beams(seen.seen), obstacles)
    inner = _hidden(hidden, obstacles)
    return CellBeams(inner, obstacles, cones.zoned) if isinstance(cones, MixedBeams) else inner


def _free(cones: Cones) -> SoftBeams:
    if isinstance(cones, SpecialBeams):
        return SpecialSoftBeams(cones)
    return SquareBeams(cones) if isinstance(cones, MixedBeams) else SoftBeams(cones)


def _hidden(hidden: Hidden, obstacles: tuple[Polyhedron, ...]) -> SoftBeams:
    """Return beams past bodies; under ``blind``, obstacles end them too."""
    stop = partial(soft_stop, bodies=hidden.bodies, obstacles=obstacles)
    blind = hidden.occlusion == "blind"
    return HiddenBeams(soft_beams(hidden.cones), hidden.bodies, stop if blind else None)
