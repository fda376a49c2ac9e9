"""Searches with few words: a context made from options, for tests."""

import time
from typing import Any

from place_rings.coverage.rings.ring import Setup
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import Verifier
from place_rings.placement.redesign import redesign
from place_rings.placement.redesign.beam_search import BeamPlan
from place_rings.placement.search import search as searching
from place_rings.placement.search import several_searches
from place_rings.placement.search.context import SearchContext
from place_rings.placement.search.options import ImproveOptions, SearchOptions
from place_rings.placement.search.result import FewestRings, Reach, SearchResult
from place_rings.placement.space.design import Space
from place_rings.placement.stop_token import StopToken

_CONTEXT = ("aim", "tell", "schedule", "points")


def questioned(
    scene: Scene, cap: float = float("inf"), clock: Any = time.monotonic, **given: Any
) -> tuple[SearchOptions, SearchContext]:
    """Return options and a context by keywords; ``cap``: limit of the clock, s."""
    there = {name: given.pop(name) for name in _CONTEXT if name in given}
    options = SearchOptions(**given)
    brake = StopToken(cap, clock)
    return options, SearchContext(Verifier(scene, options.voxel), brake=brake, **there)


def search(space: Space, **given: Any) -> SearchResult:
    """Search a space."""
    return searching.search(space, *questioned(space.scene, **given))


def fewest_sensors(scene: Scene, reach: float, **given: Any) -> Reach:
    """Search for the fewest sensors that reach a coverage, percent."""
    return several_searches.fewest_sensors(*questioned(scene, reach=reach, **given))


def fewest_rings(scene: Scene, sensors: int, **given: Any) -> FewestRings:
    """Search for the fewest rings."""
    asked = questioned(scene, sensors=sensors, **given)
    return several_searches.fewest_rings(Space(scene, sensors=sensors), *asked)


def improve(
    scene: Scene, mounted: Setup, plan: BeamPlan | None = None, **given: Any
) -> redesign.Improved:
    """Improve a mounted setup."""
    options = ImproveOptions(**given)
    context = SearchContext(Verifier(scene, options.voxel))
    return redesign.improve(mounted, options, context, plan)
