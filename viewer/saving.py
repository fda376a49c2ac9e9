"""Saving of a setup as a proposal, only into the folder that was given at the start."""

import re
from collections.abc import Sequence
from pathlib import Path

from ..coverage.definitions.errors import UserError, shown
from ..coverage.definitions.escaping import printable
from ..coverage.rings.ring import Setup
from ..formats.schema.proposal_models import ProposalFile
from ..formats.writing import output_files, to_toml, write_text
from ..objectives.feasibility.mounting import Fault
from ..objectives.feasibility.violations import of_mount
from ..objectives.scene import Scene
from ..objectives.verified import Verified
from .html import UNBUILDABLE

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}")
_HEADING = """A placement of sensor rings, saved from place-rings view. Edit it freely, then check \
it again:
  place-rings verify {name}.toml
Positions run from 0 (proximal) to 1 (distal) along a link's mount axis; a tilt is positive \
towards distal."""


def file_named(folder: Path | None, name: str, replace: bool, ending: str = ".toml") -> Path:
    """Return the path of a file in ``folder``.

    Args:
        folder: folder of ``--out``, or None.
        name: name without ending.
        replace: whether an existing file may be replaced.
        ending: ending of the name.

    Raises:
        UserError: if there is no folder, the name is invalid, or a file exists that must not be
            replaced.
    """
    if folder is None:
        raise UserError("saving needs a folder: start the viewer with --out FOLDER")
    if not _NAME.fullmatch(name):
        raise UserError(f"name: found {shown(name)}, allowed: at most 64 letters, digits, - and _")
    path = folder / f"{name}{ending}"
    if path.is_symlink() or (path.exists() and not path.is_file()):
        raise UserError(f"name: {path.name} exists and is no regular file; choose another name")
    if path.exists() and not replace:
        raise UserError(f"name: {path.name} exists; choose another name, or allow to replace it")
    return path


def save(
    path: Path,
    setup: Setup,
    scene: Scene,
    counted: Sequence[Verified],
    broken: Sequence[Fault] = (),
) -> None:
    """Write a setup as a proposal for ``scene`` with the counted coverage.

    Args:
        path: file to write.
        setup: setup to save.
        scene: its scene.
        counted: counts of the setup.
        broken: rules that it violates, which the file states.

    Raises:
        UserError: if the file cannot be written; an existing file stays unchanged.
    """
    mounting = of_mount(scene, broken)
    zeta = [one.in_scene(path.stem, scene).with_mounting(mounting) for one in counted]
    heading = [_HEADING.format(name=path.stem)]
    heading += [f"{UNBUILDABLE}:", *(f"  {printable(f.text)}" for f in broken)] * bool(broken)
    text = to_toml(ProposalFile.of(setup, scene, zeta=zeta), "\n".join(heading))
    with output_files(path.parent, path.name) as new:
        write_text(new / path.name, text)
