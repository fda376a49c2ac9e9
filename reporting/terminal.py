"""Output to the terminal, with control and direction characters of files and users escaped.

Only the rig creates another console or calls another print; a test enforces that.
"""

import codecs
import io
import json
import logging
import sys
import threading
import traceback
import warnings
from collections.abc import Iterable
from itertools import accumulate
from types import TracebackType
from typing import Any, TextIO

from rich.console import Console, ConsoleOptions, RenderableType
from rich.protocol import rich_cast
from rich.segment import Segment
from rich.status import Status
from rich.text import Span, Text

from ..coverage.definitions.escaping import printable, printable_json, printable_lines


def say(line: str, error: bool = False) -> None:
    """Print one line to stdout, or to stderr if ``error``."""
    print(printable(line), file=sys.stderr if error else sys.stdout, flush=True)


def say_lines(text: str, error: bool = False) -> None:
    """Print text that may have several lines, each with its newline, to stdout or stderr."""
    print(printable_lines(text), end="", file=sys.stderr if error else sys.stdout, flush=True)


def say_json(text: str) -> None:
    """Print JSON with escapes that keep its data unchanged."""
    text = printable_json(text)
    if not _unicode(sys.stdout):
        text = json.dumps(json.loads(text), indent=2)
    print(text, flush=True)


class Terminal(Console):
    """A console that escapes unprintable characters and interprets neither markup nor links.

    A string is one line; a Text may have several.
    """

    def __init__(self, *, stderr: bool = False, **more: Any) -> None:
        super().__init__(stderr=stderr, markup=False, emoji=False, **more)
        if "width" not in more:
            self._width = None  # ask the terminal, or COLUMNS, whenever something is printed

    def lines(self, *texts: str | None) -> None:
        """Print each text as an unbroken line without colours, unless it is empty or None."""
        for text in filter(None, texts):
            self.print(text, highlight=False, soft_wrap=True)

    def render_str(self, text: str, **more: Any) -> Text:
        """Return a string as an escaped Text; rich calls this before it measures widths."""
        return super().render_str(printable(text), **more)

    def render(
        self,
        renderable: RenderableType,
        options: ConsoleOptions | None = None,
    ) -> Iterable[Segment]:
        """Render with every Text escaped before line breaking, and with escaped segments."""
        found = rich_cast(renderable)
        segments = super().render(_escaped(found) if isinstance(found, Text) else found, options)
        return (s if s.control else _clean(s) for s in segments)

    def status(self, status: RenderableType, **more: Any) -> Status:
        """Return a spinner beside a text without markup."""
        return _Status(_plain(status), console=self, **more)


class _Status(Status):
    """A status that also takes later texts without markup."""

    def update(self, status: RenderableType | None = None, **more: Any) -> None:
        super().update(None if status is None else _plain(status), **more)


def _plain(text: RenderableType) -> RenderableType:
    return Text(printable(text)) if isinstance(text, str) else text


def _escaped(text: Text) -> Text:
    """Return ``text`` escaped between its newlines, with its styles moved accordingly."""
    parts = [c if c == "\n" else printable(c) for c in text.plain]
    at = [0, *accumulate(map(len, parts))]
    if at[-1] == len(text.plain):
        return text
    last = len(parts)
    found = text.blank_copy("".join(parts))
    found.spans = [Span(at[min(s.start, last)], at[min(s.end, last)], s.style) for s in text.spans]
    return found


def _clean(segment: Segment) -> Segment:
    text, style = segment.text, segment.style
    if style is not None and style.link is not None:
        style = style.update_link(None)
    if text == "\n" or text.isprintable():
        return segment if style is segment.style else Segment(text, style)
    return Segment(printable_lines(text), style)


_PLAIN = {"ζ": "zeta", "°": " deg", "±": "+-", "…": "...", "–": "-", "−": "-", "×": "x", "²": "^2"}
_PLAIN |= {"³": "^3", "µ": "u", "σ": "sigma", "→": "->", "✗": "x", "≥": ">=", "≤": "<="}


def _replaced(error: UnicodeError) -> tuple[str, int]:
    """Replace characters that an encoding lacks by ASCII text, others by ``?``."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    lacking = error.object[error.start : error.end]
    return "".join(_PLAIN.get(c, "?") for c in lacking), error.end


def _unicode(stream: TextIO) -> bool:
    return (getattr(stream, "encoding", None) or "utf-8").lower().startswith("utf")


def guard() -> None:
    """Escape what Python itself prints: tracebacks, warnings, logs without a handler.

    The package's own deprecations are printed too, each in one line. Characters that stdout and
    stderr cannot encode are replaced.
    """
    codecs.register_error("place_rings", _replaced)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper) and not _unicode(stream):
            stream.reconfigure(errors="place_rings")
    sys.excepthook, threading.excepthook = _uncaught, _uncaught_in_thread
    before = warnings.formatwarning

    def formatted(message: Warning | str, category: type[Warning], *where: Any, **more: Any) -> str:
        own = category is DeprecationWarning and not sys.warnoptions
        text = f"place-rings: {message}\n" if own else before(message, category, *where, **more)
        return printable_lines(text)

    warnings.formatwarning = formatted
    if not sys.warnoptions:
        warnings.filterwarnings("default", module="place_rings", category=DeprecationWarning)
    if logging.lastResort is not None:
        logging.lastResort.setFormatter(_Printable())


def _uncaught(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
    say_lines("".join(traceback.format_exception(kind, error, trace)), error=True)


def _uncaught_in_thread(found: threading.ExceptHookArgs) -> None:
    if found.exc_value is not None and not isinstance(found.exc_value, SystemExit):
        name = "a thread" if found.thread is None else found.thread.name
        say(f"Exception in thread {name}:", error=True)
        _uncaught(found.exc_type, found.exc_value, found.exc_traceback)


class _Printable(logging.Formatter):
    """Format log records as escaped lines."""

    def format(self, record: logging.LogRecord) -> str:
        return printable_lines(super().format(record))
