"""Commands run in this process."""

from place_rings.cli.app import app


def call(*words):
    """Run a command; return its exit code. A refusal remains an error."""
    try:
        app(
            [*map(str, words)], exit_on_error=False, print_error=False, result_action="return_value"
        )
    except SystemExit as end:
        return end.code
    return 0
