"""Scenes and setups from the JSON data of a cell."""

from collections.abc import Mapping
from typing import Any

from ...coverage.definitions.definition import adapter
from ...coverage.rings.ring import Setup
from ...coverage.rings.rounding import table_of, with_scene
from ...coverage.sensors.sensor import Sensor
from ...coverage.targets.target import Target
from ...formats.schema.proposal_models import stated_scene
from ...formats.schema.versions import in_files
from ...objectives.named_layouts import layout_in
from ...objectives.scene import Scene

Rings = list[dict[str, Any]]
"""Rings as in a proposal file."""
Sensors = Mapping[str, list[dict[str, Any]]]
"""Rings and single sensors as in a proposal file, by its keys ``rings`` and ``sensors``."""


def goal_keys(target: Target) -> dict[str, Any]:
    """Return the keys of a target in a scene."""
    name, radius = target.key
    return {"name": name} | ({} if radius is None else {"radius": radius})


def ring_keys(setup: Setup, sensor: Sensor) -> Rings:
    """Return the rings of a setup as in a proposal file, in a scene with this sensor."""
    rings: Rings = table_of(setup, sensor, lean=True)["rings"]
    return rings


def scene_from(scene: Mapping[str, Any]) -> Scene:
    """Return a scene from the keys in which it differs from the paper's scene, as in a scene file:
    transparent bodies, and rings without bodies, unless the keys say otherwise.
    """
    keys = dict(scene)
    rules = {"mount": "free"} | keys.get("rules", {})
    stated = {"occlusion": "ignore"} | keys | {"rules": rules}
    read: Scene = adapter(Scene).validate_python(stated)
    return read


def keys_of(scene: Scene) -> dict[str, Any]:
    """Return the keys of a scene as in a proposal file, with its mounts."""
    keys = stated_scene(adapter(Scene).dump_python(in_files(scene), mode="json"))
    return keys | {"rules": keys.get("rules", {}) | {"mount": scene.rules.mount}}


def setup_from(setup: str | Rings | Sensors, scene: Scene) -> Setup:
    """Return a setup from the paper's name, or from rings and single sensors as in a proposal
    file."""
    if isinstance(setup, str):
        return layout_in(scene, setup)
    keys: Sensors = {"rings": setup} if isinstance(setup, list) else setup
    stated = adapter(Setup).validate_python(keys)
    return with_scene(stated, scene.sensor, scene.default_radius)


def asked_from(
    scene: Scene, setup: str | Rings | Sensors, target: str, radius: float | None
) -> tuple[Setup, Target]:
    """Return the setup and the target that a cell asks about, in its scene."""
    return setup_from(setup, scene), scene.target_named(target, radius)


def setup_keys(setup: Setup, scene: Scene) -> dict[str, list[dict[str, Any]]]:
    """Return the rings and single sensors of a setup as in a proposal file."""
    return table_of(setup, scene.sensor, lean=True)
