"""Packages by rule: every folder here with an ``__init__.py`` is a room, but the tests; all that
lies in it is installed.

A room ``x`` is installed as ``place_rings.x``. What else there is to say stands in pyproject.toml.
"""

from pathlib import Path

from setuptools import setup

ROOT = Path(__file__).parent
ROOMS = sorted(
    file.parent.name for file in ROOT.glob("*/__init__.py") if file.parent.name != "tests"
)
FOLDERS = [
    file.parent.relative_to(ROOT)
    for room in ROOMS
    for file in sorted((ROOT / room).rglob("__init__.py"))
]

setup(
    packages=[".".join(("place_rings", *folder.parts)) for folder in FOLDERS],
    package_dir={f"place_rings.{room}": room for room in ROOMS},
)
