"""Version of a file: the meaning of its keys and of absent keys.

A file states its version; a file without one predates versions and counts as version 1. The version
is read before any default applies, so that an older file keeps its meaning: ``UPGRADES`` converts
its keys to the next version, step by step. A newer file is rejected. A scene is written by hand and
seldom states its version; without one it has today's meaning.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import AfterValidator, Field, ValidationInfo, model_validator
from pydantic_core import core_schema

from ...coverage.definitions.definition import refuse
from ...coverage.definitions.errors import UserError
from ...coverage.definitions.records import FILE_VERSION
from ...coverage.robots.robot_table import RobotInFiles
from ...coverage.sensors.effective_range import OwnModel
from ...objectives.scene import Scene
from .base_model import StrictModel

_UNSTATED = 1
FROM_FILE = {"from_file": True}
"""Context for ``model_validate`` of data read from a file; keys built in code have the current
version."""


class VersionedFile(StrictModel):
    """A file with a version."""

    version: int = Field(
        default=FILE_VERSION,
        ge=1,
        description="version of the meaning of the keys; 1 if absent",
        json_schema_extra={"default": _UNSTATED, "maximum": FILE_VERSION},
    )

    @model_validator(mode="before")
    @classmethod
    def _of_today(cls, keys: Any, info: ValidationInfo) -> Any:
        if not isinstance(keys, dict):
            return keys
        version = keys.get("version", _UNSTATED if info.context == FROM_FILE else FILE_VERSION)
        if type(version) is not int or version < 1:
            return keys  # the field's own validation reports the error
        refuse_newer(keys)
        keys = dict(keys)
        for step in range(version, FILE_VERSION):
            keys = UPGRADES[step](keys)
        return keys | {"version": FILE_VERSION}


@dataclass(frozen=True, eq=False)
class Versioned:
    """Annotation of a definition that is a file of its own, with a version."""

    upgrade: "Upgrade | None" = None
    """Converts the keys of a file that states version 1; None: their meaning never changed."""

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        inner = handler(source)

        def read(keys: Any) -> Any:
            if not isinstance(keys, dict):
                return keys
            version = keys.get("version", FILE_VERSION)
            if type(version) is not int or version < 1:
                refuse([(("version",), version, f"an integer from 1 to {FILE_VERSION}")])
            refuse_newer(keys)
            keys = {key: value for key, value in keys.items() if key != "version"}
            return self.upgrade(keys) if self.upgrade and version < FILE_VERSION else keys

        return core_schema.no_info_before_validator_function(
            read,
            inner,
            serialization=core_schema.wrap_serializer_function_ser_schema(
                lambda value, dump: {"version": FILE_VERSION} | dump(value), schema=inner
            ),
        )

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> Any:
        table = handler.resolve_ref_schema(handler(schema))
        version = VersionedFile.model_json_schema()["properties"]["version"]
        if self.upgrade is not None:
            text = "version of the meaning of the keys; today's if absent"
            version |= {"default": FILE_VERSION, "description": text}
        return table | {"properties": {"version": version} | table["properties"]}


Upgrade = Callable[[dict[str, Any]], dict[str, Any]]


def _with_envelopes(keys: dict[str, Any]) -> dict[str, Any]:
    """Return the keys of a file of version 1, in which a ring's body had two stated sizes.

    The scene of such a file states what its defaults were. Rings with bodies on a UR10 sat on the
    axis between two joints, which today only rings without bodies do: those of a proposal stay
    there, whatever its scene states.
    """
    if "scene" in keys:
        return keys | {"scene": _scene_with_envelopes(keys["scene"], "rings" in keys)}
    return keys


def _scene_with_envelopes(scene: Any, has_rings: bool = False) -> Any:
    if not isinstance(scene, dict) or not isinstance(scene.get("rules", {}), dict):
        return scene
    rules = {k: v for k, v in scene.get("rules", {}).items() if k not in _SIZES}
    occlusion = scene.get("occlusion", "ignore")
    between_joints = scene.get("robot", "ur10") in ("ur10", "ur10_dh")
    rules = {"mount": "free" if between_joints or occlusion == "ignore" else "real"} | rules
    if between_joints and has_rings and rules["mount"] == "real":
        rules["mount"] = "free"
    return scene | {"occlusion": occlusion, "rules": rules}


_SIZES = ("ring_thickness", "ring_width")
UPGRADES: dict[int, Upgrade] = {1: _with_envelopes}
"""For each version, the function that converts the keys of a file to the next version."""


def refuse_newer(keys: dict[str, Any]) -> None:
    """Raise ValidationError if ``keys`` have a version that is not known yet."""
    version = keys.get("version")
    if type(version) is int and version > FILE_VERSION:
        known = "1" if FILE_VERSION == 1 else f"1 to {FILE_VERSION}"
        refuse([(("version",), version, f"{known}; update place-rings to read newer files")])


def in_files(scene: Scene) -> Scene:
    """Return a scene that files can hold.

    Raises:
        UserError: if no file can hold a target, as a function.
    """
    if not all(part.in_files for goal in scene.targets for part in goal.parts()):
        raise UserError("a target by a function of Python's cannot be written to a file")
    return scene


SceneInFiles = Annotated[Scene, AfterValidator(in_files)]
"""A scene within a file."""
SceneFile = Annotated[Scene, Versioned(_scene_with_envelopes)]
"""A scene (TOML). Every key has a default: the empty file is the reference scene."""
RobotFile = Annotated[RobotInFiles, Versioned()]
"""A robot (TOML): a chain of joints, mount axes, and capsules that enclose its links."""
SensorFile = Annotated[OwnModel, Versioned()]
"""A user's own sensor (TOML): the fields of the catalogue, for one mode of the sensor."""
