"""What a printed ring measures, from a ring of a setup: where everything is, before any solid is
made.

Millimetres, as printers have them, in the print frame: z along the ring's axis, upwards when
printed, and towards where the beams lean; the lenses in the plane z = 0, x and y turned so that the
halves part along y. ``T_ring_print`` leads back.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from ...coverage.rings.ring import Ring
from ...coverage.robots.ring_section import surrounded
from ...coverage.sensors.board_packing import Pocket, Printing, best_pocket, inner_radius
from ...objectives.feasibility.packing import unfit
from ...objectives.scene import Scene

MM = 1000.0  # in a metre
NUT_CLEARANCE = 0.15  # mm, on each side
FRONT = 6.0  # mm before a lens, that nothing of the ring may fill
# head, nut: ISO 4762, 4032; ISO 273
_HEADS = {3: (5.5, 5.5, 2.4, 3.4), 4: (7.0, 7.0, 3.2, 4.5), 5: (8.5, 8.0, 4.7, 5.5)}


class UnbuildableError(ValueError):
    """A ring that cannot be printed; the text says why, and what could be."""


@dataclass(frozen=True)
class Bolt:
    """A bolt's head and nut (across flats), the nut's height, its clearance hole, nominal diameter;
    mm.
    """

    head: float
    nut: float
    nut_height: float
    hole: float
    size: float

    @property
    def widest(self) -> float:
        """From its axis to a corner of the nut's trap."""
        return (self.nut / 2 + NUT_CLEARANCE) / math.cos(math.pi / 6)


@dataclass(frozen=True)
class PrintPlan:
    """A ring to be printed, mm.

    angles (n,) rad: of the sensors; tilt: >= 0, rad; radius: of the circle of lenses. pocket: of
    each board, m, as coverage has it. bore: radius of the hole for the link, and centre (2,), its
    place; link: radius of what it holds; collar: outer radius of the band around it. low, top: ends
    of the sensors' zone; lug: (low, high) of the bolts' zone. across: of the bolts' axes from the
    bore's centre; reach: of a lug from the split; ear: its outer end from
    the bore's centre. lean: rad, by which the split leaves the plane y = 0
    on either side where the number of sensors is odd. groove: (inner, outer) radius of the cables'
    channel.
    """

    ring: Ring
    printing: Printing
    pocket: Pocket
    angles: Float[np.ndarray, " n"]
    tilt: float
    radius: float
    centre: Float[np.ndarray, " 2"]
    link: float
    bore: float
    collar: float
    inner: float
    low: float
    top: float
    lug: tuple[float, float]
    across: float
    reach: float
    ear: float
    lean: float
    groove: tuple[float, float]
    bolt: Bolt
    T_ring_print: Float[np.ndarray, "3 3"]

    @property
    def seat(self) -> float:
        """How far behind the lens a board's back lies."""
        board = self.pocket.board
        return MM * (board.lens_height + board.thickness)

    @property
    def rim(self) -> float:
        """How far behind the lens the ring's front lies: half a board's thickness before its
        back.
        """
        return self.seat - MM * self.pocket.board.thickness / 2

    @property
    def wall(self) -> float:
        return MM * self.printing.wall

    @property
    def half(self) -> float:
        """Half the width of a block that carries a board."""
        return MM * (self.pocket.half + self.printing.wall)

    @property
    def floor(self) -> float:
        """How far the pockets stay from the ring's axis."""
        return MM * float(self.pocket.floor(self.radius / MM, np.array([self.tilt]))[0])

    def frame(self, k: int) -> Float[np.ndarray, "3 4"]:
        """T_print_lens (3, 4) of sensor ``k``: its x along the ring, y up the board, z where it
        looks; from its lens.
        """
        c, s = math.cos(self.tilt), math.sin(self.tilt)
        radial = np.array([math.cos(self.angles[k]), math.sin(self.angles[k]), 0.0])
        along, up = np.array([-radial[1], radial[0], 0.0]), np.array([0.0, 0.0, 1.0])
        return np.stack(
            [along, c * up - s * radial, c * radial + s * up, self.radius * radial], axis=1
        )


def plan_ring(scene: Scene, ring: Ring, printing: Printing | None = None) -> PrintPlan:
    """What a ring of ``scene`` measures when it is printed.

    Raises:
        UnbuildableError: if it cannot be built; it says why and, where there are too many boards,
            how many fit.
    """
    printing = printing or scene.printing
    mount, board = scene.robot.mount(ring.link), ring.sensor.board
    if board is None:
        raise UnbuildableError(
            "no board is known that carries its sensor: name a sensor that has one (vl53l0x,"
            " vl53l1x, vl53l4cd, vl53l5cx) or state it in the scene's [sensor.board]"
        )
    around = surrounded(mount, scene.robot.bodies)
    if around <= 0:
        raise UnbuildableError(
            f"nothing is known of what a ring on {ring.link} surrounds: state its mount's section"
        )
    asked = replace(scene, printing=printing)
    if why := unfit(replace(asked, rules=replace(scene.rules, mount="real")), ring):
        raise UnbuildableError(why if unfit(asked, ring) else f"{why}; {_bodiless(scene)}")
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
    # where the upper edge of a pocket leaves the plane of its lens
    edge = MM * (ring.radius - pocket.high * s)
    # in front of which no ear is
    under = (math.hypot(ear, reach) + float(np.linalg.norm(centre)) - edge) / max(c, 1e-9)
    # above the pockets' room, which would thin the ears
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


def _bodiless(scene: Scene) -> str:
    """How a search is asked for rings with bodies, where a scene's have none."""
    asked = "" if scene.rules.mount == "free" else "--occlusion blind or shadow, or with "
    return f'its scene gives rings no body: search with {asked}rules.mount = "real"'


def _rotation(angle: float) -> Float[np.ndarray, "2 2"]:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s], [s, c]])


def _split(angles: Float[np.ndarray, " n"], centre: Float[np.ndarray, " 2"]) -> float:
    """The turn that brings the first half's sensors about +y, of all turns that which parts the
    link most evenly.
    """
    n, sign = len(angles), 1.0 if len(angles) < 2 or angles[1] > angles[0] else -1.0
    turns: list[float] = [
        math.pi / 2 - (angles[j] + sign * ((n + 1) // 2 - 1) * math.pi / n) for j in range(n)
    ]
    return min(turns, key=lambda turn: round(abs(float((_rotation(turn) @ centre)[1])), 6))


def _lean(plan: PrintPlan) -> float:
    """Half a spacing's half for an odd number of sensors, whose blocks a plane would cut; 0 where
    it would not.
    """
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
