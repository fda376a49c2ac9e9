"""Arguments of the API by the names of the options that give them."""

_OPTIONS = {
    "folder": "--out",
    "memory_gb": "--memory",
    "over_poses": "--worst",
    "reach_percent": "--reach",
    "targets": "--target",
    "time_cap": "--time",
}


def option_of(argument: str) -> str:
    """The option that gives an argument of the API."""
    return _OPTIONS.get(argument, f"--{argument.replace('_', '-')}")
