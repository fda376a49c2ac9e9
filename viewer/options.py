"""The options of the viewer: defined once, for Python and the command."""

from dataclasses import dataclass
from typing import Annotated

from ..coverage.definitions.options import Options, Whole

LOOPBACK = "127.0.0.1"


@dataclass(frozen=True, kw_only=True)
class ViewOptions(Options):
    """Options of the viewer."""

    host: str = LOOPBACK
    """Address to serve on; the default serves this machine only. The page opens at its whole
    address only, whose last part is a random token."""
    port: Annotated[int, Whole(0, 65535)] = 0
    """Port to serve on; 0 selects a free one."""
    browser: bool = True
    """Open the page in a browser."""
