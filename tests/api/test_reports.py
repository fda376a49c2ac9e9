"""The API's longer tasks, improve, safety and study: the same answers as their commands give."""

import json
import sqlite3
import tomllib
from multiprocessing.reduction import ForkingPickler

import numpy as np
import place_rings as pr
import pytest
from place_rings.coverage.targets.named import Shell
from place_rings.objectives.verify import Verifier
from place_rings.placement.redesign import redesign
from place_rings.placement.redesign.beam_search import BeamPlan, Stage
from place_rings.placement.search.progress import Outcome
from place_rings.studies.convergence import study as convergence

from ..support.coarse_study import make_coarse

NEAR = pr.Scene(targets=[pr.Shell(0.5)])
SWING = pr.Trajectory([0.0, 0.5], np.radians([[0.0] * 6, [10.0] * 6]))
PAPER = pr.Scene.paper(targets=[pr.Shell(0.5)])  # compiles in an eighth of the time
BRIEF = {"changes": 1, "voxel": 0.05}
TINY = BeamPlan(24, 256, 0.05, 3, (Stage(0.03, 8, 2),), 512, 1)


@pytest.fixture(scope="module", autouse=True)
def tiny():
    """Improvements of few steps, of the command as of Python: what they find need not be good."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(redesign, "BeamPlan", lambda: TINY)
        yield


def without(record, *keys):
    """Return JSON without some keys on every level."""
    if isinstance(record, dict):
        return {key: without(value, *keys) for key, value in record.items() if key not in keys}
    return [without(one, *keys) for one in record] if isinstance(record, list) else record


@pytest.fixture(scope="module")
def better():
    stages = []
    result = pr.improve("n1_8_0", PAPER, **BRIEF, progress=lambda p: stages.append(p.stage))
    assert stages
    return result


def test_improve_gives_what_the_command_prints(run, better):
    options = ("--paper", "--changes", 1, "--voxel", 0.05, "--json")
    code, out, _ = run("improve", "n1_8_0", "--target", "V_S:0.5", *options)
    assert code == 0
    ours = better.record.model_dump(mode="json")
    assert without(json.loads(out), "seconds") == without(ours, "seconds")


@pytest.mark.slow  # compiles
def test_counts_of_an_improvement_state_the_model_of_occlusion():
    record = pr.improve("n1_8_0", PAPER.replace(occlusion="shadow"), **BRIEF).record
    counts = [*record.zeta, *(zeta for step in record.steps for zeta in step.zeta)]
    assert {count.occlusion for count in counts} == {"shadow"}


def test_the_steps_of_an_improvement_are_proposals(better, tmp_path):
    (step,) = better.steps
    assert step.setup == better.setup != pr.Setup.named("n1_8_0")
    assert better.before < better.coverage == step.coverage
    counted = Verifier(PAPER, 0.05).verify(better.setup, Shell(0.5))
    assert better.coverage == counted.zeta
    assert better.name.startswith("n1_8_0")
    assert len(better.instructions) == 1
    files = better.save(tmp_path)
    assert [file.name for file in files] == ["changes_1.toml", "improve.png", "improve.json"]
    text = files[0].read_text()
    assert better.instructions[0][0] in text
    assert pr.load(files[0]).setup == better.setup
    assert tomllib.loads(text)["found"]["command"] == "place_rings.improve(..., seed=0)"
    assert ForkingPickler.loads(ForkingPickler.dumps(better)).setup == better.setup


def test_ctrl_c_in_the_last_count_leaves_out_the_rest(better, monkeypatch):
    def stop(*_):
        raise KeyboardInterrupt

    again = pr.improve("n1_8_0", PAPER, **BRIEF)
    monkeypatch.setattr(Verifier, "verify", stop)
    assert again.record.zeta == []
    assert [step.zeta for step in again.record.steps] == [()]
    assert again.coverage == better.coverage


def test_ctrl_c_returns_the_changes_until_then():
    def stop(_):
        raise KeyboardInterrupt

    stopped = pr.improve("n1_8_0", PAPER, **BRIEF, progress=stop)
    assert stopped.outcome is Outcome.INTERRUPTED
    assert stopped.coverage >= stopped.before


@pytest.mark.parametrize(
    "moving",
    [pytest.param(False, marks=pytest.mark.slow, id="pose"), pytest.param(True, id="motion")],
)
def test_safety_gives_what_the_command_prints(run, tmp_path, moving):
    rows = "".join(
        f"{t},{','.join(map(repr, q.tolist()))}\n"
        for t, q in zip(SWING.time_s, SWING.q, strict=True)
    )
    (tmp_path / "swing.csv").write_text("t,q0,q1,q2,q3,q4,q5\n" + rows)
    options = ("--trajectory", "swing.csv") if moving else ()
    code, out, _ = run("safety", "n1_8_0", *options, "--approaches", 6, "--json")
    assert code == 0
    seen = []
    report = pr.safety(
        "n1_8_0",
        approaches=6,
        trajectory=SWING if moving else None,
        progress=lambda *done: seen.append(done),
    )
    ours = report.record.model_dump(mode="json")
    assert without(json.loads(out), "seconds") == without(ours, "seconds")
    assert seen[0] == (0, seen[0][1])
    assert seen[-1] == (seen[0][1],) * 2
    low, high = report.interval
    assert low <= report.in_time <= high
    assert report.in_time == pytest.approx(report.approaches.in_time.mean())


def test_a_safety_report_saves_what_the_command_writes(run, tmp_path):
    assert run("safety", "n1_8_0", "--approaches", 6, "--out", "theirs")[0] == 0
    report = pr.safety("n1_8_0", approaches=6)
    files = report.save(tmp_path / "ours")
    assert {file.name for file in files} == {f.name for f in (tmp_path / "theirs").iterdir()}
    for name in ("approaches.csv", "safety.png"):
        assert (tmp_path / "ours" / name).read_bytes() == (tmp_path / "theirs" / name).read_bytes()
    assert ForkingPickler.loads(ForkingPickler.dumps(report)).record == report.record


def test_a_motion_file_is_the_motion_of_its_numbers(tmp_path):
    path = tmp_path / "swing.csv"
    path.write_text("t,q0,q1,q2,q3,q4,q5\n0,0,0,0,0,0,0\n0.5,10,10,10,10,10,10\n")
    file = pr.Trajectory.from_csv(path, degrees=True).record(pr.robots["ur10"])
    ours = SWING.record(pr.robots["ur10"])
    np.testing.assert_allclose(file.q, ours.q)
    np.testing.assert_array_equal(file.time_s, ours.time_s)


@pytest.mark.slow
def test_a_study_writes_what_the_command_writes_and_resumes(run, monkeypatch, tmp_path):
    make_coarse(monkeypatch)

    def stop(heading, done, total):
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        pr.study("convergence", folder=tmp_path / "ours", progress=stop)
    told = []
    ours = pr.study("convergence", folder=tmp_path / "ours", progress=lambda *at: told.append(at))
    assert {heading for heading, _, _ in told} == {"measuring"}
    assert len(ours.data) == len(convergence.plan())
    assert ours.page.read_text() == ours._repr_markdown_()
    assert {file.name for file in ours.files} >= {"README.md", "cells.sqlite", "data.csv"}

    def kept():
        texts = {
            name: (tmp_path / "ours" / name).read_bytes()
            for name in ("data.csv", "convergence.png")
        }
        with sqlite3.connect(tmp_path / "ours" / "cells.sqlite") as base:
            return texts, base.execute("SELECT * FROM cells ORDER BY key").fetchall()

    before = kept()
    page = ours.page.read_text().splitlines()
    # the command resumes from the measurements of the function
    code, out, _ = run("study", "convergence", "--out", tmp_path / "ours")
    assert (code, out.strip()) == (0, str(ours.page))
    assert kept() == before
    again = ours.page.read_text().splitlines()
    assert again[:2] + again[3:] == page[:2] + page[3:]  # all but the header
    for header in (page[2], again[2]):
        assert pr.__version__ in header
        assert "place-rings study convergence" in header
