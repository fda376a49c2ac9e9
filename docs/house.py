"""Draw the rooms of the code and their imports, from the import statements.

Run: python docs/house.py [FILE]

An arrow from A to B means that files of A import files of B. Arrows that follow from others are
left out: if A imports B and B imports C, there is no arrow from A to C.
"""

import ast
import sys
import textwrap
from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch
from matplotlib.path import Path as Polyline

ROOT = Path(__file__).resolve().parent.parent
FRONT = "api"  # the room that is installed as the package itself
WIDE, HIGH = 3.0, 0.86  # width and height of a box, in units of the picture
_TEXT = {"ha": "center", "va": "center"}
BLUE, INK, FAINT = "#0072B2", "#23272b", "#9aa3ab"


def rooms() -> dict[str, str]:
    """Return every room with its description, the first line of its ``__init__.py``."""
    files = sorted(ROOT.glob("*/__init__.py"))
    texts = {file.parent.name: ast.get_docstring(ast.parse(file.read_text())) for file in files}
    lines = {
        name: (text or "").split("\n")[0].removesuffix(".")
        for name, text in texts.items()
        if name != "tests"
    }
    return lines | {FRONT: "The package itself: import place_rings"}


def imports(room: str, known: set[str]) -> set[str]:
    """Return the other rooms that files of a room import."""
    front = {file.stem for file in (ROOT / FRONT).glob("*.py")}
    found: set[str] = set()
    for file in (ROOT / room).rglob("*.py"):
        # dots that lead out of the room
        up = len(file.relative_to(ROOT).parts) - (room == FRONT)
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.ImportFrom) and node.level == up:
                names = [node.module.split(".")[0]] if node.module else [x.name for x in node.names]
                found |= {FRONT if name in front else name for name in names}
    return (found & known) - {room}


def levels(below: dict[str, set[str]]) -> dict[str, int]:
    """Return the level of each room: 0 for the lowest, and as high as its importers allow."""
    above = {room: {r for r, b in below.items() if room in b} for room in below}
    level: dict[str, int] = {}
    while len(level) < len(below):
        ready = [r for r, a in above.items() if r not in level and a <= level.keys()]
        if not ready:
            raise SystemExit("the rooms import each other in a cycle")
        level |= {r: min((level[x] for x in above[r]), default=1) - 1 for r in ready}
    return {room: k - min(level.values()) for room, k in level.items()}


def needed(below: dict[str, set[str]]) -> list[tuple[str, str]]:
    """Return the arrows that do not follow from others."""

    def reach(room: str) -> set[str]:
        return below[room].union(*(reach(x) for x in below[room]))

    return [
        (room, to)
        for room, direct in below.items()
        for to in sorted(direct)
        if not any(to in reach(other) for other in direct - {to})
    ]


def draw(path: Path) -> None:
    """Draw the picture."""
    about = rooms()
    below = {room: imports(room, set(about)) for room in about}
    level = levels(below)
    rows = [sorted(r for r in about if level[r] == k) for k in range(max(level.values()) + 1)]
    figure, axes = plt.subplots(figsize=(11.5, 1.3 * len(rows)), dpi=110)
    arrows, place = needed(below), dict[str, tuple[float, float]]()
    for k, row in reversed(list(enumerate(rows))):  # each row below the rooms that import it
        above = [place[room][0] for room, to in arrows if to in row]
        middle = sum(above) / len(above) if above else 0.0
        for i, room in enumerate(row):
            place[room] = (middle + 1.25 * WIDE * (i - (len(row) - 1) / 2), 1.25 * k)
    for room, to in arrows:
        (x, y), (u, v) = place[room], place[to]
        # down to the row above the target's, past the boxes between them, then to the target
        corners = [(x, y - HIGH / 2), (x, v + 1.25 - HIGH / 2), (u, v + HIGH / 2)]
        arrow = FancyArrowPatch(
            path=Polyline(corners if level[room] - level[to] > 1 else corners[::2]),
            arrowstyle="-|>",
            mutation_scale=11,
            color=FAINT,
            lw=1.1,
            zorder=1,
        )
        axes.add_patch(arrow)
    for room, (x, y) in place.items():
        files = sum(1 for _ in (ROOT / room).rglob("*.py"))
        box = FancyBboxPatch(
            (x - WIDE / 2, y - HIGH / 2),
            WIDE,
            HIGH,
            boxstyle="round,pad=0.02,rounding_size=0.09",
            fc="white",
            ec=BLUE,
            lw=1.4,
            zorder=2,
        )
        axes.add_patch(box)
        axes.text(x, y + 0.24, f"{room}/  ({files} files)", **_TEXT, fontsize=10, color=INK)
        about_it = textwrap.fill(about[room], 33)
        axes.text(x, y - 0.13, about_it, **_TEXT, fontsize=7, color=INK)
    axes.set_xlim(*(f(x for x, _ in place.values()) + s for f, s in ((min, -WIDE), (max, WIDE))))
    axes.set_ylim(-0.6, 1.25 * len(rows) - 0.6)
    axes.axis("off")
    figure.savefig(path, bbox_inches="tight")


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "house.png")
