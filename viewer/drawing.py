"""Drawing of a setup in a scene: named arrays with colours, for the browser and for tests."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float, Int

from ..coverage.rings.mounted_sensor import MountedSensor
from ..coverage.rings.ring import Group, Ring, Setup, setup_of_group
from ..coverage.rings.ring_kinematics import sensor_cones
from ..coverage.robots.kinematics import forward
from ..coverage.robots.link_bodies import attached_at, carried_at
from ..coverage.robots.robot import BASE
from ..coverage.solids.beams import Beams
from ..coverage.targets.posed_robot import robot_curve
from ..coverage.targets.target import Target
from ..formats.sensors.sensor_frames import sensor_frames
from ..reporting.rendering.meshes import (
    band,
    capsule_surfaces,
    faces_of,
    faces_within,
    lengths_within,
    loops,
    sharp_edges,
    tube,
)
from ..reporting.rendering.surface import Surface
from .colours import CURVE, FLOOR, KINDS, OBSTACLE, OUTLINE, ROBOT, SENSOR, WARNING, link_colours
from .drawn_parts import DrawnParts, shown_cones
from .quick_estimate import ONCE, SHADOWED, SHOWN, UNSEEN, QuickEstimate
from .triangle_meshes import Skin, beams, bodies, chips, grid, outline


@dataclass(frozen=True)
class DrawnMesh:
    """A triangle mesh."""

    vertices: Float[np.ndarray, "V 3"]
    """Vertices, m."""
    faces: Int[np.ndarray, "T 3"]
    """Vertex indices of the triangles."""
    colour: str
    """Colour as ``#rrggbb``."""
    opacity: float = 1.0
    """Opacity in [0, 1]."""
    ring: int | None = None
    """Index of the ring or single sensor that a click on the mesh selects, or None."""


@dataclass(frozen=True)
class Dots:
    """Points of one colour."""

    points: Float[np.ndarray, "N 3"]
    """Positions, m."""
    colour: str
    """Colour as ``#rrggbb``."""
    size: float
    """Size of a point, m."""


@dataclass(frozen=True)
class Edges:
    """Lines of one colour."""

    ends: Float[np.ndarray, "E 2 3"]
    """End points, m."""
    colour: str
    """Colour as ``#rrggbb``."""
    width: float
    """Width on the screen, pixels."""


Item = DrawnMesh | Dots | Edges


_FLOOR = grid(2.0, 0.5)
BASE_AXES: Float[np.ndarray, "3 2 3"] = np.stack([np.zeros((3, 3)), np.eye(3)], axis=1)
"""Axes of the base, of 1 m."""
_CLEAR = 0.25  # opacity of obstacles, behind which the points of the target stay visible
# up to this share of uncovered points they are drawn large; above it each is smaller
_FEW = 0.15
_AXIS, _UP = 0.12, 0.05  # m, lines of the selected single sensor
_VEIL = 0.55  # opacity of a single cone; several cones share it
_BEAM = 0.4  # opacity of the selected sensor's cone


class Drawing:
    """Draws setups in one scene, for many pages at once.

    Arrays of a ring are cached: an unchanged ring gives the same arrays again.
    """

    def __init__(self, glance: QuickEstimate, body: Skin | None = None) -> None:
        """Draw the robot's surface ``body``, or its capsules if there is none."""
        self.scene, self.glance, self.body = glance.scene, glance, body
        self._outer = lru_cache(256)(lambda target, pose: self.scene.solid(target, pose).a)
        self._robot = lru_cache(64)(self._robot_at)
        self._outline = lru_cache(64)(lambda target, pose: outline(self._outer(target, pose)))
        self._band = lru_cache(1024)(self._band_of)
        self._beams = lru_cache(1024)(self._beams_of)
        self._beam = lru_cache(64)(self._beam_of)
        self._chip = lru_cache(1024)(self._chip_of)
        self._colours = link_colours(self.scene.robot.links)

    def backdrop(self, choice: DrawnParts) -> dict[str, Item]:
        """Draw what no ring changes: the robot, its pose curve, the target's outline and the
        obstacles.
        """
        found: dict[str, Item] = {}
        surface, curve = self._robot(choice.pose)
        if choice.robot:
            found["robot"] = DrawnMesh(*surface, ROBOT)
        found["floor"] = Edges(_FLOOR, FLOOR, 1.0)
        found["axes"] = Edges(BASE_AXES, CURVE, 1.5)
        found["curve"] = Edges(curve, CURVE, 2.5)
        if choice.outline:
            found["outline"] = Edges(self._outline(choice.target, choice.pose), OUTLINE, 1.0)
        box = self._outer(choice.target, choice.pose).bounds() + np.array([[-0.3], [0.3]])
        for i, obstacle in enumerate(self.scene.obstacles):
            faces = faces_within(obstacle.body, box)
            if len(faces):
                corners = np.arange(3 * len(faces)).reshape(-1, 3)
                found[f"obstacle{i}"] = DrawnMesh(faces.reshape(-1, 3), corners, OBSTACLE, _CLEAR)
                found[f"obstacle{i}_edges"] = Edges(sharp_edges(faces), OBSTACLE, 2.0)
        for i, solid in enumerate(self._attached(choice.pose) if choice.robot else ()):
            found[f"attached{i}"] = DrawnMesh(*solid, ROBOT)
        return found

    def _attached(self, pose: int) -> list[Surface]:
        """Return the polyhedra that the robot carries; and, where its own surface is drawn, the
        attached capsules, which belong to the bodies."""
        robot, q = self.scene.robot, self.scene.poses[pose].q
        frames = np.asarray(forward(robot.chain, q))
        corners = [faces_of(body).reshape(-1, 3) for body in carried_at(robot, frames)]
        solids: list[Surface] = [(c, np.arange(len(c)).reshape(-1, 3)) for c in corners]
        capsules = None if self.body is None else attached_at(robot, frames)
        return solids + ([] if capsules is None else capsule_surfaces(capsules, tube))

    def _robot_at(self, pose: int) -> tuple[Surface, Float[np.ndarray, "E 2 3"]]:
        robot, q = self.scene.robot, self.scene.poses[pose].q
        centres = robot_curve(robot, q, self.scene.curve).discs(self.scene.curve.points_per_bend)[0]
        surface = bodies(robot, forward(robot.chain, q)) if self.body is None else self.body.at(q)
        return surface, np.stack([centres[:-1], centres[1:]], axis=1)

    def _cones(self, ring: Group, pose: int) -> Beams:
        return sensor_cones(self.scene.robot, setup_of_group(ring), self.scene.poses[pose].q)

    def _band_of(
        self, ring: Ring, pose: int
    ) -> tuple[Surface, Surface, Float[np.ndarray, "E 2 3"]]:
        frames = forward(self.scene.robot.chain, self.scene.poses[pose].q)
        hoop = band(self.scene, frames, ring)
        return tube(hoop), chips(self._cones(ring, pose)), loops(hoop)

    def _chip_of(self, one: MountedSensor, pose: int) -> tuple[Surface, Float[np.ndarray, "2 2 3"]]:
        """Return the box of a single sensor, and its axis and ``up`` as two edges."""
        robot = self.scene.robot
        (seat,) = sensor_frames(robot, setup_of_group(one))
        frames = np.asarray(forward(robot.chain, self.scene.poses[pose].q))
        T = seat.T_frame_sensor if seat.frame == BASE else frames[seat.frame] @ seat.T_frame_sensor
        apex, look, up = T[:3, 3], T[:3, 2], T[:3, 1]
        axis = np.stack([[apex, apex + _AXIS * look], [apex, apex + _UP * up]])
        return chips(self._cones(one, pose)), axis

    def _beams_of(
        self, ring: Group, pose: int, target: Target
    ) -> tuple[Surface, Float[np.ndarray, "E 2 3"]]:
        cones = self._cones(ring, pose)
        return beams(cones, lengths_within(cones, self._outer(target, pose)))

    def _beam_of(
        self, group: Group, pose: int, target: Target, sensor: int
    ) -> tuple[Surface, Float[np.ndarray, "E 2 3"]]:
        cones = self._cones(group, pose)
        lengths = lengths_within(cones, self._outer(target, pose))
        return beams(cones, lengths, (sensor,))

    def rings(self, setup: Setup, choice: DrawnParts) -> dict[str, Item]:
        """Draw the rings as bands with their sensors, the single sensors and those of the cell, and
        the chosen cones up to the target's boundary.
        """
        wanted = shown_cones(setup, choice)
        veil = min(_VEIL / max(sum(setup.groups[i].count for i in wanted), 1) ** 0.5, 0.25)
        found: dict[str, Item] = {}
        for i, ring in enumerate(setup.rings):
            colour = self._colours[ring.link]
            mark = WARNING if i in choice.faulty else colour
            hoop, sensors, edge = self._band(ring, choice.pose)
            found[f"ring{i}"] = DrawnMesh(*hoop, mark, 1.0, i)
            found[f"sensors{i}"] = DrawnMesh(*sensors, SENSOR, 1.0, i)
            if i == choice.ring:
                found["chosen"] = Edges(edge, CURVE, 3.0)
            if i in wanted:
                surface, rims = self._beams(ring, choice.pose, choice.target)
                found[f"cones{i}"] = DrawnMesh(*surface, colour, veil)
                found[f"rims{i}"] = Edges(rims, colour, 1.0)
        singles = self.scene.with_cell(setup).singles
        for i, one in enumerate(singles, start=len(setup.rings)):
            colour, of_setup = self._colours.get(one.link, CURVE), i < len(setup.groups)
            chip, axis = self._chip(one, choice.pose)
            mark = WARNING if i in choice.faulty else SENSOR
            found[f"sensors{i}"] = DrawnMesh(*chip, mark, 1.0, i if of_setup else None)
            if i == choice.ring and of_setup:
                found["chosen"] = Edges(axis, CURVE, 3.0)
            if choice.cones == "all" or i in wanted:
                surface, rims = self._beams(one, choice.pose, choice.target)
                found[f"cones{i}"] = DrawnMesh(*surface, colour, veil)
                found[f"rims{i}"] = Edges(rims, colour, 1.0)
        return {**found, **self._selected(setup, choice)}

    def _selected(self, setup: Setup, choice: DrawnParts) -> dict[str, Item]:
        """Draw the cone of the selected sensor."""
        group = setup.groups[choice.ring]
        if choice.sensor is None or choice.sensor >= group.count:
            return {}
        surface, rims = self._beam(group, choice.pose, choice.target, choice.sensor)
        colour = self._colours.get(group.link, CURVE)
        return {"sensor": DrawnMesh(*surface, colour, _BEAM), "sensor rim": Edges(rims, CURVE, 2.5)}

    def apexes(self, group: Group, pose: int) -> Float[np.ndarray, "K 3"]:
        """Return the places (K, 3) m of a group's sensors at a pose."""
        return np.asarray(self._cones(group, pose).apex)

    def curve(self, pose: int) -> Float[np.ndarray, "N 3"]:
        """Return points (N, 3) m along the robot's centre line at a pose."""
        return self._robot(pose)[1].reshape(-1, 3)

    def extent(self, choice: DrawnParts) -> Float[np.ndarray, "N 3"]:
        """Return points (N, 3) m that surround the robot and the target at the pose."""
        edges = self._outline(choice.target, choice.pose).reshape(-1, 3)
        low, high = self.box(choice)
        inside = edges[((edges >= low - 1e-6) & (edges <= high + 1e-6)).all(axis=1)]
        corners = np.stack(np.meshgrid(*self.box(choice).T), axis=-1).reshape(-1, 3)
        return np.concatenate([inside if len(inside) else corners, self.curve(choice.pose)])

    def points(
        self, setup: Setup, choice: DrawnParts, beside: Sequence[Setup] = ()
    ) -> tuple[dict[str, Item], tuple[float, ...]]:
        """Draw the target's points at the pose, class by class.

        Args:
            setup: setup that covers points.
            choice: what the page shows.
            beside: other setups on the page, which get points of the same size.

        Returns:
            The drawings, and the share of each class among all points.

        Raises:
            BodilessError: see ``QuickEstimate.verdict``.
        """
        where = self.glance.points(choice.target, choice.pose, SHOWN)
        kind, *others = (
            self.glance.verdict(s, choice.target, choice.pose, choice.occlusion).kind
            for s in (setup, *beside)
        )
        wide = float(np.linalg.norm(np.ptp(self.box(choice), axis=0)))
        shares = tuple(float(np.mean(kind == k.number)) for k in KINDS)
        missed = max(float(np.mean(each < ONCE)) for each in (kind, *others))
        many = dict.fromkeys((UNSEEN, SHADOWED), max(missed / _FEW, 1.0) ** -0.5)
        shown = np.ones(len(where), bool) if choice.cut is None else choice.cut.keeps(where)
        found: dict[str, Item] = {
            f"points{k.number}": Dots(
                where[some], k.colour, wide * k.size * many.get(k.number, 1.0)
            )
            for k in KINDS
            if k.number in choice.kinds and (some := (kind == k.number) & shown).any()
        }
        return found, shares

    def shares(self, setup: Setup, choice: DrawnParts, count: int) -> tuple[float, ...]:
        """Return the share of each class of points, in the order of ``KINDS``, from ``count``
        points at the pose.
        """
        verdict = self.glance.verdict(setup, choice.target, choice.pose, choice.occlusion, count)
        return tuple(float(np.mean(verdict.kind == k.number)) for k in KINDS)

    def box(self, choice: DrawnParts) -> Float[np.ndarray, "2 3"]:
        """Return the lower and upper corner (2, 3) m of the target at the pose."""
        return self._outer(choice.target, choice.pose).bounds()
