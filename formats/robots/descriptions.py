"""Robots by the names of robot_descriptions, in the copies that this package keeps on disk.

A module of that package states where a robot's files are, and clones their repository when it is
imported. Here a module runs without that: it finds the copy of an earlier import, or says how to
make one.
"""

import difflib
import importlib
import importlib.util
import os
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from ...coverage.definitions.errors import UserError, shown, unusable
from .xml_text import some

XACRO = ".xacro"
SUFFIXES = (".urdf", ".xml", XACRO)
"""Suffixes of the files that describe a robot: URDF, MJCF and xacro."""
_PACKAGE = "robot_descriptions"
_ENDING = "_description"
_FILES = ("URDF_PATH", "XACRO_PATH", "MJCF_PATH")
_VARIANTS = ("URDF_PATH_", "XACRO_ARGS_", "MJCF_PATH_")


@dataclass(frozen=True)
class Description:
    """The files of a robot."""

    path: Path
    """Its URDF, xacro or MJCF file."""
    arguments: dict[str, str]
    """Arguments of the xacro file."""
    packages: tuple[Path, ...]
    """Folders that are packages, or hold packages."""
    named: dict[str, Path]
    """Folders of packages by the packages' names."""


def is_description(text: str) -> bool:
    """Return whether a text has the form of a name: ``ur5e_description``, or with a variant behind
    it, ``fr3_description:no_hand``."""
    return text.partition(":")[0].endswith(_ENDING)


def is_robot_source(text: str) -> bool:
    """Return whether a text stands for a robot's description: a file, or a name."""
    return text.lower().endswith(SUFFIXES) or is_description(text)


def find_description(text: str) -> Description:
    """Return the files of a robot by its name.

    Raises:
        UserError: if the name is unknown, or its files are not on this machine.
    """
    name, _, variant = text.partition(":")
    module = _module(name)
    values = {key: value for key, value in vars(module).items() if key.isupper()}
    which = next((key for key in _FILES if key in values), None)
    if which is None:
        raise unusable("robot", text, f"a name of {_PACKAGE} with a URDF or MJCF")
    arguments = dict(values.get("XACRO_ARGS", {}))
    if variant:
        variants = {k.split("_", 2)[2].lower(): k for k in values if k.startswith(_VARIANTS)}
        if variant not in variants:
            raise unusable("robot", text, f"a variant of {name}: {some(list(variants)) or 'none'}")
        if variants[variant].startswith("XACRO_ARGS_"):
            arguments |= values[variants[variant]]
        else:
            which = variants[variant]
    path, folders = Path(values[which]), (values["PACKAGE_PATH"], values["REPOSITORY_PATH"])
    if not path.is_file():
        raise UserError(f"robot: {text}: found no file {path}; {_fetch(name, again=True)}")
    named = {key: Path(folder) for key, folder in values.get("XACRO_PACKAGE_PATHS", {}).items()}
    return Description(path, arguments, tuple(map(Path, dict.fromkeys(folders))), named)


def _module(name: str) -> ModuleType:
    """Return the module of a name, run without a download."""
    if importlib.util.find_spec(_PACKAGE) is None:
        raise UserError(
            f"robot: {shown(name)} is a name of {_PACKAGE}, which is not installed: pip install"
            " 'place-rings[robots]'"
        )
    known = importlib.import_module(f"{_PACKAGE}._descriptions").DESCRIPTIONS
    if name not in known:
        near = difflib.get_close_matches(name, list(known), 3)
        allowed = f"a name of {_PACKAGE}" + f", such as {', '.join(near)}" * bool(near)
        raise unusable("robot", name, allowed)
    spec = importlib.util.find_spec(f"{_PACKAGE}.{name}")
    if spec is None or spec.loader is None:
        raise unusable("robot", name, f"a name with a module in {_PACKAGE}")
    module = importlib.util.module_from_spec(spec)
    with _no_download(name), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of names that are about to change
        try:
            spec.loader.exec_module(module)
        except OSError as error:  # a few modules read files of the robot
            line = f"{error.filename}: {error.strerror}"
            raise UserError(f"robot: {name}: {line}; {_fetch(name, again=True)}") from error
    return module


@contextmanager
def _no_download(name: str) -> Iterator[None]:
    """Run modules of robot_descriptions with copies on disk only."""
    repositories = importlib.import_module(f"{_PACKAGE}._repositories").REPOSITORIES
    folder = os.environ.get("ROBOT_DESCRIPTIONS_CACHE", "~/.cache/robot_descriptions")

    def on_disk(repository: str, commit: str | None = None) -> str:
        at = repositories[repository].cache_path
        copy = Path(folder).expanduser() / (f"{at}-{commit}/{at}" if commit else at)
        if not copy.is_dir():
            raise UserError(f"robot: {name} is not on this machine; {_fetch(name)}")
        return str(copy)

    cache, key = ModuleType(f"{_PACKAGE}._cache"), f"{_PACKAGE}._cache"
    cache.clone_to_cache = on_disk  # type: ignore[attr-defined]
    before = sys.modules.get(key)
    sys.modules[key] = cache
    try:
        yield
    finally:
        sys.modules.pop(key)
        if before is not None:
            sys.modules[key] = before


def _fetch(name: str, again: bool = False) -> str:
    """Return the command that fetches a robot's files."""
    return f"fetch it{' again' * again}: python -c 'import {_PACKAGE}.{name}'"
