"""Draw pictures of the studies again from the tables beside them, without measuring anything.

The octrees of the paper's setups are counted again, which takes a minute. Two pictures of the paper
need the stored measurements and stay: the timeline and the undetected approaches.

Run: python results/redraw.py [paper | pareto | robots] ...
"""

import csv
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from place_rings.reporting import distance_figures
from place_rings.reporting.pages import html
from place_rings.studies.paper import report as paper_report
from place_rings.studies.pareto import report as pareto_report
from place_rings.studies.pareto.study import Point
from place_rings.studies.robots import report as robots_report
from place_rings.studies.robots.figure import picture as robots_picture
from place_rings.studies.robots.study import PAPERS, RobotRow, named_rings

RESULTS = Path(__file__).parent


def table(folder: Path, name: str) -> list[dict[str, str]]:
    """Return the rows of a table."""
    with (folder / name).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def paper(folder: Path) -> str:
    """Draw the octrees and the errors of the minimum distance; return the report's title."""
    keys = ("setup", "mode", "thing")
    results: dict[tuple[str, str, str], list[dict[str, float]]] = {}
    for row in table(folder, "distances.csv"):
        values = {k: float(v) if v else float("nan") for k, v in row.items() if k not in keys}
        results.setdefault((row["setup"], row["mode"], row["thing"]), []).append(values)
    distance_figures.errors(results, folder / "distance.png")
    distance_figures.zones(results, folder / "zones.png")
    distance_figures.monitoring(results, folder / "monitoring.png")
    paper_report.draw_octrees(folder)
    return paper_report.TITLE


def pareto(folder: Path) -> str:
    """Draw the front of near and far coverage; return the report's title."""
    rows = table(folder, "points.csv")
    first, second = (key for key in rows[0] if key.startswith("V_"))
    points = [
        Point(int(row["sensors"]), row["found"], [], float(row[first]), float(row[second]))
        for row in rows
    ]
    pareto_report.picture(points, (first, second), folder / "front.png")
    return pareto_report.TITLE


def robots(folder: Path) -> str:
    """Draw the robots and the coverage of their setups; return the report's title."""
    rows = [_robot_row(folder, row) for row in table(folder, "robots.csv")]
    robots_picture(rows, folder / "robots.png")
    return robots_report.TITLE


def _robot_row(folder: Path, row: dict[str, str]) -> RobotRow:
    robot, name = row["robot"], row["setup"]
    rings: Any = (
        named_rings(robot, name)
        if name in PAPERS
        else tomllib.loads((folder / f"{robot}_{name}.toml").read_text("utf-8"))["rings"]
    )
    percents = (float(row[f"{model}_percent"]) for model in ("ignore", "shadow", "blind"))
    finished = None if not row["finished"] else row["finished"] == "True"
    return RobotRow(robot, name, rings, *percents, int(row["unseeing"]), finished=finished)


STUDIES: dict[str, Callable[[Path], str]] = {"paper": paper, "pareto": pareto, "robots": robots}


def main() -> None:
    """Draw the pictures of the requested studies, or of all, and put them into their reports."""
    for name in sys.argv[1:] or STUDIES:
        folder = RESULTS / name
        title = STUDIES[name](folder)
        text = (folder / "README.md").read_text("utf-8")
        (folder / "report.html").write_text(html(text, folder, title), "utf-8")


if __name__ == "__main__":
    main()
