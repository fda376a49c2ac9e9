"""Targets of one's own in words."""

from ...coverage.targets import Target
from ...coverage.volumes import (
    BallVolume,
    BoxVolume,
    CombinedVolume,
    CylinderVolume,
    HalfSpaceVolume,
    MeshVolume,
    NamedVolume,
    Volume,
)
from ..text import listed


def described(target: Target) -> str:
    """Return what a target is made of, such as ``a box less (a cylinder)``."""
    return _of(target.volumes[0])


def _of(volume: Volume) -> str:
    match volume:
        case BoxVolume(size):
            return f"a box of {' by '.join(f'{side:g}' for side in size)} m"
        case CylinderVolume(radius, height):
            return f"a cylinder of radius {radius:g} m and height {height:g} m"
        case BallVolume(radius):
            return f"a sphere of radius {radius:g} m"
        case MeshVolume(_, faces):
            return f"a closed mesh of {len(faces)} triangles"
        case HalfSpaceVolume():
            return "a half-space"
        case NamedVolume(name, radius):
            return name if radius is None else f"{name}({radius:g})"
        case CombinedVolume("difference", of):
            return f"{_of(of[0])} less {listed([_of(v) for v in of[1:]])}"
        case CombinedVolume(rule, of):
            return f"the {rule} of {listed([_of(v) for v in of])}"
        case _:
            return "a volume by a function"
