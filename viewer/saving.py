"""A setup on a page becomes a proposal's file: in one folder, which was named at the start, and
nowhere else.
"""

import re
from collections.abc import Sequence
from pathlib import Path

from ..coverage.rings.ring import Setup
from ..formats.errors import UserError, shown
from ..formats.schema.proposal_models import ProposalFile
from ..formats.schema.result_models import VerifyResult
from ..formats.writing import to_toml, write_text
from ..objectives.scene import Scene
from ..objectives.verify import Verified

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}")
_HEADING = """A placement of sensor rings, saved from place-rings view. Edit it freely, then check \
it again:
  place-rings verify {name}.toml
Positions run from 0 (proximal) to 1 (distal) along a link's mount axis; a tilt is positive \
towards distal."""


def file_named(folder: Path | None, name: str, replace: bool, ending: str = ".toml") -> Path:
    """The file of that name and ``ending`` in ``folder``.

    Raises:
        UserError: without a folder, for a name that is more than a name, or where there is
            something that is not to be
            replaced.
    """
    if folder is None:
        raise UserError("saving: found no folder, allowed: start the viewer with --out FOLDER")
    if not _NAME.fullmatch(name):
        raise UserError(f"name: found {shown(name)}, allowed: letters, digits, - and _, 64 at most")
    path = folder / f"{name}{ending}"
    if path.is_symlink() or (path.exists() and not path.is_file()):
        raise UserError(
            f"name: found {path.name}, which is no file of its own, allowed: another name"
        )
    if path.exists() and not replace:
        raise UserError(
            f"name: found {path.name}, which is there already, allowed: another name, or replace it"
        )
    return path


def save(path: Path, setup: Setup, scene: Scene, counted: Sequence[Verified]) -> None:
    """Write ``setup`` as a proposal for ``scene``, with what was counted of it. UserError where it
    cannot be written; an old file stays as it was then."""
    proposal = ProposalFile.of(
        setup,
        scene,
        zeta=[VerifyResult.of(path.stem, one, scene) for one in counted],
    )
    write_text(path, to_toml(proposal, _HEADING.format(name=path.stem)))
