"""A setup as a page to read, to print and to build from: count, draw, write."""

import sys
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory

from ...coverage.rings.ring import Setup
from ...formats.loader import how_found
from ...formats.scene_checks import check_scene, check_sight
from ...formats.writing import output_folder, write_text
from ...objectives.scene import Scene
from ...reporting.pages import html
from ...reporting.placement_picture import placement_picture
from ...reporting.setup_report.blind_spot_picture import blind_picture
from ...reporting.setup_report.facts import gather
from ...reporting.setup_report.report_page import PICTURE, answer, blind_name, listed_spots, page
from ...reporting.tables import target_label
from ...reporting.terminal import Terminal, say
from ...rig.rings.protocol import length
from .place import PACKAGES

FILE = "report.html"


def report(
    name: str, setup: Setup, scene: Scene, voxel: float, draws: int, seed: int, out: Path
) -> None:
    """Count, draw and write the report of ``setup``, which is called ``name``."""
    check_scene(scene, voxel)
    check_sight(scene, setup)
    origin, folder, console = how_found(name), output_folder(out), Terminal(stderr=True)
    facts = gather(name, setup, scene, voxel, draws, seed, origin, console)
    versions = {package: version(package) for package in PACKAGES} | {
        "python": sys.version.split()[0]
    }
    with console.status("drawing"), TemporaryDirectory() as pictures:
        captions = [f"{target_label(r)}: {r.zeta_percent:.1f} % covered" for r in facts.own]
        placement_picture(Path(pictures) / PICTURE, scene, setup, captions)
        for n, blind in enumerate(facts.blind):
            if shown := listed_spots(blind):
                blind_picture(Path(pictures) / blind_name(n), scene, setup, blind, shown)
        created = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
        text = html(
            page(facts, sys.argv[1:], versions, created, length),
            Path(pictures),
            f"Placement report: {Path(name).name}",
        )
    write_text(folder / FILE, text)
    say(answer(facts).replace("**", ""))
    say(f"  {folder / FILE}")
