"""The study of optimality gaps: its cells, its page and its picture."""

import re

from place_rings.placement.bound.coverage_bound import CoverageBound, TermBound
from place_rings.studies.gap import report, study
from place_rings.studies.gap.study import bound


def rows_of(cells_run):
    """Rows of the study with stated bounds and coverages; ``cells_run`` collects the cells."""

    def run(heading, cells):
        cells_run.extend(cells)
        if cells and cells[0].work == "upper bound":
            upper = [{12: 60.0, 24: 80.0}.get(cell.arguments["sensors"], 100.0) for cell in cells]
            return [
                {"bound_percent": u, "volume_percent": 2 * u, "prices_percent": u, "seconds": 1.0}
                for u in upper
            ]
        if cells and cells[0].work == "place":
            return [[{"link": "tool", "count": 8}] for _ in cells]
        return [{"zeta_percent": 20.0} for _ in cells]

    return study.measure(run)


def test_every_case_has_a_bound_and_unknown_ones_a_search(tmp_path, monkeypatch):
    monkeypatch.delitem(study.KNOWN, ("V_OT", 48))
    cells = []
    rows = rows_of(cells)
    works = [cell.work for cell in cells]
    assert works.count("upper bound") == len(study.CASES) == len(rows)
    unknown = [case for case in study.CASES if (str(case[0]), case[1]) not in study.KNOWN]
    assert works.count("place") == works.count("zeta") == len(unknown) > 0
    for row in rows:
        assert row.known_percent == study.KNOWN.get((row.target, row.sensors), 20.0)
        assert row.gap == row.bound_percent - row.known_percent
    files = report.write(rows, tmp_path)
    tight, loose, nothing = (
        re.search(rf"\*\*{kind}\*\*(.*?)(\*\*|\Z)", files["README.md"], re.S)[1]
        for kind in ("Tight", "Loose", "Says nothing")
    )
    assert "V_S(0.5) with 24" in tight
    assert "V_S(0.5) with 12" in loose
    assert "V_OT with 80" in nothing
    assert files["data.csv"].count("\n") == 1 + len(rows)
    assert (tmp_path / "gap.png").stat().st_size > 10_000


def test_the_task_returns_the_bound_with_its_parts(monkeypatch):
    fixed = CoverageBound(0.5, terms=(TermBound("V_OT", 0, 0.5, 0.5, 1.0),))
    monkeypatch.setattr("place_rings.studies.gap.study.upper_bound", lambda *_: fixed)
    row = bound({"targets": [{"name": "V_OT"}]}, 48)
    assert row.pop("seconds") < 60
    assert row == {"bound_percent": 50.0, "volume_percent": 50.0, "prices_percent": 100.0}
