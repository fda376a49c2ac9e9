"""How an upright test piece stands in the beams of sensors.

The piece is a cylinder about the vertical. A sensor that looks level sees its width and height, and
one above it its round end. A beam may meet it anywhere along its height, so place, distance and
line of sight are taken at the part of its axis that is nearest to the axis of the beam.
"""

from typing import Any, NamedTuple

import numpy as np

from ..arrays import Numbers, namespace, root
from ..solids.beams import NIL, InBeam, Place
from .detectors import Detectors

SLANT = 0.05
"""How much a metre of depth counts beside one across the axis, for the part of a piece nearest to
it."""


class Extent(NamedTuple):
    """Size of a test piece, m; numbers, or arrays that broadcast against the places."""

    width: Numbers
    """Width."""
    height: Numbers
    """Height."""


class Vertical(NamedTuple):
    """The unit vector upwards in the frames of beams; numbers, or arrays that broadcast."""

    along: Any
    """Along the axis."""
    across: Any
    """Along ``up x axis``."""
    up: Any
    """Along ``up``."""


LEVEL = Vertical(np.array(0.0), np.array(0.0), np.array(1.0))
"""The vertical of a sensor that looks straight ahead."""


class Side(NamedTuple):
    """A piece in one direction of a beam's section; the silhouette is a rectangle in both."""

    centre: Any
    """Its centre, m."""
    half: Any
    """Half of its length, m."""
    edge: Any
    """The beam reaches from -edge to edge, as a tangent."""
    zones: Any
    """Number of zones in a row."""


class Aspect(NamedTuple):
    """How an upright piece stands in beams, about the part of its axis nearest to the beam's."""

    step: Any
    """From its centre up to that part, m."""
    part: InBeam
    """Place of that part; in the frame of a round beam that is turned with the piece."""
    cross: Side
    """Across the piece."""
    strip: Side
    """Along the piece."""
    lengthwise: Any
    """Distance of that part from the axis of the beam, along the piece, m; ``cross.centre`` is that
    across it."""
    sine: Any
    """Sine of the angle between the piece and the axis of the beam: its length in the section."""
    steep: Any
    """Component of the vertical in the direction along the piece; of a beam that is turned with it
    as large as ``sine``."""
    clear: Any
    """Function of the place that is negative where the sensor is inside the piece, m."""


def zone_centre(x: Any, edge: Any, zones: Any) -> Any:
    """Return the centre of the zone that holds a place, or of the nearest one, of equal zones in a
    row.

    Args:
        x: the place.
        edge: the row reaches from -edge to edge.
        zones: number of zones.
    """
    xp = namespace(x)
    width = 2 * edge / zones
    return (xp.clip(xp.floor((x + edge) / width), 0, zones - 1) + 0.5) * width - edge


def step_to_axis(at: Place, up: Vertical) -> tuple[Any, Any]:
    """Return how far up from the centre of an endless piece the part lies that is nearest to the
    axis of the beam, m, and by how much that changes at most with the place.

    Depth counts as well, by ``SLANT``: so it is the nearest part of a piece along the axis.
    """
    lateral, slant = up.across * up.across + up.up * up.up, SLANT * SLANT
    length = lateral + slant * up.along * up.along
    step = -(at.across * up.across + at.up * up.up + slant * at.along * up.along) / length
    return step, root(lateral + (slant * up.along) ** 2) / length


def aspect(at: Place, up: Vertical, of: Detectors, piece: Extent) -> Aspect:
    """Return how an upright piece stands in beams.

    A round beam counts as a square as large, turned with the piece. In another beam the piece is
    turned to the nearer of both directions; where it crosses narrow zones at an angle, it is wider
    by the cosine.

    Args:
        at: place of its centre in the frames of the beams, m.
        up: the vertical there.
        of: the sensors.
        piece: its size.
    """
    xp = namespace(at.along)
    radius, half = piece.width / 2, piece.height / 2
    step = xp.clip(step_to_axis(at, up)[0], -half, half)
    sine = root(up.across * up.across + up.up * up.up)
    turned = of.round & of.flat & (sine > NIL)
    cos, sin = (xp.where(turned, v / xp.maximum(sine, NIL), w) for v, w in
                ((up.up, 1.0), (up.across, 0.0)))  # fmt: skip
    x, y = at.across * cos - at.up * sin, at.across * sin + at.up * cos
    gx, gy = up.across * cos - up.up * sin, up.across * sin + up.up * cos
    part = InBeam(at.along + step * up.along, x + step * gx, y + step * gy)
    upright = abs(gy) >= abs(gx)
    steep = xp.where(upright, gy, gx)  # the component along the piece's direction
    aside, lengthwise = (
        xp.where(upright, a, b) for a, b in ((part.across, part.up), (part.up, part.across))
    )
    edges, zones = (
        [xp.where(upright, v[..., i], v[..., 1 - i]) for i in (0, 1)] for v in (of.edge, of.zones)
    )
    wider = xp.where((zones[0] > 1) & (sine > NIL), sine / xp.maximum(abs(steep), NIL), 1.0)
    middle = lengthwise - xp.where(steep < 0, -1.0, 1.0) * sine * step
    cross = Side(aside, radius * wider, edges[0], zones[0])
    strip = Side(middle, half * sine + radius * abs(up.along), edges[1], zones[1])
    clear = beyond_surface(at, up, piece)
    return Aspect(step, part, cross, strip, lengthwise, sine, steep, clear)


def beyond_surface(at: Place, up: Vertical, piece: Extent) -> Any:
    """Return a 1-Lipschitz function of the place of a piece that is negative where the sensor is
    inside it, m."""
    xp = namespace(at.along)
    height = at.along * up.along + at.across * up.across + at.up * up.up
    level = root(at.away * at.away - height * height)
    return xp.maximum(abs(height) - piece.height / 2, level - piece.width / 2)


def nearest(a: Aspect, piece: Extent) -> Any:
    """Return the distance of a piece's surface from the apex, m, where its axis comes nearest to
    that of the beam; 0 where the surface lies behind the apex.

    The front is nearest in the middle of the best zone; its depth is that of a parabola.
    """
    xp = namespace(a.part.along)
    depth = xp.maximum(a.part.along, NIL)
    aside = a.cross.centre
    middle = zone_centre(aside / depth, a.cross.edge, a.cross.zones) * depth
    beside = xp.maximum(abs(aside) - piece.width / 2, 0.0)
    front = xp.maximum(a.part.along - bulge(aside - middle, a.sine, piece), 0.0)
    return root(beside * beside + a.lengthwise * a.lengthwise + front * front)


def bulge(aside: Any, sine: Any, piece: Extent) -> Any:
    """Return by how much the front of a piece is nearer than its axis, ``aside`` of it, m."""
    radius = piece.width / 2
    return radius * sine * namespace(aside).maximum(1 - (aside / radius) ** 2, 0.0)
