"""Mass, centre of mass and inertia of printed rings with their boards and bolts, and the part of
them that the flange carries.

Plastic counts as solid, so that a ring with less infill is lighter. Cables, controllers, solder and
the link's own mass are not included.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import trimesh
from jaxtyping import Float, Int
from manifold3d import Manifold

from ...coverage.rings.ring import Ring, Setup
from ...coverage.robots.built_in import T_flange_tcp
from ...coverage.robots.robot import Robot
from ...objectives.scene import Scene
from .print_bed import build_ring
from .print_plan import MM, UnbuildableError

PLASTIC = 1270.0  # kg/m³, PETG
BOARD = 1850.0  # kg/m³, FR-4
STEEL = 7850.0  # kg/m³, of bolts and nuts
PARTS = 0.0007  # kg, sensor, plugs and other parts of a board: an estimate


@dataclass(frozen=True)
class MassProperties:
    """Mass properties of a rigid body in some frame."""

    mass: float
    """Mass, kg."""
    centre: Float[np.ndarray, " 3"]
    """Centre of mass, m."""
    inertia: Float[np.ndarray, "3 3"]
    """Inertia about the centre of mass, kg m²."""

    def moved(self, T: Float[np.ndarray, "4 4"]) -> "MassProperties":
        """Return them in the frame in which their own frame has the pose ``T`` (4, 4) m."""
        R = T[:3, :3]
        return MassProperties(self.mass, R @ self.centre + T[:3, 3], R @ self.inertia @ R.T)


NOTHING = MassProperties(0.0, np.zeros(3), np.zeros((3, 3)))


def joined(some: Sequence[MassProperties]) -> MassProperties:
    """Return the mass properties of several bodies of one frame as one (parallel axis theorem)."""
    mass = sum(one.mass for one in some)
    if mass == 0:
        return NOTHING
    centre = sum((one.mass * one.centre for one in some), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for one in some:
        r = one.centre - centre
        inertia += one.inertia + one.mass * (r @ r * np.eye(3) - np.outer(r, r))
    return MassProperties(float(mass), centre, inertia)


def of_mesh(
    vertices: Float[np.ndarray, "V 3"], faces: Int[np.ndarray, "T 3"], density: float
) -> MassProperties:
    """Return the mass properties of a solid within a closed surface.

    Args:
        vertices: corners, m.
        faces: indices of each triangle's corners, counterclockwise from outside.
        density: kg/m³.
    """
    body = trimesh.triangles.mass_properties(vertices[faces], density=density)
    return MassProperties(float(body.mass), body.center_mass, np.asarray(body.inertia))


def of_solid(solid: Manifold, density: float) -> MassProperties:
    """Return the mass properties of a solid in millimetres, in metres."""
    mesh = solid.to_mesh64()
    vertices = np.asarray(mesh.vert_properties, float)[:, :3] / MM
    return of_mesh(vertices, np.asarray(mesh.tri_verts, np.int64), density)


def ring_parts(scene: Scene, ring: Ring, number: int = 0) -> dict[str, MassProperties]:
    """Return the mass properties of a printed ring's ``plastic`` with its lids, ``boards`` and
    ``bolts`` in the frame of its mount, ``forward``'s; ``number`` is the ring's in its setup, which
    it is engraved with.

    Raises:
        UnbuildableError: if it cannot be printed, so that its body is not known.
    """
    plan, made = build_ring(scene, ring, number)
    boards = [of_solid(board, BOARD) for board in made.boards]
    parts = {
        "plastic": joined([of_solid(part, PLASTIC) for part in (*made.parts, *made.lids)]),
        "boards": joined([replace(one, mass=one.mass + PARTS) for one in boards]),
        "bolts": of_solid(made.bolts, STEEL),
    }
    T_ring_print = np.eye(4)
    T_ring_print[:3, :3] = plan.T_ring_print
    T_link_print = scene.robot.mount(ring.link).T_link_ring(ring.position) @ T_ring_print
    return {name: one.moved(T_link_print) for name, one in parts.items()}


@dataclass(frozen=True)
class RingMass:
    """Mass of one ring."""

    link: str
    """Link that carries it."""
    mass: float | None
    """Mass, kg; None if its body is not known."""
    reason: str
    """Why the body is not known."""
    at_flange: bool
    """Whether the flange carries it, so that it belongs to the controller's payload."""


@dataclass(frozen=True)
class Payload:
    """What the mounted rings add to the payload of a robot."""

    rings: tuple[RingMass, ...]
    """All rings of the setup, in order."""
    flange: MassProperties
    """Those at the flange whose bodies are known, in the flange's frame."""
    frame: str
    """Name of that frame: ``flange`` (its controller's, z out of the flange), or ``tcp``."""
    T_frame_tcp: Float[np.ndarray, "4 4"]
    """TCP of the scene's robot in that frame, m."""


def payload(scene: Scene, setup: Setup) -> Payload:
    """Return what the rings of a setup add to the payload of the scene's robot."""
    robot, last = scene.robot, len(scene.robot.chain) - 1
    frame, T = _frame(robot)
    rings, carried = list[RingMass](), list[MassProperties]()
    for number, ring in enumerate(setup.rings):
        at = robot.mount(ring.link).frame
        try:
            own = joined(list(ring_parts(scene, ring, number).values()))
        except UnbuildableError as error:
            rings.append(RingMass(ring.link, None, str(error), at >= last))
            continue
        rings.append(RingMass(ring.link, own.mass, "", at >= last))
        if at >= last:
            T_tcp_link = np.eye(4) if at > last else np.linalg.inv(robot.chain.origin[-1])
            carried.append(own.moved(T @ T_tcp_link))
    return Payload(tuple(rings), joined(carried), frame, T)


def _frame(robot: Robot) -> tuple[str, Float[np.ndarray, "4 4"]]:
    """Return the frame in which a payload is stated, and the TCP in it."""
    try:
        return "flange", T_flange_tcp(robot)
    except ValueError:
        return "tcp", np.eye(4)
