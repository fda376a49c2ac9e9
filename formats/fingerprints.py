"""Hashes by which a reader checks that a report belongs to a file and a scene."""

import hashlib
from pathlib import Path

from ..coverage.definitions.definition import adapter
from ..objectives.scene import Scene


def file_sha256(name: str) -> str:
    """Return the SHA-256 of a file in hexadecimal; empty if there is no such file."""
    try:
        return hashlib.sha256(Path(name).read_bytes()).hexdigest()
    except (OSError, ValueError):
        return ""


def scene_sha256(scene: Scene) -> str:
    """Return the SHA-256 of a scene's record as JSON, in hexadecimal."""
    return hashlib.sha256(adapter(Scene).dump_json(scene)).hexdigest()
