"""The questions of the benchmark: scenes, budgets of sensors and what counts, as data.

A version of the questions is frozen. A test holds each question to its fingerprint and its stored
answers to their counts, so that scores of different days can be compared.
"""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import tomli_w

from ...coverage.definitions.definition import adapter
from ...coverage.definitions.errors import UserError, shown
from ...coverage.detection.detection import Detection
from ...formats.toml_text import toml_keys
from ...objectives.criterion import Criterion
from ...objectives.scene import Scene

FILE = Path(__file__).parent / "questions.toml"


@dataclass(frozen=True)
class Question:
    """A scene and a budget of sensors. An answer is a setup of rings."""

    name: str
    """Name of the question."""
    title: str
    """What it asks for, in a few words."""
    sensors: int
    """Largest number of sensors."""
    scene_keys: Mapping[str, Any]
    """Keys in which the scene differs from the reference scene, as in a scene file."""
    detect: Mapping[str, Any] | None = None
    """What must be noticed, and how fast; None: coverage counts."""

    @cached_property
    def scene(self) -> Scene:
        """The scene."""
        scene: Scene = adapter(Scene).validate_python(dict(self.scene_keys))
        return scene

    @cached_property
    def aim(self) -> Criterion:
        """What is maximised."""
        return Criterion(detection=None if self.detect is None else Detection(**self.detect))

    @property
    def fingerprint(self) -> str:
        """The first 16 digits of the SHA-256 of what defines the question."""
        keys = [self.sensors, self.scene_keys, self.detect]
        text = json.dumps(keys, sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    @property
    def file(self) -> str:
        """The scene as a file (TOML), with the question in its comment lines."""
        criterion = "coverage" if self.detect is None else f"{self.aim}"
        head = (
            f"# {self.name}: {self.title}. Benchmark version {VERSION}.\n"
            f"# At most {self.sensors} sensors, in rings. What counts: {criterion}.\n"
        )
        return head + tomli_w.dumps(self.scene_keys)


def _questions() -> tuple[int, dict[str, Question]]:
    keys = toml_keys(FILE.read_text("utf-8"))
    version = keys.pop("version")
    return version, {
        name: Question(name, q["title"], q["sensors"], q["scene"], q.get("detect"))
        for name, q in keys.items()
    }


VERSION, QUESTIONS = _questions()
"""Version of the questions, and the questions by name."""


def question_named(name: str, where: str) -> Question:
    """Return the question of a name.

    Raises:
        UserError: if there is none; the message begins with ``where``.
    """
    if name not in QUESTIONS:
        raise UserError(f"{where}: found {shown(name)}, allowed: {', '.join(QUESTIONS)}")
    return QUESTIONS[name]
