"""The map of the largest unseen sphere about each place of a target, as a page shows it."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from ..coverage.occlusion.occlusion_mode import Occlusion
from ..coverage.rings.ring import Setup
from ..coverage.solids.capsules import Capsules
from ..coverage.targets.target import Target
from ..coverage.voxels.largest_object import largest_object
from ..coverage.voxels.object_map import places
from ..coverage.voxels.object_room import BALL
from ..objectives.gap_map import GapMap
from ..objectives.object_bounds import ObjectBounds
from ..objectives.scene import Scene
from ..objectives.smallest_object import SIDE, WIDTH
from ..reporting.rendering.meshes import capsule_surfaces, tube
from .colours import LARGEST, SPHERES
from .drawing import Dots, DrawnMesh, Item
from .drawn_parts import DrawnParts

_STEPS = (5, 10, 20, 25, 35, 50, 100, 200)  # mm, of the classes of diameters
_ROD = 0.3  # m, of rods, which are not shown
_VEIL = 0.45  # opacity of the largest sphere
_DIGITS = 6  # decimals of m to which layers of places are the same
_DOT = 0.4  # of the distance of neighbours


@dataclass(frozen=True)
class UnseenSpheres:
    """The largest unseen sphere about each of N places of a target, and the largest of all."""

    setup: Setup
    """The setup."""
    target: Target
    """The target."""
    pose: int
    """Index of the pose."""
    occlusion: Occlusion
    """Model of occlusion."""
    places: Float[np.ndarray, "N 3"]
    """Places that no sensor sees for sure, m."""
    diameters: Float[np.ndarray, "2 N"]
    """Bounds of the diameter about each, m."""
    spacing: float
    """Distance of neighbours, m."""
    unseen: float
    """Share of these places among all of the target."""
    largest: ObjectBounds
    """Bounds of the largest diameter."""

    def of(self, setup: Setup, choice: DrawnParts) -> bool:
        """Return whether these are of a setup as a page shows it."""
        own = self.setup, self.target, self.pose, self.occlusion
        return own == (setup, choice.target, choice.pose, choice.occlusion)

    @property
    def step(self) -> int:
        """Width of a class of diameters, mm."""
        most = 1000 * float(self._middle.max(initial=0.0))
        return next((s for s in _STEPS if s * len(SPHERES) > most), _STEPS[-1])

    @property
    def kind(self) -> Int[np.ndarray, " N"]:
        """Class of the diameter about each place, by the middle of its bounds."""
        kind: np.ndarray = (1000 * self._middle / self.step).astype(int)
        kind = np.minimum(kind, len(SPHERES) - 1)
        return kind

    @property
    def _middle(self) -> Float[np.ndarray, " N"]:
        middle: np.ndarray = self.diameters.mean(axis=0)
        return middle

    def items(self, choice: DrawnParts) -> dict[str, Item]:
        """Draw the places, class by class, and the largest sphere."""
        cut = choice.cut
        shown = np.ones(len(self.places), bool) if cut is None else cut.keeps(self.places)
        found: dict[str, Item] = {
            f"spheres{k}": Dots(self.places[some], colour, _DOT * self.spacing)
            for k, colour in enumerate(SPHERES)
            if (some := shown & (self.kind == k)).any()
        }
        if self.largest.centre is not None:
            centre, radius = np.array([self.largest.centre]), np.array([self.largest.low / 2])
            (surface,) = capsule_surfaces(Capsules(centre, centre, radius), tube)
            found["largest"] = DrawnMesh(*surface, LARGEST, _VEIL)
        return found


def unseen_spheres(
    scene: Scene, setup: Setup, choice: DrawnParts, tell: Callable[[str, float], None]
) -> UnseenSpheres:
    """Return the map of a setup for what a page shows.

    Args:
        scene: the scene.
        setup: the setup.
        choice: target, pose and model of occlusion.
        tell: called with the progress; an exception from it ends the work.

    Raises:
        ValueError: if the target is empty.
    """
    tell("finding what no sensor sees", 0.0)
    here = replace(scene, occlusion=choice.occlusion)
    gaps = GapMap.of(here, setup, choice.target, choice.pose, SIDE, _ROD)
    tell("measuring the spheres about each place", 0.3)
    where = places(gaps.grid)
    bounds = gaps.diameters(where)
    tell("finding the largest sphere", 0.6)
    largest = ObjectBounds.of(largest_object(gaps.grid, BALL, WIDTH / 2), choice.pose)
    unseen = np.flatnonzero(bounds[1] > 0)
    box = np.ptp(gaps.solid.bounds(), axis=0)
    apart = float((np.prod(box) / max(len(where), 1)) ** (1 / 3))
    layers = np.unique(where[:, 2].round(_DIGITS))
    spacing = float(np.diff(layers).min(initial=apart))
    return UnseenSpheres(
        setup,
        choice.target,
        choice.pose,
        choice.occlusion,
        where[unseen],
        bounds[:, unseen],
        spacing,
        len(unseen) / max(len(where), 1),
        largest,
    )
