"""Commands run in this process, and refusals of any wording."""

from contextlib import contextmanager

import pytest
from place_rings.cli.app import app
from place_rings.formats.errors import UserError


def call(*words):
    """Run a command; return its exit code. A refusal remains an error."""
    try:
        app(
            [*map(str, words)], exit_on_error=False, print_error=False, result_action="return_value"
        )
    except SystemExit as end:
        return end.code
    return 0


@contextmanager
def refused(*parts, by=UserError):
    """The body is refused by an error of one line that names all ``parts``."""
    with pytest.raises(by) as error:
        yield error
    line = str(error.value)
    assert "\n" not in line
    assert [str(part) for part in parts if str(part) not in line] == [], line
