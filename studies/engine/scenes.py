"""Scenes and setups from the JSON data of a cell."""

from collections.abc import Mapping
from typing import Any

from ...coverage.rings.ring import Setup
from ...formats.schema.ring_models import RingModel, setup_of
from ...formats.schema.scene_models import SceneModel
from ...objectives.named_layouts import layout_in
from ...objectives.scene import CoreScene

Rings = list[dict[str, Any]]
PAPERS_WORLD = "As in the paper, beams pass through the robot, and rings need no room on it."
"""Sentence for the pages of studies in the paper's scene."""


def scene_from(scene: Mapping[str, Any]) -> CoreScene:
    """Return a scene from the keys in which it differs from the paper's scene, as in a scene file:
    transparent bodies, and rings without bodies, unless the keys say otherwise.
    """
    keys = dict(scene)
    rules = {"mount": "free"} | keys.get("rules", {})
    return SceneModel.model_validate({"occlusion": "ignore"} | keys | {"rules": rules}).to_domain()


def setup_from(setup: str | Rings, scene: CoreScene) -> Setup:
    """Return a setup from the paper's name, or from rings as in a proposal file."""
    if isinstance(setup, str):
        return layout_in(scene, setup)
    return setup_of(
        [RingModel.model_validate(ring) for ring in setup], scene.sensor, scene.ring_radius
    )
