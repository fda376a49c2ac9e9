"""Map arguments of the Python API to the command-line options that set them."""

_OPTIONS = {
    "folder": "--out",
    "memory_gb": "--memory",
    "over_poses": "--worst",
    "reach_percent": "--reach",
    "safety": "[safety] of the scene",
    "targets": "--target",
    "time_cap": "--time",
    "within_points": "--within",
}


def option_of(argument: str) -> str:
    """Return the option that sets an argument of the API."""
    return _OPTIONS.get(argument, f"--{argument.replace('_', '-')}")
