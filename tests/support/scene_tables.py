"""Scenes as the tables of their files."""

from typing import Any

from place_rings.coverage.definitions.definition import adapter
from place_rings.formats.schema.versions import SceneFile, in_files
from place_rings.formats.writing import to_toml
from place_rings.objectives.scene import Scene


def scene_table(scene: Scene) -> dict[str, Any]:
    """Return the keys of a scene in a file, without a version."""
    return adapter(Scene).dump_python(in_files(scene), mode="json")


def scene_of_table(table: dict[str, Any]) -> Scene:
    """Return the scene of the keys of a file, with or without a version."""
    return adapter(SceneFile).validate_python(table)


def reread(scene: Scene) -> Scene:
    """Return a scene as a file states it."""
    return scene_of_table(scene_table(scene))


def scene_toml(scene: Scene) -> str:
    """Return the text of a scene's file."""
    return to_toml(in_files(scene), file=SceneFile)
