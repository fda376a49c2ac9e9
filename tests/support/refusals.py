"""One check of error messages: a single line that names file, key and value, in any wording."""

import re
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from place_rings.coverage.definitions.errors import UserError


def has_parts(line: str, parts: str) -> bool:
    """Return whether a line has all parts, whole words in this order.

    Args:
        line: a message.
        parts: what the message must state, separated by blanks, such as ``scene.toml version 3``.
    """
    words = (rf"(?<![\w.]){re.escape(part)}(?!\w|\.\w)" for part in parts.split())
    return "\n" not in line.strip() and re.search(".*".join(words), line) is not None


@contextmanager
def refused(
    *parts: object, error: type[Exception] = UserError
) -> Iterator[pytest.ExceptionInfo[Exception]]:
    """Expect an error whose message is one line with each of these parts."""
    with pytest.raises(error) as caught:
        yield caught
    line = str(caught.value)
    assert [part for part in map(str, ("", *parts)) if not has_parts(line, part)] == [], line
