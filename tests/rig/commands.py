"""Commands run in this process: what they read, and what a check finds."""

from place_rings.cli.app import app
from place_rings.formats.schema.proposal_models import ProposalFile
from place_rings.formats.writing import to_toml
from place_rings.rig.check.models import CheckResult


def call(*words):
    """Run a command; return its exit code. A refusal remains an error."""
    try:
        app(
            [*map(str, words)], exit_on_error=False, print_error=False, result_action="return_value"
        )
    except SystemExit as end:
        return end.code
    return 0


def proposed(folder, setup, scene, name="small.toml"):
    """The file of a proposal."""
    (folder / name).write_text(to_toml(ProposalFile.of(setup, scene)))
    return folder / name


def result_of(folder):
    """The result of a check in its output folder."""
    return CheckResult.model_validate_json((folder / "check.json").read_text())
