"""Progress bars that appear with the first report, so that what is refused before stands alone."""

from collections.abc import Iterator
from contextlib import contextmanager

from rich.progress import Progress, ProgressColumn

from ...reporting.terminal import Terminal


@contextmanager
def late_progress(console: Terminal, *columns: ProgressColumn | str) -> Iterator[Progress]:
    """A transient bar that its user starts; it is gone at the end."""
    bar = Progress(*columns, console=console, transient=True)
    try:
        yield bar
    finally:
        if bar.live.is_started:
            bar.stop()
