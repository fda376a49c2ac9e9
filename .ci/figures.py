"""Check the figures and options that the README and the docs quote.

Usage: python .ci/figures.py OUT, with OUT the output folder of the README's main command.

There are four checks, and each must have something to check: the README's table of layouts against
OUT's result.json, rows with a command and its coverage against the command's output, every option
after place-rings against the commands' help, and that a page which quotes a benchmark or a page of
results names the version that the figures hold for. Figures that took long to measure are not
measured again here; they belong to that version.
"""

import json
import re
import runpy
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

from place_rings.cli.app import app as commands

ROOT = Path(__file__).resolve().parent.parent
COUNT_SLACK = 0.011  # points: figures are rounded to two decimals
SEARCH_SLACK = 0.5  # points: a search may end slightly elsewhere on another processor
_LAYOUT = re.compile(r"^\| (proposal|n\d_\d+_\d+) \| \d+ \| (.+) \|$", re.MULTILINE)
_COMMAND = re.compile(r"^\| `(place-rings [^`]+)` \| ([\d.]+)(?: ± [\d.]+)? \|", re.MULTILINE)

_MEASURED = re.compile(r"python benchmarks \w+|\bresults/\w+(?:/README)?\.md")
_VERSION = re.compile(r"\b[Vv]ersion \d+\.\d+\.\d+")


def fail(message: str) -> None:
    raise SystemExit(f"figures: {message}")


def check_layouts(text: str, folder: Path) -> int:
    """Check rows of layouts: rings that do not fit, coverage of V_S(0.5), and the same with a
    transparent robot."""
    comparison = json.loads((folder / "result.json").read_text())["comparison"]
    counted = {r["setup"]: r for r in comparison}
    rows = _LAYOUT.findall(text)
    for name, cells in rows:
        row, (unmounted, *quoted) = counted[name], cells.split(" | ")
        if int(unmounted) != len(row["unmounted"]):
            fail(f"{name}: quoted {unmounted} rings that do not fit, found {row['unmounted']}")
        slack = SEARCH_SLACK if name == "proposal" else COUNT_SLACK
        for model, cell in zip(("shadow", "ignore"), quoted, strict=True):
            zeta = row["by_occlusion_percent"][model]
            # the search optimises the first only
            free = 2.0 if (name, model) == ("proposal", "ignore") else slack
            if abs(zeta - float(cell.split(" ± ")[0])) > free:
                fail(f"{name} {model}: quoted {cell}, counted {zeta:.2f}")
    return len(rows)


def check_commands(pages: dict[Path, str]) -> int:
    """Check rows with a command and a coverage, both ``verify`` and searches."""
    rows = {
        (command, quoted): page
        for page, text in pages.items()
        for command, quoted in _COMMAND.findall(text)
    }
    for (command, quoted), page in rows.items():
        counted, slack = coverage(command)
        if abs(counted - float(quoted)) > slack:
            fail(f"{page.name}: {command}: quoted {quoted}, counted {counted:.2f}")
    return len(rows)


def coverage(command: str) -> tuple[float, float]:
    """Return the coverage in percent that a command prints, and the tolerance of a quote."""
    words = shlex.split(command)
    with tempfile.TemporaryDirectory() as folder:
        printed = subprocess.run(
            [*words, "--json"], check=True, capture_output=True, text=True, cwd=folder
        ).stdout
    answer = json.loads(printed)
    if words[1] == "verify":
        return answer["zeta_percent"], COUNT_SLACK
    return answer["proposal"]["zeta"][0]["zeta_percent"], SEARCH_SLACK


def check_options(pages: dict[Path, str]) -> int:
    """Check that every option after place-rings exists."""
    helps = "".join(
        subprocess.run(
            ["place-rings", *command, "--help"], check=True, capture_output=True, text=True
        ).stdout
        for command in ([], *([name] for name in commands if not name.startswith("-")))
    )
    known = set(re.findall(r"--[a-z-]+", helps))
    quoted = {
        (option, page)
        for page, text in pages.items()
        for line in re.findall(r"place-rings[^`\n]*", text)
        for option in re.findall(r"(?<= )--[a-z-]+", line)
    }
    for option, page in quoted:
        if option not in known:
            fail(f"{page.name}: {option} is no option of any command")
    return len({option for option, _ in quoted})


def check_parts(pages: dict[Path, str]) -> None:
    """Check that the parts after python benchmarks exist, and their options."""
    suite = ROOT / "benchmarks" / "__main__.py"
    options = set(re.findall(r"\"(--[a-z-]+)\"", suite.read_text("utf-8"))) | {"--help"}
    known = options | set(runpy.run_path(str(suite), run_name="suite")["PARTS"])
    for page, text in pages.items():
        for words in re.findall(r"python benchmarks((?: [\w-]+)*)`", text):
            if unknown := set(words.split()) - known:
                fail(f"{page.name}: python benchmarks{words}: no part or option {min(unknown)}")


def check_versions(pages: dict[Path, str]) -> int:
    """Check that pages with measured figures name a version, and that quoted benchmarks exist."""
    quoted = [(page, _MEASURED.findall(text), text) for page, text in pages.items()]
    for page, names, text in quoted:
        if names and not _VERSION.search(text):
            fail(f"{page.name}: quotes {names[0]}, but names no version that its figures hold for")
    check_parts(pages | {file: file.read_text("utf-8") for file in [ROOT / "CONTRIBUTING.md"]})
    return sum(len(names) for _, names, _ in quoted)


def main() -> None:
    """Check everything; fail if one kind has nothing to check."""
    paths = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    pages = {path: path.read_text() for path in paths}
    counts = {
        "rows of layouts": check_layouts(pages[ROOT / "README.md"], Path(sys.argv[1])),
        "rows of commands": check_commands(pages),
        "options": check_options(pages),
        "measured figures": check_versions(pages),
    }
    if not all(counts.values()):
        fail(f"one kind has nothing to check: {counts}")
    print("figures:", ", ".join(f"{n} {kind}" for kind, n in counts.items()), "checked")


if __name__ == "__main__":
    main()
