"""Messages to a browser that leaves meanwhile."""

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def closing() -> Iterator[None]:
    """Go on where the browser left meanwhile: viser warns of messages that come too late, and a
    warning may be an error.
    """
    try:
        yield
    except UserWarning as warning:
        if "closed connection" not in str(warning):
            raise
