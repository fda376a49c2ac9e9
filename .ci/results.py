"""List the results that are older than the code that they measure.

Usage: python .ci/results.py

Beside each page of results/ lies a record: digests of all modules and data files that its
measurement can reach, without comments and docstrings. This step computes the same digests from the
checkout's sources. For each page with other digests it names the page, the command that measures it
again, and the modules that changed. Nothing is imported, only parsed, so it takes seconds.

It only reports old results: most edits change code that some page measures, some pages take hours,
and a check that fails after every edit would be switched off. It fails where a page has no record,
or a broken one, because then nobody can tell. The versions of libraries are in the records, and are
not compared.
"""

import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from place_rings.studies.engine.import_closure import ImportGraph
from place_rings.studies.engine.provenance import (
    FILE,
    Provenance,
    ProvenanceError,
    digests,
    from_json,
)

ROOT = Path(__file__).resolve().parent.parent
SHOWN = 8  # modules of each kind that are named for each page
_SECTION = re.compile(r"^<!-- (\w+) -->$", re.MULTILINE)


@dataclass(frozen=True)
class Page:
    """A page, or a section of one, with the place of its record."""

    name: str
    """Path of the page below the root, and the section."""
    record: Path
    """File of the record."""


def pages(results: Path) -> Iterator[Page]:
    """Yield all pages below a folder; a page of marked sections counts section by section."""
    for file in sorted(results.rglob("*.md")):
        name = file.relative_to(results.parent).as_posix()
        if sections := _SECTION.findall(file.read_text("utf-8")):
            folder = file.with_suffix("")
            yield from (Page(f"{name}, {one}", folder / f"{one}.json") for one in sections)
        elif file.name == "README.md":
            yield Page(name, file.with_name(FILE))
        else:
            yield Page(name, file.with_suffix(f".{FILE}"))


def read(page: Page) -> Provenance:
    """Return a page's record.

    Raises:
        ProvenanceError: if there is none, or it is broken.
    """
    try:
        return from_json(page.record.read_text("utf-8"))
    except FileNotFoundError as error:
        raise ProvenanceError("no record; measure the page again") from error
    except (OSError, UnicodeDecodeError) as error:
        raise ProvenanceError(f"cannot be read: {error}") from error


def about(record: Provenance, graph: ImportGraph) -> str | None:
    """Return why a page is old, for a list; None if it is not."""
    if record.kind == "unrecorded":
        return "measured before records were kept"
    if gone := [name for name in record.sources if not (graph.root / name).is_file()]:
        return f"the file that measured it is gone: {', '.join(gone)}"
    inputs = [graph.root / name for name in record.inputs]
    sources = [graph.root / name for name in record.sources]
    files = digests(sources, graph, [file for file in inputs if file.is_file()])
    changed = record.changes(files)
    if not changed:
        return None
    both = [name for name in changed if name in record.files and name in files]
    both.sort(key=lambda name: name not in record.sources)
    new, gone = ([n for n in changed if n not in some] for some in (record.files, files))
    kinds = (("changed", both), ("new", new), ("gone", gone))
    return "; ".join(f"{kind}: {_some(names)}" for kind, names in kinds if names)


def _some(names: list[str]) -> str:
    more = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
    return ", ".join(names[:SHOWN]) + more


def main(root: Path = ROOT) -> int:
    """Print all old pages; return 1 if a page has no usable record."""
    graph, old, broken = ImportGraph(root), list[str](), list[str]()
    every = list(pages(root / "results"))
    for page in every:
        try:
            record = read(page)
        except ProvenanceError as error:
            broken.append(f"{page.record.relative_to(root).as_posix()} of {page.name}: {error}")
            continue
        if reason := about(record, graph):
            old.append(f"{page.name}\n    {reason}\n    measure it again: {record.command}")
    print(f"results: {len(every) - len(old) - len(broken)} of {len(every)} match the code")
    for line in old:
        print(f"older than the code: {line}")
    for line in broken:
        print(f"results: {line}", file=sys.stderr)
    return 1 if broken or not every else 0


if __name__ == "__main__":
    sys.exit(main())
