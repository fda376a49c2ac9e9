"""The report of a setup: one self-contained HTML page."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from ._errors import input_errors, new_files
from ._options import called_with
from ._validation import ResolvedSetup, SetupCall, SetupLike, check_scene, resolve_setup
from ._versions import versions
from .formats.fingerprints import file_sha256, scene_sha256
from .formats.loader import how_found
from .formats.writing import write_text
from .objectives.options import ReportOptions
from .objectives.scene import Scene
from .placement.search.result import SearchResult
from .reporting.terminal import Terminal

if TYPE_CHECKING:
    from .reporting.setup_report.facts import Facts

FILE, PDF, TABLE = "report.html", "report.pdf", "smallest_object.csv"


@dataclass(frozen=True)
class ReportCall(ReportOptions, SetupCall):
    """A call of ``report``."""

    folder: str | Path = field(default="place-rings-report", kw_only=True)
    """Output folder of report.html; created if it does not exist."""


@called_with(ReportCall)
def report(call: ReportCall) -> Path:
    """Write a self-contained HTML report: verdict, coverage, blind spots, mounting drawings, cables
    and bill of materials.

    The verdict is against the ``at_least_percent`` of the scene's targets.

    Returns:
        The path of report.html.

    Raises:
        InputError: for a setup that does not fit the scene, a folder that cannot be written, or
            ``pdf`` without a browser.

    Example:
        >>> import place_rings as pr, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     page = pr.report("n1_8_0", folder=folder, voxel=0.1, draws=2)
        ...     print(page.name, page.stat().st_size > 10_000)
        report.html True
    """
    return write_report(call.setup, call.scene, Path(call.folder), call)[0]


def write_report(
    setup: SetupLike,
    scene: Scene | None,
    folder: Path,
    options: ReportOptions,
    arguments: Sequence[str] = (),
    console: Terminal | None = None,
) -> "tuple[Path, Facts]":
    """Write the report as ``report`` does.

    Args:
        setup, scene, folder: as in ``report``.
        options: how to count, and what to write.
        arguments: arguments of the command that the report quotes as its origin.
        console: terminal for the progress; none by default.

    Returns:
        The path of report.html, and the figures in it.

    Raises:
        InputError: as in ``report``.
    """
    from .reporting.pages import html
    from .reporting.pdf import find_browser, write_pdf
    from .reporting.setup_report.facts import gather
    from .reporting.setup_report.report_page import Identity, heading, page

    name, placed, core = resolve_setup(setup, scene)
    check_scene(core, options.voxel)
    log = Terminal(stderr=True, quiet=True) if console is None else console
    with input_errors():
        browser = find_browser() if options.pdf else ""
    with new_files(folder, FILE, PDF, TABLE, keep=True) as new:
        identity = Identity(
            datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
            options.revision,
            file_sha256(name),
            scene_sha256(core),
        )
        origin = _origin(setup)
        facts = gather(name, placed, core, options, origin, log)
        with log.status("drawing"), TemporaryDirectory() as pictures:
            _draw(facts, Path(pictures))
            _draw_gaps(facts, Path(pictures), new / TABLE)
            words = arguments or ("report", name)
            markdown = page(facts, words, versions(), identity)
            write_text(new / FILE, html(markdown, Path(pictures), heading(facts)))
        if browser:
            with log.status("printing"):
                write_pdf(browser, new / FILE, new / PDF)
    return folder / FILE, facts


def _origin(setup: SetupLike) -> SearchResult | None:
    """Return the record of the search that found a setup, if it or its file has one."""
    if isinstance(setup, ResolvedSetup):
        return how_found(setup.name)
    if isinstance(setup, str | Path):
        return how_found(str(setup))
    return getattr(setup, "found", None)


def _draw(facts: "Facts", folder: Path) -> None:
    """Draw the pictures of the page: the setup, a section, the firing schedule, the blind
    spots of each target, and the mounting of each link's rings."""
    from .reporting.firing_figure import firing_figure
    from .reporting.placement_picture import placement_picture
    from .reporting.setup_report.blind_spot_section import blind_name, blind_picture
    from .reporting.setup_report.definition_picture import definition_picture
    from .reporting.setup_report.detection_section import PICTURE as DETECTION
    from .reporting.setup_report.detection_section import detection_picture
    from .reporting.setup_report.firing_section import FIRING
    from .reporting.setup_report.mounting_drawing import (
        drawing_name,
        mounting_drawing,
        ringed_links,
    )
    from .reporting.setup_report.report_page import PICTURE
    from .reporting.setup_report.scene_section import SECTION
    from .reporting.tables import result_caption

    scene, setup = facts.scene, facts.setup
    captions = [result_caption(r) for r in facts.own]
    placement_picture(folder / PICTURE, scene, setup, captions)
    definition_picture(folder / SECTION, scene, setup)
    detection_picture(folder / DETECTION, scene, setup)
    firing_figure(facts.firing, scene.robot, folder / FIRING)
    for n, blind in enumerate(facts.blind):
        if blind.spots:
            blind_picture(folder / blind_name(n), scene, setup, blind)
    for n, link in enumerate(ringed_links(setup)):
        mounting_drawing(folder / drawing_name(n), scene, setup, link)


def _draw_gaps(facts: "Facts", folder: Path, table: Path) -> None:
    """Draw the largest unseen objects of each target for which they are known, and write their
    table."""
    from .reporting.setup_report.smallest_object_section import (
        gap_maps,
        object_name,
        object_picture,
        object_table,
    )

    maps = gap_maps(facts)
    for n, (gaps, r) in enumerate(zip(maps, facts.with_objects, strict=True)):
        if gaps is not None and r.smallest_object is not None:
            object_picture(folder / object_name(n), facts.scene, gaps, r.smallest_object)
    if any(gaps is not None for gaps in maps):
        write_text(table, object_table(maps))
