"""Versions of the software that affects results."""

import sys
from datetime import UTC, datetime
from importlib.metadata import version
from typing import Any

PACKAGES = ("place-rings", "jax", "nlopt", "numpy", "scipy")


def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that affect results."""
    return {name: version(name) for name in PACKAGES} | {"python": sys.version.split()[0]}


def origin(call: str) -> dict[str, Any]:
    """Return what the record of a search that has just ended states of its origin."""
    created = datetime.now(UTC).isoformat(timespec="seconds")
    return {"command": call, "created": created, "versions": versions()}
