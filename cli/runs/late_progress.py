"""Progress bars that appear only when work starts, so that earlier errors stand alone."""

from collections.abc import Iterator
from contextlib import contextmanager

from ...reporting.progress import ProgressBar
from ...reporting.terminal import Terminal


@contextmanager
def late_progress(console: Terminal) -> Iterator[ProgressBar]:
    """Return a bar that the caller starts; it disappears at the end."""
    bar = ProgressBar(console)
    try:
        yield bar
    finally:
        if bar.started:
            bar.stop()
