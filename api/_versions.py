"""Versions of the software that affects results."""

import sys
from importlib.metadata import version

PACKAGES = ("place-rings", "jax", "nlopt", "numpy", "scipy")


def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that affect results."""
    return {name: version(name) for name in PACKAGES} | {"python": sys.version.split()[0]}
