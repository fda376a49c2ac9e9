"""Bodies of mounted rings: their envelopes as meshes, and their mass properties where a ring can be
printed."""

import io
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from ...coverage.rings.ring_envelope import Envelope
from ...objectives.feasibility.ring_envelopes import envelope
from ..printing.payload import MassProperties, joined, ring_parts
from ..printing.print_plan import UnbuildableError
from .placed import PlacedSetup

_SIDES = 32


@dataclass(frozen=True)
class RingBody:
    """A mounted ring as a body of its own, fixed to a link."""

    name: str
    """Name such as ``ring_0``."""
    frame: int
    """Index of the link's frame among those of ``forward``."""
    joint: int
    """Joint whose link carries it."""
    T_link_ring: Float[np.ndarray, "4 4"]
    """Pose in the frame of that joint, m: z along the mount axis, x to the sensor of phase 0."""
    envelope: Envelope
    """The solid that the ring occupies, about z."""
    mass: MassProperties | None
    """Mass properties in the ring's frame; None if the ring cannot be printed."""

    @property
    def file(self) -> str:
        """Name of the file of its mesh."""
        return f"{self.name}.stl"

    def stl(self) -> bytes:
        """Return its collision mesh in the ring's frame, m. It contains the envelope."""
        data = io.BytesIO()
        envelope_mesh(self.envelope, 1 / math.cos(math.pi / _SIDES)).export(data, file_type="stl")
        return data.getvalue()


def ring_bodies(placed: PlacedSetup) -> tuple[RingBody, ...]:
    """Return the bodies of all rings; none where the scene's mounts are free."""
    robot, made = placed.scene.robot, list[RingBody]()
    for i, ring in enumerate(placed.setup.rings if placed.scene.real else ()):
        mount = robot.mount(ring.link)
        T_frame_ring = mount.T_link_ring(ring.position)
        try:
            parts = joined(list(ring_parts(placed.scene, ring, i).values()))
            mass = parts.moved(np.linalg.inv(T_frame_ring))
        except UnbuildableError:
            mass = None
        joint, T = placed.in_link(mount.frame, T_frame_ring)
        solid = envelope(placed.scene, ring)
        made.append(RingBody(f"ring_{i}", mount.frame, joint, T, solid, mass))
    return tuple(made)


def envelope_mesh(around: Envelope, grown: float = 1.0) -> Any:
    """Return the bands of an envelope about z as one mesh, m.

    Args:
        around: the envelope.
        grown: factor of the outer radii, so that the flat sides of the mesh lie outside.
    """
    import trimesh  # slow to load

    solids = []
    for band in around.bands:
        tall, middle = band.high - band.low, (band.high + band.low) / 2
        solid = trimesh.creation.annulus(around.bore, grown * band.outer, tall, sections=_SIDES)
        solids.append(solid.apply_translation([0.0, 0.0, middle]))
    return trimesh.util.concatenate(solids)


def hull_mesh(body: Any) -> Any:
    """Return the convex hull of the edges of a polyhedron as a mesh, m."""
    import trimesh  # slow to load

    return trimesh.convex.convex_hull(np.asarray(body.edges).reshape(-1, 3))
