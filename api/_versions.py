"""Versions that a result depends on."""

import sys
from importlib.metadata import version

PACKAGES = ("place-rings", "jax", "nlopt", "numpy", "scipy")


def versions() -> dict[str, str]:
    """The versions of Python and of the packages that results depend on."""
    return {name: version(name) for name in PACKAGES} | {"python": sys.version.split()[0]}
