"""Dimensions of a printed ring, derived from a ring of a setup before any solid is built.

All lengths are millimetres in the print frame: z points along the ring's axis, upwards when printed
and towards the side to which the beams lean. The lenses lie in the plane z = 0; x and y are rotated
so that the halves separate along y. ``T_ring_print`` rotates the print frame to the ring's frame.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from ...coverage.rings.clamp import Bolt, Clamp, clamp_of
from ...coverage.rings.ring import Ring
from ...coverage.robots.kinematics import rotation_rpy
from ...coverage.robots.ring_section import surrounded
from ...coverage.sensors.board_packing import Pocket, Printing
from ...coverage.sensors.boards import Board
from ...coverage.sensors.lids import lid_fault
from ...objectives.feasibility.board_fit import unfit
from ...objectives.scene import Scene

MM = 1000.0  # millimetres in a metre
_BODILESS = 'rings have no bodies in its scene: search without --paper and rules.mount = "free"'
_BESIDE = 0.001  # m, largest distance of a ring's axis from that of the link's tube


class UnbuildableError(ValueError):
    """Raised for a ring that cannot be printed; the message states the reason and a remedy."""


def _mm(key: str) -> Any:
    """Return a property of a plan: a length of its clamp, or several, in millimetres."""
    return property(lambda plan: (MM * np.array(getattr(plan.clamp, key))).tolist())


@dataclass(frozen=True)
class PrintPlan:
    """A ring to be printed: its clamp in millimetres, and how it is divided."""

    ring: Ring
    """The ring."""
    printing: Printing
    """Printing parameters."""
    clamp: Clamp
    """The clamp, m; the properties of the same names are in millimetres."""
    angles: Float[np.ndarray, " n"]
    """Azimuths of the sensors, rad."""
    T_ring_print: Float[np.ndarray, "3 3"]
    """Rotation from the print frame to the ring's frame."""
    joints: Float[np.ndarray, " m"]
    """Azimuths of the joints between the parts, rad, ascending; part i follows joint i."""
    lean: float = 0.0
    """Angle by which the split deviates from the plane y = 0 on either side for an odd number of
    sensors, rad."""
    label: str = ""
    """Text on the parts, without the letter of each; empty: none."""

    radius, link, bore, collar, inner = map(_mm, ("radius", "link", "bore", "collar", "inner"))
    low, top, lug, across, reach = map(_mm, ("low", "top", "lug", "across", "reach"))
    ear, seat, rim, front, wall = map(_mm, ("ear", "seat", "rim", "front", "wall"))
    half, outermost, groove = map(_mm, ("half", "outermost", "groove"))

    @property
    def pocket(self) -> Pocket:
        """Pocket of each board, m."""
        return self.clamp.pocket

    @property
    def tilt(self) -> float:
        """Tilt, rad, not negative."""
        return self.clamp.tilt

    @property
    def bolt(self) -> Bolt:
        """The bolts."""
        return self.clamp.bolt.scaled(MM)

    @property
    def arcs(self) -> list[tuple[float, float]]:
        """First and last azimuth of each part, rad, ascending."""
        ends = [*self.joints[1:], self.joints[0] + 2 * math.pi]
        return [(float(a), float(b)) for a, b in zip(self.joints, ends, strict=True)]

    def frame(self, k: int) -> Float[np.ndarray, "3 4"]:
        """Return T_print_lens (3, 4) of sensor ``k``: x along the ring, y up the board, z along the
        beam, origin at the lens."""
        c, s = math.cos(self.tilt), math.sin(self.tilt)
        radial = np.array([math.cos(self.angles[k]), math.sin(self.angles[k]), 0.0])
        along, up = np.array([-radial[1], radial[0], 0.0]), np.array([0.0, 0.0, 1.0])
        return np.stack(
            [along, c * up - s * radial, c * radial + s * up, self.radius * radial], axis=1
        )


def plan_ring(
    scene: Scene, ring: Ring, printing: Printing | None = None, parts: int = 2
) -> PrintPlan:
    """Return the dimensions of a printed ring of ``scene``, divided into a number of ``parts``.

    Raises:
        UnbuildableError: if it cannot be built; the message states the reason and, for too many
            boards, how many fit.
    """
    printing = printing or scene.printing
    board = _buildable(scene, ring, printing)
    around = surrounded(scene.robot, ring.link)
    clamp = clamp_of(around, ring.radius, ring.tilt, board, printing)
    flip = -1.0 if ring.tilt < 0 else 1.0
    angles = flip * (ring.phase + 2 * math.pi * np.arange(ring.count) / ring.count)
    turn = _split(angles)
    T_ring_print = np.diag([1.0, flip, flip]) @ rotation_rpy(0.0, 0.0, -turn)
    joints = np.array([0.0, math.pi])
    plan = PrintPlan(ring, printing, clamp, angles + turn, T_ring_print, joints)
    if parts == 2:
        return replace(plan, lean=_lean(plan))
    return replace(plan, joints=_joints(plan, parts))


def _buildable(scene: Scene, ring: Ring, printing: Printing) -> Board:
    """Return the board of a ring's sensors.

    Raises:
        UnbuildableError: see ``plan_ring``.
    """
    board = ring.sensor.board
    if board is None:
        raise UnbuildableError(
            "no board is known for its sensor: choose a sensor that has one (vl53l0x, vl53l1x,"
            " vl53l4cd, vl53l5cx) or state the board in the scene's [sensor.board]"
        )
    if printing.cover and (
        why := lid_fault(board, ring.sensor, printing.clearance, printing.least_wall)
    ):
        raise UnbuildableError(f"printing.cover: found true, allowed: false, because {why}")
    mount, tube = (robot.mount(ring.link) for robot in (scene.robot, scene.robot.with_links(True)))
    beside = float(np.linalg.norm(np.cross(mount.start - tube.start, tube.axis)))
    if beside > _BESIDE:
        raise UnbuildableError(
            f"it sits on the line between two joints, {MM * beside:.0f} mm beside the axis of the"
            f" link's tube; {_BODILESS}"
        )
    if surrounded(scene.robot, ring.link) <= 0:
        raise UnbuildableError(
            f"the cross section of {ring.link} is unknown: set section of its mount"
        )
    printed = replace(scene, printing=printing)
    if why := unfit(replace(printed, rules=replace(scene.rules, mount="real")), ring):
        raise UnbuildableError(why if unfit(printed, ring) else f"{why}; {_BODILESS}")
    return board


def _split(angles: Float[np.ndarray, " n"]) -> float:
    """Return the rotation that centres the first half's sensors on +y."""
    n, sign = len(angles), 1.0 if len(angles) < 2 or angles[1] > angles[0] else -1.0
    return math.pi / 2 - (float(angles[0]) + sign * ((n + 1) // 2 - 1) * math.pi / n)


def _joints(plan: PrintPlan, parts: int) -> Float[np.ndarray, " m"]:
    """Return the azimuths, rad, of the joints of more than two parts, evenly between the sensors.

    Raises:
        UnbuildableError: if a joint would meet a block.
    """
    n, first, some = len(plan.angles), float(np.mod(plan.angles, 2 * math.pi).min()), list[float]()
    for i in range(n):
        count = (i + 1) * parts // n - i * parts // n  # joints between two sensors
        places = (np.arange(count) + 0.5) / max(count, 1)
        some += [first + 2 * math.pi / n * (i + float(place)) for place in places]
        if count > 1:  # one midway is always possible, as the boards' packing leaves room for it
            aside = plan.collar * math.sin(min(2 * math.pi / n * float(places[0]), math.pi / 2))
            if aside < plan.half + plan.reach:
                raise UnbuildableError(f"there is no room for the joints of {parts} parts")
    return np.array(some)


def _lean(plan: PrintPlan) -> float:
    """Return a quarter of the sensors' spacing for an odd number of sensors whose blocks a plane
    would cut; otherwise 0."""
    n = len(plan.angles)
    if n % 2 == 0 or n == 1:
        return 0.0
    lean = math.pi / (2 * n)
    return (
        0.0
        if plan.collar * math.sin(lean) >= (plan.half + plan.printing.gap * MM) * math.cos(lean)
        else lean
    )
