"""Run the benchmarks of a release and write their sections into results/benchmarks.md.

Run: python benchmarks                all parts
     python benchmarks count house    some parts; the other sections stay as they are
     python benchmarks search --full  a part with more questions, seeds or repeats
"""

import argparse
import importlib
import re
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path

from place_rings.formats.writing import write_text
from place_rings.studies.engine.measurement import Measurement

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "results" / "benchmarks.md"
_HEAD = """# Benchmarks

`python benchmarks` measures this page for a release; `python benchmarks --help` lists its parts. \
Times are medians, and ratios compare times of one run.
"""
_SECTION = re.compile(r"^<!-- (\w+) -->\n(.*?)(?=^<!-- |\Z)", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Part:
    """A part of the suite, which the module of its name measures."""

    title: str
    """Heading of its section."""
    minutes: float
    """Duration on two cores."""
    full_minutes: float
    """Duration with ``--full``."""
    full: str
    """What ``--full`` adds."""


PARTS = {
    "count": Part(
        "Exact count: comparison with dense counts, random points, rays and meshes",
        *(4, 20, "more voxels, setups and sizes, and 40 printed proposals of each robot"),
    ),
    "certified": Part(
        "Guaranteed intervals: comparison with mesh Booleans", 1, 2, "an interval of 0.01 points"
    ),
    "estimator": Part(
        "Soft estimator: comparison with straightforward JAX, PyTorch and NumPy",
        *(1, 2, "all widths of the sigmoid"),
    ),
    "membership": Part(
        "Fast paths of membership: time beside their definitions", 1, 3, "more points"
    ),
    "search": Part(
        "Search: time, and answers to the benchmark's questions spread over seeds",
        *(14, 16, "1,000 sensors, checked by random points"),
    ),
    "detection_search": Part(
        "Search for detection, beside the search for ζ", 8, 24, "three seeds instead of one"
    ),
    "start_up": Part(
        "Start-up time of commands", 1, 10, "more rounds, and the questions of the docs"
    ),
    "rig": Part(
        "Rig: margins of checks, and times to detection and standstill under faults",
        *(5, 60, "ten runs of each fault, alone and beside busy processes; 200 checks"),
    ),
    "twin": Part(
        "Twin in MuJoCo: speed beside rangefinders, and reported spheres beside ζ",
        *(4, 12, "more spheres"),
    ),
    "viewer": Part(
        "Viewer: accuracy of its estimates, and time to a new estimate and to the first picture",
        *(2, 5, "more events and visits"),
    ),
    "house": Part("Size of the source tree", 0.1, 0.1, "nothing"),
}


def main() -> None:
    """Measure the requested parts and put their sections into the page."""
    listed = "\n".join(
        f"  {name:9} {part.minutes:g} min ({part.full_minutes:g} with --full): {part.title}."
        f" --full adds: {part.full}."
        for name, part in PARTS.items()
    )
    parser = argparse.ArgumentParser(
        "benchmarks",
        description=__doc__,
        epilog=f"parts, with minutes on two cores:\n{listed}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("parts", nargs="*", metavar="PART", help="parts to run; default: all")
    parser.add_argument("--full", action="store_true", help="more questions, seeds and repeats")
    parser.add_argument(
        "--page", type=Path, default=PAGE, help="page to write; default: %(default)s"
    )
    given = parser.parse_args()
    names = dict.fromkeys(given.parts or PARTS)
    if unknown := [name for name in names if name not in PARTS]:
        parser.error(f"{unknown[0]}: no such part; choose from {', '.join(PARTS)}")
    sys.path.append(str(ROOT))  # some parts use the judges, clients and faults of the tests
    minutes = sum(PARTS[n].full_minutes if given.full else PARTS[n].minutes for n in names)
    print(f"{', '.join(names)}: about {minutes:g} minutes on two cores", flush=True)
    before = Measurement.begin("", ROOT)  # a later load would be that of the parts before
    for name in names:
        print(f"== {name}", flush=True)
        began = time.monotonic()
        command = f"python benchmarks {name}{' --full' * given.full}"
        measurement = replace(before, command=command)
        blocks = importlib.import_module(name).report(given.full)
        write_section(given.page, name, "\n\n".join([measurement.header, *blocks]))
        print(f"== {name} took {(time.monotonic() - began) / 60:.1f} minutes", flush=True)


def write_section(page: Path, name: str, text: str) -> None:
    """Put the section of a part into a page; sections of unknown parts are dropped."""
    sections = dict(_SECTION.findall(page.read_text("utf-8") if page.exists() else ""))
    sections[name] = f"## {PARTS[name].title}\n\n{text}"
    kept = [f"<!-- {n} -->\n{sections[n].rstrip()}\n" for n in PARTS if n in sections]
    write_text(page, "\n".join([_HEAD, *kept]))


if __name__ == "__main__":
    main()
