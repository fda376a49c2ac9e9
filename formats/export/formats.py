"""The formats of ``place-rings export``: of each, what makes its files."""

from collections.abc import Callable, Mapping

from .coppeliasim import coppeliasim
from .glb import glb
from .mjcf import mjcf
from .placed import PlacedSetup
from .ros2 import ros2
from .tables import csv, json
from .urdf import urdf
from .xacro import xacro

Files = Mapping[str, bytes]  # by their names in the folder


def _urdf(placed: PlacedSetup) -> Files:
    return urdf(placed) | xacro(placed)


def _stl(placed: PlacedSetup) -> Files:
    from ..printing.print_files import ring_files  # loads matplotlib and solids

    return ring_files(placed.setup, placed.scene)[1]


FORMATS: dict[str, Callable[[PlacedSetup], Files]] = {
    "urdf": _urdf,
    "mjcf": mjcf,
    "glb": glb,
    "csv": csv,
    "json": json,
    "coppeliasim": coppeliasim,
    "ros2": ros2,
    "stl": _stl,
}
