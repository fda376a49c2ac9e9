"""Four drawings of a setup and a shell: discs, cones, the voxels of both, uncovered voxels."""

from dataclasses import dataclass
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np

from ...coverage.rings.ring import Setup, named_setup
from ...coverage.rings.ring_kinematics import sensor_cones
from ...coverage.robots.kinematics import forward
from ...coverage.solids.base import Difference, Solid, Union
from ...coverage.solids.cones import Cones
from ...coverage.targets import Target, robot_curve
from ...coverage.voxels.octree import voxels
from ...coverage.voxels.voxel_set import VoxelSet
from ...objectives.scene import CoreScene
from ...objectives.target_voxels import target_voxels
from ...reporting.rendering.canvas import Canvas
from ...reporting.rendering.colours import LINK_COLOURS, UNSEEN_COLOUR, paler, rgb
from ...reporting.rendering.meshes import body, circle, cone, loops, tube
from ...reporting.rendering.robot import add_robot
from ...reporting.rendering.voxels import add_skin, cut_open, holds, normals, openness, skin

if TYPE_CHECKING:
    from matplotlib.axes import Axes

EYE = (-62.0, 20.0)  # azimuth and elevation, degrees
SHELL_COLOUR, BEND_COLOUR = "#c9bbe6", "#7f878f"
_STRAIGHT = ("#E69F00", "#56B4E9", "#009E73", "#F0E442", "#0072B2", "#D55E00", "#CC79A7")
_TOWARDS = 0.2  # cosine of the angle to the eye above which a cone would hide the robot
_SECTION = 1.25  # light on the faces of a cut, relative to the rest


@dataclass(frozen=True)
class OctreeView:
    """A setup in a scene's first pose and a shell V_S: solids, and the voxels of each."""

    scene: CoreScene
    setup: Setup
    target: Target
    shell: Difference
    cones: Cones
    wanted: VoxelSet
    seen: VoxelSet

    @staticmethod
    def of(scene: CoreScene, setup_name: str, radius: float, voxel: float) -> "OctreeView":
        """Build the view of one of the paper's setups.

        Args:
            scene: scene whose first pose is drawn.
            setup_name: name of the setup.
            radius: radius of the shell, m.
            voxel: side of the voxels, which count by their centres, m.
        """
        q, setup = scene.poses[0].q, named_setup(setup_name, scene.sensor, scene.ring_radius)
        target = Target("V_S", radius)
        shell, cones = scene.solid(target, 0), sensor_cones(scene.robot, setup, q)
        return OctreeView(
            scene,
            setup,
            target,
            shell,
            cones,
            target_voxels(shell, voxel, "centre"),
            voxels(cones, voxel),
        )

    @property
    def frames(self) -> Any:
        return forward(self.scene.robot.chain, self.scene.poses[0].q)

    @property
    def colours(self) -> dict[str, str]:
        """Colour of each link."""
        return dict(zip(self.scene.robot.links, cycle(LINK_COLOURS), strict=False))

    @property
    def links(self) -> list[str]:
        """Link of each cone (K,)."""
        return [ring.link for ring in self.setup.rings for _ in range(ring.count)]

    def numbers(self) -> dict[str, float]:
        """Numbers in the pictures."""
        covered = self.wanted & self.seen
        return {
            "radius": self.target.radius or 0.0,
            "voxel": self.wanted.voxel,
            "shell_voxels": len(self.wanted),
            "fov_voxels": len(self.seen),
            "covered_voxels": len(covered),
            "left_voxels": len(self.wanted - self.seen),
            "shell_m3": self.wanted.volume,
            "fov_m3": self.seen.volume,
            "left_m3": (self.wanted - self.seen).volume,
            "zeta_percent": 100 * len(covered) / len(self.wanted),
        }

    def colour_at(self, points: Any) -> Any:
        """Return colours (N, 3) of the links whose cones contain points (N, 3) m most deeply."""
        c, links = self.cones, np.array(self.links)
        parts = {name: np.flatnonzero(links == name) for name in dict.fromkeys(self.links)}
        depth = [
            Cones(c.apex[k], c.axis[k], c.half_angle[k], c.range_m[k])(points)
            for k in parts.values()
        ]
        return np.array([rgb(self.colours[name]) for name in parts])[np.argmin(depth, axis=0)]


def canvas_of(ax: "Axes", view: OctreeView) -> Canvas:
    """Return a canvas for the drawings below, with an eye at infinity."""
    ax.set_aspect("equal")
    ax.axis("off")
    return Canvas(ax, view.shell.bounds(), *EYE)


def _add_robot(canvas: Canvas, view: OctreeView) -> None:
    add_robot(canvas, view.scene, view.frames, view.setup, view.colours)


def draw_discs(canvas: Canvas, view: OctreeView) -> None:
    """Draw the discs that sweep V_S: grey at bends of the pose curve, coloured on straight
    parts.
    """
    radius, shape, shades = view.target.radius or 0.0, view.scene.shape, cycle(_STRAIGHT)
    for piece in robot_curve(view.scene.robot, view.scene.poses[0].q, shape).pieces:
        t = np.linspace(0, 1, shape.points_per_bend if piece.bend else 2)
        way = piece.velocity(t)
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        rims = np.array([circle(c, n, radius) for c, n in zip(piece.point(t), way, strict=True)])
        colour = BEND_COLOUR if piece.bend else next(shades)
        canvas.lines(loops(rims), paler(colour, 0.4), 0.6)
        if not piece.bend:
            canvas.mesh(tube(rims), colour, 0.5)
            canvas.faces(rims, colour, 0.1, lit=False)
    _add_robot(canvas, view)
    canvas.draw()


def draw_cones(canvas: Canvas, view: OctreeView) -> None:
    """Draw the cones of V_FOV in the colours of their links; outlines only for cones towards
    the eye.
    """
    from matplotlib.collections import PolyCollection

    c: Any = view.cones
    towards = c.axis @ canvas.rotation[2] > _TOWARDS
    for k in np.flatnonzero(~towards):
        solid = cone(c.apex[k], c.axis[k], c.half_angle[k], c.range_m[k])
        canvas.mesh(solid, paler(view.colours[view.links[k]], 0.15), closed=True)
    _add_robot(canvas, view)
    canvas.draw()
    for k in np.flatnonzero(towards):
        base, wide = c.apex[k] + c.range_m[k] * c.axis[k], c.range_m[k] * np.tan(c.half_angle[k])
        rim = circle(base, c.axis[k], wide)
        colour = tuple(rgb(view.colours[view.links[k]]))
        outline = PolyCollection(
            [canvas.hull(np.vstack([c.apex[k], rim])), canvas.project(rim)[0]],
            facecolors=[(*colour, 0.05), (*colour, 0.08)],
            edgecolors=[(*colour, 0.25), (*colour, 0.9)],
            linewidths=[0.5, 0.9],
            zorder=3,
        )
        canvas.ax.add_collection(outline)


def _section(canvas: Canvas, view: OctreeView, kept: VoxelSet, solid: Solid, colour: Any) -> None:
    """Draw a set of voxels cut open upright along the arm, without the near half and the
    robot's V_R.
    """
    axis = int(np.argmax(np.abs(canvas.rotation[2, :2])))
    line = body(view.scene.robot, view.frames)[:, axis]
    at = round((line.min() + line.max()) / 2 / kept.voxel)  # a lattice plane
    side = np.sign(canvas.rotation[2, axis])
    rest = cut_open(kept, axis, at * kept.voxel, side)
    s = skin(rest, canvas.rotation[2])
    normal = normals(solid, s.centres, s.voxel)
    cut = s.exposed[:, axis] & (s.numbers[:, axis] == (at if side < 0 else at - 1))
    normal[cut] = side * np.eye(3)[axis]
    light = (0.5 + 0.5 * openness(s, rest)) * np.where(cut, _SECTION, 1.0)
    add_skin(canvas, s, colour(s), normal, 0.6, light)
    canvas.draw()
    _add_robot(canvas, view)  # over the voxels; those in its own volume are removed
    canvas.draw(zorder=3)


def draw_both(canvas: Canvas, view: OctreeView) -> None:
    """Draw the voxels of V_S and V_FOV, cut open.

    Covered voxels have the colours of the links, paler outside V_S.
    """
    both = Union(view.cones, view.shell.a)
    body_voxels = voxels(view.shell.b, view.seen.voxel)

    def colour(s: Any) -> Any:
        seen, wanted = (holds(v, s.numbers)[:, None] for v in (view.seen, view.wanted))
        of_link = view.colour_at(s.centres)
        return np.where(seen, np.where(wanted, of_link, paler(of_link, 0.55)), rgb(SHELL_COLOUR))

    _section(
        canvas,
        view,
        (view.wanted | view.seen) - body_voxels,
        Difference(both, view.shell.b),
        colour,
    )


def draw_left(canvas: Canvas, view: OctreeView) -> None:
    """Draw the uncovered voxels of V_S, cut open."""
    left = Difference(view.shell, view.cones)
    _section(
        canvas,
        view,
        view.wanted - view.seen,
        left,
        lambda s: np.tile(paler(UNSEEN_COLOUR, 0.1), (len(s.numbers), 1)),
    )
