"""Progress bars that appear with the first report, so that an error before it stands alone."""

from collections.abc import Iterator
from contextlib import contextmanager

from ...reporting.progress import ProgressBar
from ...reporting.terminal import Terminal


@contextmanager
def late_progress(console: Terminal) -> Iterator[ProgressBar]:
    """A bar that the caller starts; it is gone at the end."""
    bar = ProgressBar(console)
    try:
        yield bar
    finally:
        if bar.started:
            bar.stop()
