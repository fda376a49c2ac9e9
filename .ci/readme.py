"""Is the README alive? Runs its `verify` commands and compares the numbers it quotes; `docs.py`
runs its blocks.

Usage: python .ci/readme.py README.md OUT, with OUT the folder that the main command just wrote.
"""

import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

from place_rings.cli.app import app as commands

SLACK = 0.011  # points: the README rounds to two decimals
FOUND_SLACK = 0.5  # points: a search may end a little elsewhere on another processor


def fail(message: str) -> None:
    raise SystemExit(f"README: {message}")


def check_table(text: str, folder: Path) -> int:
    """Rows `| setup | sensors | V_O | V_T | V_OT | V_S(0.5) | V_S(1.5) |` against result.json."""
    comparison = json.loads((folder / "result.json").read_text())["comparison"]
    zeta = {(r["setup"], r["target"], r["radius"]): r["zeta_percent"] for r in comparison}
    targets = [("V_O", None), ("V_T", None), ("V_OT", None), ("V_S", 0.5), ("V_S", 1.5)]
    rows = re.findall(r"^\| (proposal|n\d_\d+_\d+) \| \d+ \| (.+) \|$", text, re.MULTILINE)
    for name, cells in rows:
        for target, cell in zip(targets, cells.split(" | "), strict=True):
            slack = (
                FOUND_SLACK
                if name == "proposal" and target == ("V_S", 0.5)
                else 20
                if name == "proposal"
                else SLACK
            )
            if abs(zeta[(name, *target)] - float(cell)) > slack:
                fail(f"{name} {target}: it says {cell}, measured {zeta[(name, *target)]:.2f}")
    return len(rows)


def check_verify(text: str) -> int:
    """Rows `` | `place-rings verify ...` | 12.34 | `` against what the command prints."""
    rows = re.findall(r"^\| `(place-rings verify [^`]+)` \| ([\d.]+) \|", text, re.MULTILINE)
    for command, said in rows:
        output = subprocess.run(
            [*shlex.split(command), "--json"], check=True, capture_output=True, text=True
        ).stdout
        if abs(json.loads(output)["zeta_percent"] - float(said)) > SLACK:
            fail(f"{command}: it says {said}, measured {json.loads(output)['zeta_percent']:.2f}")
    return len(rows)


def check_help(text: str) -> int:
    """Every option of ours that is named exists."""
    helps = "".join(
        subprocess.run(
            ["place-rings", *command, "--help"], check=True, capture_output=True, text=True
        ).stdout
        for command in ([], *([name] for name in commands if not name.startswith("-")))
    )
    blocks = " ".join(re.findall(r"place-rings[^`\n]*", text))
    options = set(re.findall(r"(?<= )--[a-z-]+", blocks))
    for option in options:
        if option not in helps:
            fail(f"{option} is no option")
    return len(options)


def main() -> None:
    """Check all; each kind must be there, so that this cannot pass by finding nothing."""
    text, folder = Path(sys.argv[1]).read_text(), Path(sys.argv[2])
    counts = {
        "table rows": check_table(text, folder),
        "verify commands": check_verify(text),
        "options": check_help(text),
    }
    if not all(counts.values()):
        fail(f"nothing found to check in one kind: {counts}")
    print("README:", ", ".join(f"{n} {kind}" for kind, n in counts.items()), "alive")


if __name__ == "__main__":
    main()
