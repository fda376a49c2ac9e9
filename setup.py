"""Packages by rule: every folder here with an ``__init__.py`` is a room, but the tests; all that
lies in it is installed.

A room ``x`` is installed as ``place_rings.x``, and ``api`` as ``place_rings`` itself. What else
there is to say stands in pyproject.toml.
"""

from pathlib import Path

from setuptools import setup

ROOT = Path(__file__).parent
FRONT = "api"  # the room that is installed as the package itself
ROOMS = sorted(
    file.parent.name for file in ROOT.glob("*/__init__.py") if file.parent.name != "tests"
)
FOLDERS = [
    file.parent.relative_to(ROOT)
    for room in ROOMS
    for file in sorted((ROOT / room).rglob("__init__.py"))
]


def installed_as(parts: tuple[str, ...]) -> str:
    """The package that a folder is installed as."""
    return ".".join(("place_rings", *(parts[1:] if parts[0] == FRONT else parts)))


setup(
    packages=[installed_as(folder.parts) for folder in FOLDERS],
    package_dir={installed_as((room,)): room for room in ROOMS},
)
