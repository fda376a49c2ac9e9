"""Optional libraries: check whether they are installed, and report how to install them."""

from importlib.util import find_spec

from ..coverage.definitions.errors import UserError

_WHERE = {"rig": " on Python 3.11 or 3.12"}  # restrictions of an extra


def how_to_install(extra: str) -> str:
    """Return the command that installs an extra."""
    return f"pip install 'place-rings[{extra}]'{_WHERE.get(extra, '')}"


def require(extra: str, user: str, *modules: str) -> None:
    """Check that the libraries of an extra are installed, without loading them.

    Args:
        extra: the extra that installs them.
        user: the command or option that needs them.
        modules: their import names.

    Raises:
        UserError: if one is missing; the message states how to install the extra.
    """
    if absent := [name for name in modules if find_spec(name) is None]:
        raise UserError(
            f"{user}: needs {', '.join(absent)}, not installed: {how_to_install(extra)}"
        )
