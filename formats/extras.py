"""Libraries that only some commands need: what to install where one is absent."""

from importlib.util import find_spec

from .errors import UserError

_WHERE = {"rig": " on Python 3.11 or 3.12"}  # where an extra can be installed, if not everywhere


def how_to_install(extra: str) -> str:
    """The command that installs an extra."""
    return f"pip install 'place-rings[{extra}]'{_WHERE.get(extra, '')}"


def require(extra: str, user: str, *modules: str) -> None:
    """Check that libraries of an extra are installed, without loading them.

    Args:
        extra: the name of the extra that installs them.
        user: the command or option that needs them.
        modules: the names by which they are imported.

    Raises:
        UserError: if one is absent; it says how to install the extra.
    """
    if absent := [name for name in modules if find_spec(name) is None]:
        raise UserError(
            f"{user}: needs {', '.join(absent)}, not installed: {how_to_install(extra)}"
        )
