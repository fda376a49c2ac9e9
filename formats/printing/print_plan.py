"""Dimensions of a printed ring, derived from a ring of a setup before any solid is built.

All lengths are millimetres in the print frame: z points along the ring's axis, upwards when printed
and towards the side to which the beams lean. The lenses lie in the plane z = 0; x and y are rotated
so that the halves separate along y. ``T_ring_print`` rotates the print frame to the ring's frame.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from ...coverage.rings.ring import Ring
from ...coverage.robots.ring_section import surrounded
from ...coverage.sensors.board_packing import Pocket, Printing, best_pocket, inner_radius
from ...coverage.sensors.boards import Board
from ...objectives.feasibility.board_fit import unfit
from ...objectives.scene import Scene

MM = 1000.0  # millimetres in a metre
NUT_CLEARANCE = 0.15  # mm, on each side
FRONT = 6.0  # mm in front of a lens that the ring leaves free
# head, nut (ISO 4762, 4032), nut height, hole (ISO 273)
_HEADS = {3: (5.5, 5.5, 2.4, 3.4), 4: (7.0, 7.0, 3.2, 4.5), 5: (8.5, 8.0, 4.7, 5.5)}


class UnbuildableError(ValueError):
    """Raised for a ring that cannot be printed; the message states the reason and a remedy."""


@dataclass(frozen=True)
class Bolt:
    """A bolt with its nut, mm."""

    head: float
    """Diameter of the head."""
    nut: float
    """Width of the nut across flats."""
    nut_height: float
    """Height of the nut."""
    hole: float
    """Diameter of the clearance hole."""
    size: float
    """Nominal diameter."""

    @property
    def widest(self) -> float:
        """Distance from the axis to a corner of the nut trap."""
        return (self.nut / 2 + NUT_CLEARANCE) / math.cos(math.pi / 6)


@dataclass(frozen=True)
class PrintPlan:
    """A ring to be printed, mm."""

    ring: Ring
    """The ring."""
    printing: Printing
    """Printing parameters."""
    pocket: Pocket
    """Pocket of each board, m."""
    angles: Float[np.ndarray, " n"]
    """Azimuths of the sensors, rad."""
    tilt: float
    """Tilt, rad, not negative."""
    radius: float
    """Radius of the circle of lenses."""
    centre: Float[np.ndarray, " 2"]
    """Centre of the hole for the link."""
    link: float
    """Radius of the link."""
    bore: float
    """Radius of the hole for the link."""
    collar: float
    """Outer radius of the band around the hole."""
    inner: float
    """Least radius of the pockets."""
    low: float
    """Lower end of the sensors' zone."""
    top: float
    """Upper end of the sensors' zone."""
    lug: tuple[float, float]
    """Lower and upper end of the bolts' zone."""
    across: float
    """Distance of the bolts' axes from the bore's centre."""
    reach: float
    """Extent of a lug from the split."""
    ear: float
    """Distance of a lug's outer end from the bore's centre."""
    lean: float
    """Angle by which the split deviates from the plane y = 0 on either side for an odd number of
    sensors, rad."""
    groove: tuple[float, float]
    """Inner and outer radius of the cable channel."""
    bolt: Bolt
    """The bolts."""
    T_ring_print: Float[np.ndarray, "3 3"]
    """Rotation from the print frame to the ring's frame."""

    @property
    def seat(self) -> float:
        """Distance from the lens back to a board's rear face."""
        board = self.pocket.board
        return MM * (board.lens_height + board.thickness)

    @property
    def rim(self) -> float:
        """Distance from the lens back to the ring's front: half a board's thickness in front of its
        rear face."""
        return self.seat - MM * self.pocket.board.thickness / 2

    @property
    def wall(self) -> float:
        """Thickness of load-bearing walls."""
        return MM * self.printing.wall

    @property
    def half(self) -> float:
        """Half the width of a block that carries a board."""
        return MM * (self.pocket.half + self.printing.wall)

    @property
    def floor(self) -> float:
        """Distance of the pockets from the ring's axis."""
        return MM * float(self.pocket.floor(self.radius / MM, np.array([self.tilt]))[0])

    def frame(self, k: int) -> Float[np.ndarray, "3 4"]:
        """Return T_print_lens (3, 4) of sensor ``k``: x along the ring, y up the board, z along the
        beam, origin at the lens."""
        c, s = math.cos(self.tilt), math.sin(self.tilt)
        radial = np.array([math.cos(self.angles[k]), math.sin(self.angles[k]), 0.0])
        along, up = np.array([-radial[1], radial[0], 0.0]), np.array([0.0, 0.0, 1.0])
        return np.stack(
            [along, c * up - s * radial, c * radial + s * up, self.radius * radial], axis=1
        )


def plan_ring(scene: Scene, ring: Ring, printing: Printing | None = None) -> PrintPlan:
    """Return the dimensions of a printed ring of ``scene``.

    Raises:
        UnbuildableError: if it cannot be built; the message states the reason and, for too many
            boards, how many fit.
    """
    printing = printing or scene.printing
    mount = scene.robot.mount(ring.link)
    board, around = _buildable(scene, ring, printing)
    pocket = best_pocket(board, printing, ring.radius, ring.tilt, inner_radius(around, printing))
    tilt, flip = abs(ring.tilt), -1.0 if ring.tilt < 0 else 1.0
    angles = flip * (ring.phase + 2 * math.pi * np.arange(ring.count) / ring.count)
    link = MM * (mount.section if mount.aside > 0 else around)
    centre = (
        MM * mount.aside * np.array([math.cos(flip * mount.toward), math.sin(flip * mount.toward)])
    )
    turn = _split(angles, centre)
    centre, angles = _rotation(turn) @ centre, angles + turn
    c, s = math.cos(tilt), math.sin(tilt)
    seat, bore = MM * (board.lens_height + board.thickness), link + MM * printing.slack
    top = MM * pocket.high * c - seat * s
    bolt = Bolt(*_HEADS[round(MM * printing.bolt)], MM * printing.bolt)
    collar, wall = bore + MM * printing.wall, MM * printing.wall
    across, reach = collar + bolt.head / 2, wall + bolt.nut_height + 0.3
    ear = across + max(bolt.head, bolt.nut + 2 * NUT_CLEARANCE) / 2 + wall / 2
    # where the upper edge of a pocket crosses the plane of its lens
    edge = MM * (ring.radius - pocket.high * s)
    # distance in front of a lens that must stay free of ears
    under = (math.hypot(ear, reach) + float(np.linalg.norm(centre)) - edge) / max(c, 1e-9)
    # above the pockets, which would weaken the ears
    lug = top + (seat + min(max(under, 0.0), FRONT)) * s + 0.5
    first = MM * inner_radius(around, printing)
    back = max(first, MM * float(pocket.floor(ring.radius, np.array([tilt]))[0] - printing.channel))
    R = np.eye(3)
    R[:2, :2] = _rotation(-turn)
    plan = PrintPlan(
        ring=ring,
        printing=printing,
        pocket=pocket,
        angles=angles,
        tilt=tilt,
        radius=MM * ring.radius,
        centre=centre,
        link=link,
        bore=bore,
        collar=collar,
        inner=first,
        low=MM * (pocket.low * c - pocket.deep * s) - wall,
        top=top,
        lug=(lug, lug + 2 * bolt.widest + wall),
        across=across,
        reach=reach,
        ear=ear,
        lean=0.0,
        groove=(back, back + MM * printing.channel),
        bolt=bolt,
        T_ring_print=np.diag([1.0, flip, flip]) @ R,
    )
    return replace(plan, lean=_lean(plan))


def _buildable(scene: Scene, ring: Ring, printing: Printing) -> tuple[Board, float]:
    """Return the board of a ring's sensors, and the radius around which the ring is built, m.

    Raises:
        UnbuildableError: see ``plan_ring``.
    """
    board = ring.sensor.board
    if board is None:
        raise UnbuildableError(
            "no board is known for its sensor: choose a sensor that has one (vl53l0x, vl53l1x,"
            " vl53l4cd, vl53l5cx) or state the board in the scene's [sensor.board]"
        )
    around = surrounded(scene.robot.mount(ring.link), scene.robot.bodies)
    if around <= 0:
        raise UnbuildableError(
            f"the cross section of {ring.link} is unknown: set section of its mount"
        )
    printed = replace(scene, printing=printing)
    if why := unfit(replace(printed, rules=replace(scene.rules, mount="real")), ring):
        raise UnbuildableError(why if unfit(printed, ring) else f"{why}; {_bodiless(scene)}")
    return board, around


def _bodiless(scene: Scene) -> str:
    """Return the remedy for a scene whose rings have no bodies."""
    option = "" if scene.rules.mount == "free" else "--occlusion blind or shadow, or with "
    return f'rings have no bodies in its scene: search with {option}rules.mount = "real"'


def _rotation(angle: float) -> Float[np.ndarray, "2 2"]:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s], [s, c]])


def _split(angles: Float[np.ndarray, " n"], centre: Float[np.ndarray, " 2"]) -> float:
    """Return the rotation that centres the first half's sensors on +y; of all such rotations, the
    one that divides the link most evenly."""
    n, sign = len(angles), 1.0 if len(angles) < 2 or angles[1] > angles[0] else -1.0
    turns: list[float] = [
        math.pi / 2 - (angles[j] + sign * ((n + 1) // 2 - 1) * math.pi / n) for j in range(n)
    ]
    return min(turns, key=lambda turn: round(abs(float((_rotation(turn) @ centre)[1])), 6))


def _lean(plan: PrintPlan) -> float:
    """Return a quarter of the sensors' spacing for an odd number of sensors whose blocks a plane
    would cut; otherwise 0."""
    n = len(plan.angles)
    if n % 2 == 0 or n == 1:
        return 0.0
    lean, central = math.pi / (2 * n), not plan.centre.any()
    return (
        0.0
        if central
        and plan.collar * math.sin(lean) >= (plan.half + plan.printing.gap * MM) * math.cos(lean)
        else lean
    )
