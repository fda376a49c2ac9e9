"""Compare the outputs of two versions of place-rings on the same random input.

Run: python benchmarks/same_outputs.py BEFORE AFTER FOLDER

BEFORE and AFTER are two place-rings commands, each of its own environment. Only their printed and
written output is compared, so the two may share no code. Counts must be the same integers.
Guaranteed intervals must overlap and be as narrow as requested. Tables and exports must have the
same bytes except for dates and versions. Searches by seed must give the same rings. FOLDER keeps
the output of BEFORE, so a second comparison takes half the time.
"""

import csv
import hashlib
import io
import json
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

Answer = tuple[int, str]  # exit code and output
Both = Callable[[list[str], str], tuple[Answer, Answer]]  # arguments and a name to both outputs

COUNTS, WIDTH, POINTS = 40, 1.0, 0.02
TARGETS = ("V_O", "V_T", "V_OT", "V_S:0.3", "V_S:0.5", "V_S:1.0", "V_S:1.5")
ROBOTS = ("ur10", "ur10_dh", "ur5e", "panda", "iiwa14")
FORMATS = ("urdf", "mjcf", "glb", "csv", "json", "coppeliasim", "ros2", "stl")
SEARCHES = (
    ("--target", "V_S:0.5"),
    ("--target", "V_S:0.5=0.6", "--target", "V_S:1.5=0.4", "--rings-per-link", "3"),
    ("--target", "V_S:0.5", "--occlusion", "shadow"),
    ("--target", "V_S:0.5", "--sensors", "48"),
    ("--target", "V_S:0.5", "--redundancy", "2"),
    ("--target", "V_OT", "--robot", "panda"),
)
CHANGES = re.compile(rb"\d{4}-\d\d-\d\d[T ][\d:.+Z-]+|place-rings \d[\w.+]*")


def drawn_setup(rng: np.random.Generator) -> str:
    """Return one to six random rings as the text of a proposal."""
    rings = [
        f'[[rings]]\nlink = "{rng.choice(["upper_arm", "forearm", "tool"])}"\n'
        f"position = {rng.uniform():.4f}\ncount = {rng.integers(1, 25)}\n"
        f"tilt_deg = {rng.uniform(-70, 70):.2f}\nphase_deg = {rng.uniform(0, 360):.2f}\n"
        for _ in range(rng.integers(1, 7))
    ]
    return "\n".join(rings)


def count_words(rng: np.random.Generator) -> list[str]:
    """Return random options of ``verify``: target, robot, occlusion, rule, voxel."""
    return [
        *("--target", str(rng.choice(TARGETS)), "--robot", str(rng.choice(ROBOTS))),
        *("--occlusion", str(rng.choice(["ignore", "shadow", "blind"], p=[0.5, 0.3, 0.2]))),
        *("--rule", str(rng.choice(["centre", "touch"], p=[0.7, 0.3]))),
        *("--voxel", str(rng.choice([0.02, 0.03]))),
    ]


def run(command: str, words: list[str], folder: Path) -> Answer:
    """Return exit code and output of a run in ``folder``; the last line of stderr if it failed."""
    folder.mkdir(parents=True, exist_ok=True)
    ended = subprocess.run(
        [command, *words], check=False, cwd=folder, capture_output=True, text=True
    )
    last = (ended.stderr.strip().splitlines() or [""])[-1]
    return ended.returncode, ended.stdout if ended.returncode == 0 else last


def kept(command: str, words: list[str], folder: Path) -> Answer:
    """Return the same, from the folder's file if the command ran before with these arguments."""
    file = folder / "answer.json"
    if file.exists() and (old := json.loads(file.read_text()))["words"] == words:
        return old["code"], old["output"]
    if folder.exists():
        shutil.rmtree(folder)
    code, output = run(command, words, folder)
    file.write_text(json.dumps({"words": words, "code": code, "output": output}))
    return code, output


def contents(folder: Path) -> dict[str, str]:
    """Return the digest of every file of a folder, without dates, versions and temporary paths."""
    return {
        str(file.relative_to(folder)): hashlib.sha256(
            CHANGES.sub(b"", file.read_bytes())
        ).hexdigest()
        for file in sorted(folder.rglob("*"))
        if file.is_file() and file.name != "answer.json"
    }


def counts(both: Both, folder: Path) -> Iterator[str]:
    """Compare counts of random setups as integers; rejections must agree, too."""
    keys = ("target_voxels", "covered_voxels", "zeta_percent", "poses")
    same = refused = 0
    for seed in range(COUNTS):
        rng = np.random.default_rng(seed)
        file = folder / f"setup-{seed}.toml"
        file.write_text(drawn_setup(rng))
        words = ["verify", str(file), *count_words(rng), "--json"]
        (code, a), (other, b) = both(words, f"count-{seed}")
        if code == other == 0:
            x, y = ([{k: one[k] for k in keys} for one in _listed(said)] for said in (a, b))
            same += x == y
            if x != y:
                yield f"count {seed}: {x} and {y} ({' '.join(words)})"
        else:
            refused += code == other
            if code != other:
                yield f"count {seed}: exit codes {code} and {other}: {a} | {b}"
    yield f"{same} of {COUNTS} counts are the same integers, both reject {refused}"


def _listed(said: str) -> list[dict[str, Any]]:
    value = json.loads(said)
    return value if isinstance(value, list) else [value]


def intervals(both: Both) -> Iterator[str]:
    """Compare guaranteed intervals of the paper's layouts."""
    good, names = 0, ("n1_16_0", "n2_16_25", "n3_16_55")
    ways = [(n, t, o) for n in names for t in ("V_S:0.5", "V_O") for o in ("ignore", "shadow")]
    apart = 0.0
    for i, (name, target, occlusion) in enumerate(ways):
        words = ["verify", name, "--target", target, "--occlusion", occlusion]
        words += ["--rule", "certified", "--width", str(WIDTH), "--json"]
        (_, a), (_, b) = both(words, f"certified-{i}")
        x, y = _listed(a)[0], _listed(b)[0]
        narrow = all(one["high_percent"] - one["low_percent"] <= WIDTH + 1e-9 for one in (x, y))
        overlap = max(x["low_percent"], y["low_percent"]) <= min(
            x["high_percent"], y["high_percent"]
        )
        apart = max(apart, *(abs(x[k] - y[k]) for k in ("low_percent", "high_percent")))
        good += narrow and overlap
        if not (narrow and overlap):
            yield f"certified {name} {target} {occlusion}: {x} and {y}"
    yield (
        f"{good} of {len(ways)} guaranteed intervals are as narrow as asked and overlap; their ends"
        f" differ by {apart:.2g} points at most"
    )


def searches(both: Both, folder: Path) -> Iterator[str]:
    """Compare searches by seed: the same rings, or ζ within the tolerance."""
    equal = near = 0
    for i, options in enumerate(SEARCHES):
        words = [*options, "--seed", str(i), "--voxel", "0.02", "--out", "out", "--json"]
        ended = both(words, f"search-{i}")
        if any(code for code, _ in ended):
            yield f"search {' '.join(options)}: {ended}"
            continue
        x, y = (
            tomllib.loads((folder / side / f"search-{i}" / "out/proposal.toml").read_text())
            for side in ("before", "after")
        )
        apart = max(
            abs(a["zeta_percent"] - b["zeta_percent"])
            for a, b in zip(x["zeta"], y["zeta"], strict=True)
        )
        equal += x["rings"] == y["rings"]
        near += apart <= POINTS
        if x["rings"] != y["rings"]:
            yield f"search {' '.join(options)}: other rings, zeta differs by {apart:.3f} points"
    yield (
        f"{equal} of {len(SEARCHES)} searches by seed give the same rings, {near} the same zeta"
        f" within {POINTS} points"
    )


def files(both: Both, folder: Path) -> Iterator[str]:
    """Compare exports and the table of cones, except for dates and versions."""
    same = number = 0
    for setup in ("n2_16_25", "n3_16_55"):
        for form in FORMATS:
            name = f"export-{setup}-{form}"
            ended = both(["export", setup, "--to", form, "--out", "out"], name)
            x, y = (contents(folder / side / name) for side in ("before", "after"))
            number += max(len(x), len(y))
            same += sum(x.get(key) == y.get(key) for key in x | y)
            for key in x | y:
                if x.get(key) != y.get(key):
                    yield f"export {setup} to {form}: {key} differs"
            if ended[0][0] != ended[1][0]:
                yield f"export {setup} to {form}: exit codes {[code for code, _ in ended]}"
    (_, a), (_, b) = both(["cones", "n3_16_55"], "cones")
    rows = len(list(csv.reader(io.StringIO(a)))) - 1
    yield f"{same} of {number} exported files are the same bytes"
    yield f"cones: {rows} rows, {'the same text' if a == b else 'DIFFERENT'}"


def main() -> None:
    """Compare, and print the differences."""
    before, after, where = sys.argv[1:]
    folder = Path(where).absolute()
    folder.mkdir(parents=True, exist_ok=True)

    def both(words: list[str], name: str) -> tuple[Answer, Answer]:
        if (folder / "after" / name).exists():
            shutil.rmtree(folder / "after" / name)
        with ThreadPoolExecutor(2) as pool:
            first = pool.submit(kept, before, words, folder / "before" / name)
            second = pool.submit(run, after, words, folder / "after" / name)
            return first.result(), second.result()

    parts = (counts(both, folder), intervals(both), files(both, folder), searches(both, folder))
    for lines in parts:
        for line in lines:
            print(line, flush=True)


if __name__ == "__main__":
    main()
