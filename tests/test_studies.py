"""The convergence study: what it measures, that it goes on where it stopped, and what it shows."""

import pytest
from place_rings.coverage.targets import Target
from place_rings.studies import convergence as study
from place_rings.studies.convergence_report import page, picture


@pytest.fixture
def small(monkeypatch):
    """A study of few and coarse measurements."""
    monkeypatch.setattr(study, "SETUPS", ("n1_8_0", "n3_16_55"))
    monkeypatch.setattr(study, "VOXELS", (0.1, 0.05))
    monkeypatch.setattr(study, "TOUCH_FROM", 0.05)
    monkeypatch.setattr(study, "TRUTH_WIDTH", 1e-2)
    monkeypatch.setattr(study, "TARGETS", (Target("V_S", 0.5), Target("V_S", 1.5), Target("V_OT")))


def test_goes_on_where_it_stopped_and_shows_all(small, tmp_path):
    file, told = tmp_path / "data.csv", []

    def stop_in_the_middle(done, total):
        told.append((done, total))
        if done == total // 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        study.measure(file, stop_in_the_middle)
    half = study.read_rows(file)
    assert len(half) == told[-1][1] // 2
    with file.open("a") as lines:
        lines.write("ur10,n1_8_0,V_S(0.5),cen")  # what a kill may leave
    rows = study.measure(file)
    assert rows[: len(half)] == half
    assert [r.key for r in rows] == [(r, s, str(t), rule, v) for r, s, t, rule, v in study.plan()]
    assert study.read_rows(file) == rows
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
