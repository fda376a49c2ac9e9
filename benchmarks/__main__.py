"""Run benchmarks and write their sections into results/benchmarks.md.

Run: python benchmarks            all but the long ones
     python benchmarks octree     some of them; other sections stay as they are
     python benchmarks rig --busy  beside eight busy processes; rig_checks takes it, too
     python benchmarks searches   hours, never run by default; takes options such as --seeds=2
"""

import importlib
import inspect
import re
import sys
from pathlib import Path

from place_rings.studies.engine.provenance import MeasurementRecorder, from_json, sentences

NAMES = (
    *(
        "octree",
        "certified",
        "estimator",
        "growth",
        "occlusion",
        "kills",
        "questions",
        "fronts",
        "searches",
        "searches_paper",
        "seeds",
        "search_modes",
    ),
    *(
        "rig",
        "rig_moving",
        "rig_checks",
        "rig_late",
        "near_stops",
        "assemblies",
        "viewer",
        "start_up",
        "house",
    ),
    *("urdfs", "scale"),
)
_SHORT = (
    *("octree", "certified", "estimator", "growth", "occlusion", "kills"),
    *("viewer", "start_up", "house"),
)
REDRAWN = "--runs=0"  # the option of a section that is written from existing measurements
_PARTS = {"rig": ("rig", "rig_moving")}  # benchmarks with several sections
FILE = Path(__file__).parent.parent / "results" / "benchmarks.md"
RECORDS = FILE.with_suffix("")  # one record for each section: code, machine, load


def main() -> None:
    """Measure the requested sections and put them into the file."""
    options = [word for word in sys.argv[1:] if word.startswith("-")]
    if {"-h", "--help"} & {*options}:
        print(f"{(__doc__ or '').strip()}\n\nBenchmarks: {', '.join(NAMES)}")
        return
    asked = [word for word in sys.argv[1:] if word not in options] or _SHORT
    if unknown := [name for name in asked if name not in NAMES]:
        raise SystemExit(f"{unknown[0]}: no such benchmark; choose from {', '.join(NAMES)}")
    for name in dict.fromkeys(part for word in asked for part in _PARTS.get(word, (word,))):
        print(f"== {name}", flush=True)
        module = importlib.import_module(name)
        if options and not inspect.signature(module.report).parameters:
            raise SystemExit(f"{name}: found {options[0]}, but it takes no options")
        command = " ".join(("python", "benchmarks", name, *options))
        recorder = MeasurementRecorder(command, [Path(__file__).with_name(f"{name}.py")])
        title = (module.__doc__ or name).splitlines()[0].rstrip(".")
        lines = module.report(options) if options else module.report()
        quoted = f"`python benchmarks {name}`"
        if not any(quoted in line for line in lines):
            lines = [f"{quoted}.", "", *lines]
        RECORDS.mkdir(parents=True, exist_ok=True)
        file = RECORDS / f"{name}.json"
        if REDRAWN in options and file.exists():  # nothing was measured: the record stays
            record = from_json(file.read_text("utf-8"))
        else:
            record = recorder.record(file)
            file.write_text(record.to_json(), "utf-8")
        measured = sentences(record, f"{RECORDS.name}/{file.name}")
        # read now: another benchmark may have ended meanwhile
        old = FILE.read_text() if FILE.exists() else ""
        sections = dict(
            re.findall(r"^<!-- (\w+) -->\n(.*?)(?=^<!-- |\Z)", old, re.MULTILINE | re.DOTALL)
        )
        sections[name] = "\n".join([f"## {title}", "", *lines, "", measured, "", ""])
        kept = [f"<!-- {n} -->\n{sections[n].rstrip()}\n\n" for n in NAMES if n in sections]
        head = (
            "# Benchmarks\n\n`python benchmarks` writes this page. Times are medians; ratios"
            " compare times of one run.\n\n"
        )
        FILE.write_text((head + "".join(kept)).rstrip() + "\n")


if __name__ == "__main__":
    main()
