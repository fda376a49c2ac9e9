"""The reproduced paper: which cells it asks for, how statements are judged, and what its page
shows.
"""

import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.rings.ring import named_setup
from place_rings.objectives.scene import Scene
from place_rings.reporting.pages import csv_text, table
from place_rings.simulation.distance import Series, measures
from place_rings.studies.engine.scenes import setup_from
from place_rings.studies.engine.tasks import zeta
from place_rings.studies.paper import cone_volume
from place_rings.studies.paper import coverage_cells as paper
from place_rings.studies.paper import report as paper_page
from place_rings.studies.paper import study as paper_study
from place_rings.studies.paper.coverage_statements import coverage
from place_rings.studies.paper.figures import value
from place_rings.studies.paper.statements import Verdict, judged

READINGS = [("a", "centre"), ("a", "touch"), ("b", "centre"), ("b", "touch")]


@given(answers=st.lists(st.booleans(), min_size=4, max_size=4))
def test_a_statement_agrees_in_all_readings_differs_in_none(answers):
    by_reading = dict(zip(READINGS, answers, strict=True))
    why = {verdict: verdict.value for verdict in Verdict}
    found = judged("said", lambda reading: ("1", by_reading[reading]), why, READINGS)
    expected = (
        Verdict.AGREES if all(answers) else Verdict.UNDECIDED if any(answers) else Verdict.DIFFERS
    )
    assert found.verdict is expected
    assert found.why == expected.value
    assert found.found.count("✗") == 4 - sum(answers)


@pytest.mark.parametrize("name", paper.OPEN_SETUPS)
def test_rings_that_are_not_varied_are_the_named_setup(name):
    assert setup_from(paper.rings(name), Scene.paper()) == named_setup(name)
    moved = setup_from(paper.rings(name, inset=0.1, phase_deg=5.0, radius=0.1), Scene.paper())
    assert all(0.1 <= ring.position <= 0.9 for ring in moved.rings if ring.link != "tool")
    assert {ring.radius for ring in moved.rings} == {0.1}
    assert all(ring.phase == pytest.approx(math.radians(5)) for ring in moved.rings)


def test_each_variant_changes_one_thing():
    chosen, *others = paper.variants()
    assert chosen == paper.Variant(paper.AS_CHOSEN)
    for variant in others:
        assert [bool(variant.keys), bool(variant.rings), variant.voxels != 1].count(True) == 1
    assert len({v.name for v in others}) == len(others)


def test_a_work_counts_what_the_verifier_counts():
    found = zeta({}, "n3_16_55", "V_S", 0.5, "centre", 0.05)
    assert found["zeta_percent"] == pytest.approx(100 * found["covered"] / found["target"])
    certified = zeta({}, "n3_16_55", "V_S", 0.5, "certified", None, 0.02)
    assert certified["low_percent"] <= found["zeta_percent"] + 0.5
    assert certified["high_percent"] - certified["low_percent"] <= 2
    same = zeta({"ring_radius": 0.08}, paper.rings("n3_16_55"), "V_S", 0.5, "centre", 0.05)
    assert same["covered"] == found["covered"]


@pytest.fixture(scope="module")
def findings():
    """Every table of the study, with counts that are quick and wrong: what matters is what is made
    of them.
    """
    rng = np.random.default_rng(7)

    def told():
        true, off, seen = rng.uniform(0, 2, 50), rng.normal(0, 0.1, 50), rng.uniform(size=50) < 0.8
        speeds = rng.normal(size=(2, 50, 2))
        return measures(
            Series(np.arange(50) / 10, true, true + off, true + off, seen, *speeds), 1.5
        )

    answers = {
        "place": lambda: paper.rings("n2_16_25"),
        "zeta": lambda: {"zeta_percent": float(rng.uniform(30, 90))},
        "minimum distance": told,
        "unseen approach": lambda: [
            {"radius": r, "gap_m": 0.2, "path": [[2, 0, 0], [1, 0, 0.5]]} for r in (0.05, 0.1)
        ],
    }
    return paper_study.measure(lambda heading, cells: [answers[cell.work]() for cell in cells])


def test_the_study_asks_for_all_that_the_paper_measured(findings):
    for chain in paper.CHAINS:
        for rule, _ in paper.COUNTS:
            for setup in paper.SETUPS:
                for target in ("V_O", "V_T", "V_OT", "V_S(0.5)", "V_S(1.5)"):
                    value(
                        findings.configurations, chain=chain, rule=rule, setup=setup, target=target
                    )
            for theta in range(0, 61, 5):
                for target in (
                    "V_O",
                    "V_T",
                    "V_OT",
                    *(f"V_S({r})" for r in (0.5, 0.7, 0.9, 1.1, 1.5)),
                ):
                    value(findings.tilts, chain=chain, rule=rule, at=theta, target=target)
    assert set(findings.searched) == {
        f"{goal} {n}" for goal in ("near", "far", "both") for n in (48, 80, 112)
    }
    assert len({row.at for row in findings.cycle}) == paper.ALONG


def test_cells_are_asked_once():
    cells = [cell for _, cell in (*paper.configurations({}), *paper.tilts(), *paper.openness())]
    assert len({cell.key for cell in paper.searches().values()}) == 9
    questions = [cell.key for _, cell in paper.tilts()]
    assert len(set(questions)) == len(questions)
    assert all(cell.work == "zeta" for cell in cells)


def test_the_page_holds_every_statement_and_count(findings, tmp_path, monkeypatch):
    monkeypatch.setattr(cone_volume, "PLACES", 2)
    files = paper_page.write(findings, tmp_path)
    page = files["README.md"]
    for statement in coverage(findings.configurations, findings.tilts):
        assert statement.said.replace("|", "\\|") in page
    pictures = re.findall(r"!\[[^\]]+\]\((\S+\.png)\)", page)
    assert len(pictures) == 2
    assert all((tmp_path / name).stat().st_size > 20_000 for name in pictures)
    assert "nan" not in page
    rows = (findings.configurations, findings.tilts, findings.cycle, findings.open)
    assert files["data.csv"].count("\n") == sum(map(len, rows)) + 1


def test_the_volume_of_one_cone_by_its_voxels(monkeypatch):
    monkeypatch.setattr(cone_volume, "PLACES", 12)
    monkeypatch.setattr(cone_volume, "VOXELS", cone_volume.VOXELS[:3])
    rows, exact = cone_volume.cone_volumes(), 0.1737
    assert [(row["rule"], row["voxel"]) for row in rows] == [
        (r, v) for r in ("centre", "touch") for v in cone_volume.VOXELS
    ]
    for row in rows:
        assert row["volume_m3"] == pytest.approx(row["voxels"] * row["voxel"] ** 3)
        # the mean over all places is the volume; four deviations of a mean of 12
        if row["rule"] == "centre":
            assert abs(row["mean_m3"] - exact) < 1.2 * row["deviation_m3"]
        else:
            assert row["volume_m3"] > exact
    touched = [row["mean_m3"] for row in rows if row["rule"] == "touch"]
    assert touched == sorted(touched, reverse=True)


@given(
    cells=st.lists(st.text(st.characters(exclude_categories=("C", "Z"))), min_size=2, max_size=2)
)
def test_a_cell_of_a_table_stays_one_cell(cells, tmp_path_factory):
    text = table(("a", "b"), [cells])
    lines = text.splitlines()
    assert len(lines) == 3
    assert len(re.split(r"(?<!\\)\|", lines[2])) == 4


def test_a_table_of_values_quotes_what_has_a_comma():
    assert csv_text([{"a": 1, "b": "x,y"}]) == 'a,b\n1,"x,y"\n'
