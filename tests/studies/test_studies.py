"""Studies: each cell is measured once and kept; what the convergence study shows."""

import json
import re
import sqlite3
import subprocess
import sys
from types import SimpleNamespace
from typing import get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings import _study_runs
from place_rings._study_arguments import StudyName
from place_rings.coverage.targets import Target
from place_rings.coverage.voxels.volume_tally import Bracket
from place_rings.formats.errors import UserError
from place_rings.objectives import verify as exact
from place_rings.placement.search.progress import Outcome
from place_rings.studies.convergence import report as convergence_report
from place_rings.studies.convergence import study
from place_rings.studies.convergence.report import page, picture
from place_rings.studies.engine import searching_tasks as searching
from place_rings.studies.engine.import_closure import import_closure
from place_rings.studies.engine.provenance import MeasurementRecorder, from_json
from place_rings.studies.engine.registry import TASKS
from place_rings.studies.engine.runner import run
from place_rings.studies.engine.store import Cell, Store

from ..support.rooms import ROOT

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


def test_a_study_goes_on_where_it_stopped(tmp_path):
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
        assert run(cells, {"square": square}, store, lambda *at: told.append(at)) == [
            0,
            1,
            4,
            9,
            16,
        ]
    assert calls == [0, 1, 2, 2, 3, 4]
    assert told == [(i, 5) for i in range(6)]
    with Store(tmp_path / "cells.sqlite", "2") as store:
        assert store.get(cells[0]) is None  # other code measured it


def test_a_file_that_is_no_store_is_refused_and_kept(tmp_path):
    (tmp_path / "text").write_text(
        "something else, long enough to look like a file of its own kind\n" * 40
    )
    with pytest.raises(UserError, match="no database"):
        Store(tmp_path / "text", "1")
    assert (tmp_path / "text").read_text().startswith("something else")
    base = sqlite3.connect(tmp_path / "other")
    base.execute("CREATE TABLE mine (x)")
    base.commit()
    base.close()
    with pytest.raises(UserError, match="form 0"):
        Store(tmp_path / "other", "1")


def test_a_study_has_its_file_alone(tmp_path):
    with Store(tmp_path / "cells.sqlite", "1") as store:
        store.put(Cell("work", {}), 1, 0.5)
        with pytest.raises(UserError, match="another study"):
            Store(tmp_path / "cells.sqlite", "1")
        store.put(Cell("work", {}), 2, 0.5)
    with Store(tmp_path / "cells.sqlite", "1") as store:
        assert store.get(Cell("work", {})) == 1  # what is kept stays


@pytest.mark.parametrize("work", ["place", "zeta"])
def test_what_ctrl_c_cut_short_is_not_kept(work, monkeypatch, tmp_path):
    """A search gives the best so far and a proof its last interval; neither is what was asked
    for.
    """
    best = SimpleNamespace(outcome=Outcome.INTERRUPTED)
    monkeypatch.setattr(searching, "searching", lambda *_, **__: best)
    monkeypatch.setattr(
        exact, "bracket", lambda *_: Bracket(0.1, 0.9, 1.0, 1.0, 1, 1, 1.0, reached=False)
    )
    counted = {
        "setup": "n1_8_0",
        "target": "V_S",
        "radius": 0.5,
        "rule": "certified",
        "voxel": None,
        "width": 0.01,
    }
    cells = {
        "place": Cell(
            "place", {"scene": {}, "rings_per_link": 1, "sensors_per_ring": 2, "seed": 0}
        ),
        "zeta": Cell("zeta", {"scene": {}, **counted}),
    }
    with Store(tmp_path / "cells.sqlite", "1") as store:
        with pytest.raises(KeyboardInterrupt):
            run([cells[work]], TASKS, store)
        assert store.get(cells[work]) is None


@pytest.fixture
def small(monkeypatch):
    """A study of few and coarse measurements."""
    monkeypatch.setattr(study, "SETUPS", ("n1_8_0", "n3_16_55"))
    monkeypatch.setattr(study, "VOXELS", (0.1, 0.05))
    monkeypatch.setattr(study, "TOUCH_FROM", 0.05)
    monkeypatch.setattr(study, "TRUTH_WIDTH", 3e-2)
    for module in (study, convergence_report):
        monkeypatch.setattr(module, "TARGETS", (Target("V_S", 0.5), Target("V_OT")))


@pytest.mark.long
def test_convergence_shows_every_rule_and_the_truth(small, tmp_path):
    with Store(tmp_path / "cells.sqlite", "test") as store:
        rows = study.measure(lambda cells: run(cells, TASKS, store))
        assert [r.key for r in rows] == [
            (r, s, str(t), rule, v) for r, s, t, rule, v in study.plan()
        ]
        assert study.measure(lambda cells: run(cells, {}, store)) == rows  # all was kept
    for row in rows:
        truth = next(r for r in rows if r.key[:3] == row.key[:3] and r.rule == "truth")
        if row.rule == "certified":
            assert row.low_percent <= truth.high_percent
            assert row.high_percent >= truth.low_percent
    assert all(study.order(rows, "certified", t) > 1.4 for t in ("V_S(0.5)", "V_OT"))
    picture(rows, tmp_path / "picture.png")
    assert (tmp_path / "picture.png").stat().st_size > 20_000
    text = page(rows, "place-rings study convergence")
    assert text.count("| n3_16_55 |") == 1
    assert "nan" not in text


@pytest.mark.parametrize("name", get_args(StudyName))
def test_a_study_imports_the_tasks_that_it_measures_with(name):
    """Tasks are registered before the store asks for their versions."""
    folder = ROOT / "studies" / name
    used = {
        work
        for file in folder.glob("*.py")
        for work in re.findall(r'Cell\(\s*"([^"]+)"', file.read_text("utf-8"))
    }
    reached = import_closure([folder / "study.py"])
    registered = {
        task
        for file in reached
        for task in re.findall(r'@register\("([^"]+)"\)', file.read_text("utf-8"))
    }
    assert used
    assert used <= registered


def test_a_study_starts_in_a_fresh_interpreter(tmp_path):
    """No other module has registered its tasks there."""
    text = (
        "import place_rings._study as s, place_rings._study_pages as p, sys\n"
        "def robots(measure, folder, options):\n"
        "    (folder / 'README.md').touch()\n"
        "    return measure('h', [p.Cell('zeta', {\n"
        "        'scene': {}, 'setup': 'n1_8_0', 'target': 'V_S', 'radius': 0.5,\n"
        "        'rule': 'centre', 'voxel': 0.1})])\n"
        "p.STUDIES['robots'] = robots\n"
        "print(s.study('robots', folder=sys.argv[1]).data[0]['zeta_percent'] > 0)\n"
    )
    asked = [sys.executable, "-c", text, str(tmp_path / "out")]
    done = subprocess.run(asked, capture_output=True, text=True, cwd=tmp_path, timeout=120)
    assert done.stdout.strip() == "True", done.stderr


def test_the_processes_of_a_study_have_ended_when_the_load_is_read(tmp_path):
    """Else their work would count as that of others, and the page would call the machine busy."""
    text = """
import sys

import psutil
from place_rings import _study_runs, study
from place_rings.studies.engine.provenance import MeasurementRecorder

counts = []

def is_worker(child):
    try:
        return "spawn_main" in " ".join(child.cmdline())
    except psutil.Error:  # it has just ended
        return False

def count():
    counts.append(sum(is_worker(child) for child in psutil.Process().children(recursive=True)))

class Recorder(MeasurementRecorder):
    def record(self, earlier=None):
        count()
        return super().record(earlier)

def nothing(measure, out, options):
    count()
    (out / "README.md").write_text("A page.\\n")

if __name__ == "__main__":
    _study_runs.MeasurementRecorder = Recorder
    _study_runs.STUDIES["convergence"] = nothing
    study("convergence", folder=sys.argv[1], workers=2)
    print(counts)
"""
    program = tmp_path / "counts.py"  # its workers read it, too
    program.write_text(text)
    asked = [sys.executable, str(program), str(tmp_path / "out")]
    done = subprocess.run(asked, capture_output=True, text=True, cwd=tmp_path, timeout=300)
    assert done.stdout.strip() == "[2, 0]", done.stderr


def test_a_page_tells_of_earlier_runs_only_while_their_measurements_are_used(tmp_path):
    def runs(measured, reused):
        (tmp_path / "README.md").write_text("A page.\n")
        recorder = MeasurementRecorder("a command", [ROOT / "studies/engine/store.py"])
        recorder.count(measured, reused)
        _study_runs._write_record("robots", tmp_path, recorder)
        return len(from_json((tmp_path / "provenance.json").read_text()).runs)

    assert [runs(9, 0), runs(9, 0), runs(2, 7), runs(0, 9), runs(9, 0)] == [1, 1, 2, 2, 1]
