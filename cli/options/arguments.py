"""Map arguments of the Python API to the command-line options that set them."""

_OPTIONS = {
    "folder": "--out",
    "layouts": "--layout",
    "over_poses": "--worst",
    "safety": "[safety] of the scene",
    "targets": "--target",
}


def option_of(argument: str) -> str:
    """Return the option that sets an argument of the API."""
    return _OPTIONS.get(argument, f"--{argument.replace('_', '-')}")
