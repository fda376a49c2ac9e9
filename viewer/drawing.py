"""What is drawn of a setup in a scene: named arrays with colours, which a browser shows and a test
can read.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Literal

import numpy as np
from jaxtyping import Float, Int

from ..coverage.occlusion.model import Occlusion
from ..coverage.rings.ring import Ring, Setup
from ..coverage.rings.ring_kinematics import sensor_cones
from ..coverage.robots.kinematics import forward
from ..coverage.solids.cones import Cones
from ..coverage.targets import Target, robot_curve
from ..reporting.rendering.canvas import Surface
from ..reporting.rendering.meshes import RING_WIDTH, band, faces_within, lengths_within, loops, tube
from .colours import CURVE, FLOOR, KINDS, OBSTACLE, OUTLINE, ROBOT, SENSOR, link_colours
from .quick_estimate import ONCE, SHADOWED, SHOWN, TWICE, UNSEEN, QuickEstimate
from .robot_surface import Skin
from .triangle_meshes import beams, bodies, chips, grid, outline

Shown = Literal["off", "this ring", "this link", "all"]
SHOWN_CONES: tuple[Shown, ...] = ("off", "this ring", "this link", "all")
_FLOOR = grid(2.0, 0.5)
# share of the points up to which those that are missed are drawn large; of more each is smaller
_FEW = 0.15
_VEIL = 0.55  # opacity of one cone, shared by all


@dataclass(frozen=True)
class Mesh:
    """vertices (V, 3) m, triangles (T, 3) of them, a colour ``#rrggbb``, its opacity; may it be
    clicked, as which ring?
    """

    vertices: Float[np.ndarray, "V 3"]
    faces: Int[np.ndarray, "T 3"]
    colour: str
    opacity: float = 1.0
    ring: int | None = None


@dataclass(frozen=True)
class Dots:
    """points (N, 3) m, a colour, and the size of one, m."""

    points: Float[np.ndarray, "N 3"]
    colour: str
    size: float


@dataclass(frozen=True)
class Edges:
    """Lines (E, 2, 3) m, a colour, and how wide they are on the screen, pixels."""

    ends: Float[np.ndarray, "E 2 3"]
    colour: str
    width: float


Item = Mesh | Dots | Edges


@dataclass(frozen=True)
class DrawnParts:
    """What of it a page shows: the pose, the target, what the robot's body does to its sensors,
    whose cones, the ring that is chosen, the kinds of points, the target's outline, the robot."""

    pose: int
    target: Target
    occlusion: Occlusion
    cones: Shown = "this link"
    ring: int = 0
    kinds: frozenset[int] = field(
        default_factory=lambda: frozenset(k.number for k in KINDS) - {TWICE}
    )
    outline: bool = True
    robot: bool = True


class Drawing:
    """Draws setups in one scene, for many pages at once. What belongs to one ring is kept: the same
    arrays again as long as that ring stays as it is."""

    def __init__(self, glance: QuickEstimate, body: Skin | None = None) -> None:
        """``body``: the robot's surface, where it is known; else its bodies are drawn."""
        self.scene, self.glance, self.body = glance.scene, glance, body
        self._outer = lru_cache(256)(lambda target, pose: self.scene.solid(target, pose).a)
        self._robot = lru_cache(64)(self._robot_at)
        self._outline = lru_cache(64)(lambda target, pose: outline(self._outer(target, pose)))
        self._band = lru_cache(1024)(self._band_of)
        self._beams = lru_cache(1024)(self._beams_of)
        self._colours = link_colours(self.scene.robot.links)

    def backdrop(self, choice: DrawnParts) -> dict[str, Item]:
        """The robot, its pose curve, the target's outline and the obstacles: what no ring
        changes.
        """
        found: dict[str, Item] = {}
        surface, curve = self._robot(choice.pose)
        if choice.robot:
            found["robot"] = Mesh(*surface, ROBOT)
        found["floor"] = Edges(_FLOOR, FLOOR, 1.0)
        found["curve"] = Edges(curve, CURVE, 2.5)
        if choice.outline:
            found["outline"] = Edges(self._outline(choice.target, choice.pose), OUTLINE, 1.0)
        box = self._outer(choice.target, choice.pose).bounds() + np.array([[-0.3], [0.3]])
        for i, obstacle in enumerate(self.scene.obstacles):
            corners = faces_within(obstacle.body, box).reshape(-1, 3)
            if len(corners):
                found[f"obstacle{i}"] = Mesh(
                    corners, np.arange(len(corners)).reshape(-1, 3), OBSTACLE, 0.7
                )
        return found

    def _robot_at(self, pose: int) -> tuple[Surface, Float[np.ndarray, "E 2 3"]]:
        robot, q = self.scene.robot, self.scene.poses[pose].q
        centres = robot_curve(robot, q, self.scene.shape).discs(self.scene.shape.points_per_bend)[0]
        surface = bodies(robot, forward(robot.chain, q)) if self.body is None else self.body.at(q)
        return surface, np.stack([centres[:-1], centres[1:]], axis=1)

    def _cones(self, ring: Ring, pose: int) -> Cones:
        return sensor_cones(self.scene.robot, Setup((ring,)), self.scene.poses[pose].q)

    def _band_of(
        self, ring: Ring, pose: int
    ) -> tuple[Surface, Surface, Float[np.ndarray, "E 2 3"]]:
        frames = forward(self.scene.robot.chain, self.scene.poses[pose].q)
        width = self.scene.rules.band[1] if self.scene.real else RING_WIDTH
        hoop = band(self.scene.robot, frames, ring, width)
        return tube(hoop), chips(self._cones(ring, pose)), loops(hoop)

    def _beams_of(
        self, ring: Ring, pose: int, target: Target
    ) -> tuple[Surface, Float[np.ndarray, "E 2 3"]]:
        cones = self._cones(ring, pose)
        return beams(cones, lengths_within(cones, self._outer(target, pose)))

    def rings(self, setup: Setup, choice: DrawnParts) -> dict[str, Item]:
        """The rings as bands with their sensors, and the cones of those that are chosen, as far as
        the target goes.
        """
        wanted = shown_cones(setup, choice)
        veil = min(_VEIL / max(sum(setup.rings[i].count for i in wanted), 1) ** 0.5, 0.25)
        found: dict[str, Item] = {}
        for i, ring in enumerate(setup.rings):
            colour = self._colours[ring.link]
            hoop, sensors, edge = self._band(ring, choice.pose)
            found[f"ring{i}"] = Mesh(*hoop, colour, 1.0, i)
            found[f"sensors{i}"] = Mesh(*sensors, SENSOR)
            if i == choice.ring:
                found["chosen"] = Edges(edge, CURVE, 3.0)
            if i in wanted:
                surface, rims = self._beams(ring, choice.pose, choice.target)
                found[f"cones{i}"] = Mesh(*surface, colour, veil)
                found[f"rims{i}"] = Edges(rims, colour, 1.0)
        return found

    def points(
        self, setup: Setup, choice: DrawnParts, beside: Sequence[Setup] = ()
    ) -> tuple[dict[str, Item], tuple[float, ...]]:
        """The target's points at the pose, kind by kind, and each kind's share of all of them; as
        large as those of the setups ``beside``. BodilessError as for ``QuickEstimate.verdict``."""
        where = self.glance.points(choice.target, choice.pose, SHOWN)
        kind, *others = (
            self.glance.verdict(s, choice.target, choice.pose, choice.occlusion).kind
            for s in (setup, *beside)
        )
        wide = float(np.linalg.norm(np.ptp(self.box(choice), axis=0)))
        shares = tuple(float(np.mean(kind == k.number)) for k in KINDS)
        missed = max(float(np.mean(each < ONCE)) for each in (kind, *others))
        many = dict.fromkeys((UNSEEN, SHADOWED), max(missed / _FEW, 1.0) ** -0.5)
        found: dict[str, Item] = {
            f"points{k.number}": Dots(
                where[kind == k.number], k.colour, wide * k.size * many.get(k.number, 1.0)
            )
            for k, share in zip(KINDS, shares, strict=True)
            if k.number in choice.kinds and share > 0
        }
        return found, shares

    def box(self, choice: DrawnParts) -> Float[np.ndarray, "2 3"]:
        """Lower and upper corner (2, 3) m of the target at the pose."""
        return self._outer(choice.target, choice.pose).bounds()


def shown_cones(setup: Setup, choice: DrawnParts) -> list[int]:
    """The rings whose cones are shown."""
    link = setup.rings[choice.ring].link
    return [
        i
        for i, ring in enumerate(setup.rings)
        if choice.cones == "all"
        or (choice.cones == "this link" and ring.link == link)
        or (choice.cones == "this ring" and i == choice.ring)
    ]
