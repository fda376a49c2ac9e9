"""The report of a setup: one self-contained HTML page."""

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from ._arguments import whole
from ._errors import input_errors, writable
from ._scene import Scene
from ._validation import ResolvedSetup, SetupLike, check_scene, resolve_setup
from ._versions import versions
from .formats.loader import how_found
from .formats.ring_frame import frame_length
from .formats.schema.proposal_models import FoundModel
from .formats.writing import write_text
from .objectives.scene import CoreScene
from .reporting.terminal import Terminal

if TYPE_CHECKING:
    from .reporting.setup_report.facts import Facts

FILE = "report.html"


def report(
    setup: SetupLike,
    scene: Scene | CoreScene | None = None,
    *,
    folder: str | Path = "place-rings-report",
    voxel: float = 0.01,
    draws: int = 100,
    seed: int = 0,
) -> Path:
    """Write a self-contained HTML report: coverage, blind spots, mounting guide and bill of
    materials.

    Args:
        setup, scene: as in ``verify``.
        folder: output folder of report.html; created if it does not exist.
        voxel: side of the voxels of all counts, m.
        draws: number of random mounting errors for the tolerance, 1 to 100,000.
        seed: random seed of the mounting errors.

    Returns:
        The path of report.html.

    Raises:
        InputError: for a setup that does not fit the scene, or a folder that cannot be written.

    Example:
        >>> import place_rings as pr, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     page = pr.report("n1_8_0", folder=folder, voxel=0.1, draws=2)
        ...     print(page.name, page.stat().st_size > 10_000)
        report.html True
    """
    return write_report(setup, scene, Path(folder), voxel, draws, seed)[0]


def write_report(
    setup: SetupLike,
    scene: Scene | CoreScene | None,
    folder: Path,
    voxel: float,
    draws: int,
    seed: int,
    arguments: Sequence[str] = (),
    console: Terminal | None = None,
) -> "tuple[Path, Facts]":
    """Write the report as ``report`` does.

    Args:
        setup, scene, folder, voxel, draws, seed: as in ``report``.
        arguments: arguments of the command that the report quotes as its origin.
        console: terminal for the progress; none by default.

    Returns:
        The path of report.html, and the figures in it.

    Raises:
        InputError: as in ``report``.
    """
    from .reporting.pages import html
    from .reporting.setup_report.facts import gather
    from .reporting.setup_report.report_page import page

    whole("draws", draws, 1, 100_000)
    whole("seed", seed, 0)
    name, placed, core = resolve_setup(setup, scene)
    check_scene(core, voxel)
    log = Terminal(stderr=True, quiet=True) if console is None else console
    with input_errors():
        made = writable(folder)
        origin = _origin(setup)
        facts = gather(name, placed, core, voxel, draws, seed, origin, log)
        with log.status("drawing"), TemporaryDirectory() as pictures:
            _draw(facts, Path(pictures))
            created = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
            words = arguments or ("report", name)
            text = html(
                page(facts, words, versions(), created, frame_length),
                Path(pictures),
                f"Placement report: {Path(name).name}",
            )
        write_text(made / FILE, text)
    return made / FILE, facts


def _origin(setup: SetupLike) -> FoundModel | None:
    """Return the record of the search that found a setup, if it or its file has one."""
    if isinstance(setup, ResolvedSetup):
        return how_found(setup.name)
    if isinstance(setup, str | Path):
        return how_found(str(setup))
    return getattr(setup, "found", None)


def _draw(facts: "Facts", folder: Path) -> None:
    """Draw the pictures of the page: the setup and the blind spots of each target."""
    from .reporting.placement_picture import placement_picture
    from .reporting.setup_report.blind_spot_picture import blind_picture
    from .reporting.setup_report.blind_spot_section import blind_name, listed_spots
    from .reporting.setup_report.report_page import PICTURE
    from .reporting.tables import target_label

    scene, setup = facts.scene, facts.setup
    captions = [f"{target_label(r)}: {r.zeta_percent:.1f} % covered" for r in facts.own]
    placement_picture(folder / PICTURE, scene, setup, captions)
    for n, blind in enumerate(facts.blind):
        if shown := listed_spots(blind):
            blind_picture(folder / blind_name(n), scene, setup, blind, shown)
