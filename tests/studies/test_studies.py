"""Studies: each cell is measured once and kept; what the convergence study shows."""

import json
import re
import sqlite3
import subprocess
import sys
import time
from datetime import UTC, datetime, timedelta
from importlib.metadata import version
from types import SimpleNamespace
from typing import get_args
from zlib import crc32

import place_rings as pr
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings._study import StudyCall, measured
from place_rings.coverage.definitions.errors import UserError
from place_rings.coverage.voxels.volume_tally import Bracket
from place_rings.objectives import verify as exact
from place_rings.placement.search.progress import Outcome
from place_rings.studies.convergence import report as convergence_report
from place_rings.studies.convergence import study
from place_rings.studies.engine import tasks as searching
from place_rings.studies.engine.estimate import Estimate, rehearsed
from place_rings.studies.engine.measurement import Measurement
from place_rings.studies.engine.options import StudyName
from place_rings.studies.engine.runner import TASKS, run
from place_rings.studies.engine.store import Cell, Store
from place_rings.studies.pareto.study import QUICK_POINTS

from ..support.coarse_study import make_coarse
from ..support.refusals import refused
from ..support.rooms import ROOT, imported_files

JSON = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**53), 2**53)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=8,
)


@given(
    arguments=st.dictionaries(st.text(), JSON, max_size=4),
    result=JSON.filter(lambda value: value is not None),
)
def test_a_store_gives_back_what_it_was_given(arguments, result, tmp_path_factory):
    with Store(tmp_path_factory.mktemp("store") / "cells.sqlite", "1") as store:
        cell = Cell("work", arguments)
        assert store.get(cell) is None
        store.put(cell, result, 1.5)
        assert store.get(Cell("work", json.loads(json.dumps(arguments)))) == result
        assert store.get(Cell("other", arguments)) is None


def test_a_study_resumes_where_it_stopped(tmp_path):
    calls, cells = [], [Cell("square", {"x": x}) for x in range(5)]

    def square(x):
        calls.append(x)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return x * x

    with Store(tmp_path / "cells.sqlite", "1") as store, pytest.raises(KeyboardInterrupt):
        run(cells, {"square": square}, store)
    told = []
    with Store(tmp_path / "cells.sqlite", "1") as store:
        found = run(cells, {"square": square}, store, lambda *at: told.append(at))
        store.put(cells[0], -1, 0.5)
        assert store.get(cells[0]) == 0  # what is kept stays
    with Store(tmp_path / "cells.sqlite", "1") as store:
        run([*cells, Cell("square", {"x": 5})], {"square": square}, store)
        assert store.measured == 1
    assert found == [0, 1, 4, 9, 16]
    assert calls == [0, 1, 2, 2, 3, 4, 5]
    assert told == [(i, 5) for i in range(6)]
    with Store(tmp_path / "cells.sqlite", "2") as store:
        assert store.get(cells[0]) is None  # another version measured it


def test_a_file_that_is_no_store_or_is_in_use_is_refused_and_kept(tmp_path):
    text = "something else, long enough to look like a file of its own kind\n" * 40
    (tmp_path / "text").write_text(text)
    with pytest.raises(UserError, match="text"):
        Store(tmp_path / "text", "1")
    assert (tmp_path / "text").read_text() == text
    base = sqlite3.connect(tmp_path / "other")
    base.execute("CREATE TABLE mine (x)")
    base.commit()
    base.close()
    with pytest.raises(UserError, match=r"other: .*\b0\b"):
        Store(tmp_path / "other", "1")
    with Store(tmp_path / "cells.sqlite", "1"), pytest.raises(UserError, match=r"cells\.sqlite"):
        Store(tmp_path / "cells.sqlite", "1")


@pytest.mark.parametrize("work", ["place", "zeta"])
def test_what_ctrl_c_cut_short_is_not_kept(work, monkeypatch, tmp_path):
    """A search gives the best so far and a proof its last interval; neither is the answer."""
    best = SimpleNamespace(outcome=Outcome.INTERRUPTED)
    monkeypatch.setattr(searching, "searching", lambda *_, **__: best)
    monkeypatch.setattr(
        exact, "bracket", lambda *_: Bracket(0.1, 0.9, 1.0, 1.0, 1, 1, 1.0, reached=False)
    )
    target = {"setup": "n1_8_0", "target": "V_S", "radius": 0.5}
    asked = {
        "place": {"rings_per_link": 1, "sensors_per_ring": 2, "seed": 0},
        "zeta": {**target, "rule": "certified", "voxel": None, "width": 0.01},
    }
    cell = Cell(work, {"scene": {}, **asked[work]})
    with Store(tmp_path / "cells.sqlite", "1") as store:
        with pytest.raises(KeyboardInterrupt):
            run([cell], TASKS, store)
        assert store.get(cell) is None


@pytest.fixture
def small(monkeypatch):
    make_coarse(monkeypatch)


@pytest.mark.slow
def test_convergence_shows_every_rule_and_the_truth(small, tmp_path):
    with Store(tmp_path / "cells.sqlite", "test") as store:
        rows = study.measure(lambda _, cells: run(cells, TASKS, store))
        assert [r.key for r in rows] == [
            (r, s, str(t), rule, v) for r, s, t, rule, v in study.plan()
        ]
        assert study.measure(lambda _, cells: run(cells, {}, store)) == rows  # all was kept
    for row in rows:
        truth = next(r for r in rows if r.key[:3] == row.key[:3] and r.rule == "truth")
        if row.rule == "certified":
            assert row.low_percent <= truth.high_percent
            assert row.high_percent >= truth.low_percent
    assert study.order(rows, "certified", "V_S(0.5)") > 1.4
    files = convergence_report.write(rows, tmp_path)
    assert (tmp_path / "convergence.png").stat().st_size > 20_000
    assert "| n3_16_55 |" in files["README.md"]
    assert "nan" not in files["README.md"]


def reached(file, found):
    """Add a file of studies/, and those of them that it imports, to a set."""
    found.add(file)
    for other in imported_files(file):
        if other not in found and other.is_relative_to(ROOT / "studies"):
            reached(other, found)
    return found


@pytest.mark.parametrize("name", get_args(StudyName))
def test_a_study_imports_the_tasks_that_it_measures_with(name):
    def in_text(pattern, files):
        return {found for file in files for found in re.findall(pattern, file.read_text("utf-8"))}

    folder = ROOT / "studies" / name
    used = in_text(r'Cell\(\s*"([^"]+)"', folder.glob("*.py"))
    used |= {"zeta"} if in_text(r"(zeta_cell)\(", folder.glob("*.py")) else set()
    assert used
    assert used <= in_text(r'@register\("([^"]+)"\)', reached(folder / "study.py", set()))


@pytest.mark.slow
def test_a_study_begins_in_a_fresh_interpreter(tmp_path):
    """With a volume of the user's own; no other module has registered its tasks there."""
    text = """
import sys
import place_rings as pr
from place_rings.studies.engine.runner import TASKS
from place_rings.studies.engine.store import Store
def first(self, cell):
    print("begun:", cell.work, cell.work in TASKS)
    raise KeyboardInterrupt
Store.get = first
way = pr.Box((0.8, 2, 1), (0.9, 0, 0.6), name="way")
try:
    pr.study("pareto", folder=sys.argv[1], targets=(way, pr.Shell(0.5)))
except KeyboardInterrupt:
    pass
"""
    asked = [sys.executable, "-c", text, str(tmp_path / "out")]
    done = subprocess.run(asked, capture_output=True, text=True, cwd=tmp_path, timeout=120)
    assert re.fullmatch(r"begun: .+ True\n", done.stdout), done.stderr


def test_a_page_names_how_it_was_measured_below_its_title(tmp_path):
    measured = Measurement.begin("place-rings study robots", ROOT)
    now = datetime.now(UTC)
    days = {(now - timedelta(days=n)).strftime("%Y-%m-%d") for n in (0, 1)}
    assert (measured.version, measured.command) == (
        version("place-rings"),
        "place-rings study robots",
    )
    assert measured.date in days
    assert measured.load >= 0
    assert measured.processor
    if (ROOT / ".git").exists():
        assert re.fullmatch(r"[0-9a-f]{12}\+?", measured.commit)
    page = tmp_path / "README.md"
    page.write_text("# Robots\n\nText.\n")
    measured.head(page)
    title, blank, header, *rest = page.read_text().splitlines()
    assert (title, blank, rest) == ("# Robots", "", ["", "Text."])
    parts = (measured.version, measured.date, measured.processor, f"{measured.load:.2f}")
    for part in (*parts, measured.commit or "", f"`{measured.command}`"):
        assert part in header
    page.write_text("# Robots\n\nText.\n")
    measured.head(page, kept=7)
    assert page.read_text().splitlines()[2].startswith(f"{header}; 7 ")


@pytest.mark.parametrize("name", get_args(StudyName))
def test_a_rehearsal_lists_what_a_study_measures(name, tmp_path):
    """Without a measurement; and its time is that of the cells that are not stored yet."""
    call = StudyCall(name, **({"sensors": 24, "quick": True} if name == "pareto" else {}))
    calls = rehearsed(lambda run: measured(run, call, lambda *_: None))
    with Store(tmp_path / "cells.sqlite", "1") as store:
        whole = Estimate.of(calls, store, 1, 1.0)
        assert whole.seconds > 1
        assert whole.cells == len({cell.key for cells in calls for cell in cells})
        assert Estimate.of(calls, store, 4, 1.0).seconds == pytest.approx(whole.seconds / 4)
        store.put(calls[0][0], 0, 1e-3)
        rest = Estimate.of(calls, store, 1, 1.0)
        assert rest.calls[0] < whole.calls[0]
        assert rest.cells == whole.cells - 1
    if name == "pareto":
        searches = [cell for cells in calls for cell in cells if cell.work == "place"]
        assert 3 < len(searches) <= 3 + QUICK_POINTS
        assert all(cell.arguments["short"] for cell in searches)


@given(
    st.lists(st.lists(st.floats(0.1, 100), min_size=1, max_size=5), min_size=1, max_size=5),
    st.floats(0.2, 5),
    st.integers(1, 8),
)
def test_the_time_left_falls_to_nothing_at_the_pace_of_the_study(costs, pace, workers):
    """Cells take ``pace`` times what was expected; near the end that is known."""
    now, calls = (
        [0.0],
        [
            [Cell("x", {"s": s, "i": (i, j)}) for j, s in enumerate(each)]
            for i, each in enumerate(costs)
        ],
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(time, "monotonic", lambda: now[0])
        sums = [sum(each) for each in costs]
        estimate = Estimate(sums, 0, workers, lambda cell: cell.arguments["s"])
        before = estimate.seconds
        assert before == pytest.approx(sum(sums) / workers)
        for cells, each in zip(calls, costs, strict=True):
            estimate.begin(cells)
            for done in range(len(each) + 1):
                estimate.at(done, len(each))
                rest = estimate.left
                now[0] += pace * sum(each) / len(each) / workers * (done < len(each))
                assert 0 <= rest <= max(pace, 1) * before * (1 + 1e-9) + 1e-9
    assert rest == pytest.approx(0)


def test_the_page_of_fronts_grows_and_a_stopped_study_goes_on(tmp_path, monkeypatch):
    searched = []

    def place(**asked):
        searched.append(asked)
        where = crc32(repr(asked).encode()) / 2**32
        return [{"link": "forearm", "position": where, "count": 24, "radius": 0.08}]

    def zeta(setup, radius, **_):
        share = 100 * setup[0]["position"] if isinstance(setup, list) else 1.0
        return {"zeta_percent": share if radius == 0.5 else 100 - share}

    monkeypatch.setitem(TASKS, "place", place)
    monkeypatch.setitem(TASKS, "zeta", zeta)

    def stop(heading, done, total):
        if len(searched) == 5:
            raise KeyboardInterrupt

    asked = {"sensors": 24, "quick": True, "folder": tmp_path}
    with pytest.raises(KeyboardInterrupt):
        pr.study("pareto", **asked, progress=stop)
    first = (tmp_path / "data.csv").read_text().splitlines()
    assert len(first) > 3
    assert (tmp_path / "pareto.png").exists()
    assert "unfinished" in (tmp_path / "README.md").read_text().splitlines()[2]
    whole = pr.study("pareto", **asked)
    assert len({repr(one) for one in searched}) == len(searched)
    assert len(whole.data) == len((tmp_path / "data.csv").read_text().splitlines()) - 1
    assert len(whole.data) > len(first) - 1
    assert "unfinished" not in whole.page.read_text().splitlines()[2]


def test_a_full_disk_is_one_line_and_keeps_what_was_measured(tmp_path):
    file, first, second = tmp_path / "cells.sqlite", Cell("work", {"n": 1}), Cell("work", {"n": 2})
    with Store(file, "1") as store:
        store.put(first, [1.5], 0.1)
        pages = store._base.execute("PRAGMA page_count").fetchone()[0]
        store._base.execute(f"PRAGMA max_page_count = {pages}")
        with refused("cells.sqlite"):
            store.put(second, ["x" * 100_000], 0.1)
    with Store(file, "1") as store:
        assert store.get(first) == [1.5]
        assert store.get(second) is None
