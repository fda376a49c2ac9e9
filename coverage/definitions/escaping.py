"""Escapes for control, direction and other invisible characters in text of files and users.

A terminal executes control characters: ESC ] sets its title. A direction character like U+202E
reorders the text after it. ``str.isprintable`` decides. It is false for control and format
characters, separators other than the space, surrogates, private and unassigned characters.

Use these functions wherever a person reads a text. Files for programs keep their data.
"""

import json


def printable(text: str) -> str:
    r"""Return ``text`` as one line with escapes like ``\x1b``, ``\n`` and ``\u202e``."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


def printable_lines(text: str) -> str:
    """Return ``text`` with its newlines and with ``printable`` lines."""
    return "\n".join(map(printable, text.split("\n")))


def printable_json(text: str) -> str:
    r"""Return JSON of the same data, with characters that are not printable as ``\u202e``.

    Args:
        text: JSON without tabs or carriage returns between its tokens.
    """
    return "\n".join(map(_printable_json, text.split("\n")))


def _printable_json(line: str) -> str:
    if line.isprintable():
        return line
    return "".join(c if c.isprintable() else json.dumps(c)[1:-1] for c in line)
