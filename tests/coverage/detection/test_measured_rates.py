"""Rates that a user measured: monotone, exact where measured, and refused beyond."""

import numpy as np
import place_rings as pr
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.detection.detection import Detection, bounds, detectors
from place_rings.coverage.detection.law import per_frame
from place_rings.coverage.detection.measured_rates import MeasuredRate, RateTable, intervals
from scipy.stats import binomtest

from tests.support.refusals import refused

HEAD = "distance_m,reflectance,rate,frames\n"
ROW = "0.5,0.17,0.9,100\n"
BAD = {
    "": "line 1 nothing distance_m",
    HEAD: "no rate",
    HEAD.replace("rate", "share") + ROW: "line 1 distance_m",
    HEAD + ROW.replace("0.9", "1.1"): "line 2 rate",
    HEAD + ROW.replace("0.9", "nan"): "line 2 rate",
    HEAD + ROW.replace("0.5", "0"): "line 2 distance_m",
    HEAD + ROW.replace("0.17", "17"): "line 2 reflectance",
    HEAD + ROW.replace("100", "0"): "line 2 frames",
    HEAD + ROW.replace("100", "1e9"): "line 2 frames",
    HEAD + ROW.replace(",100", ""): "line 2 fields 4",
    HEAD.replace("rate", "width_m,rate") + ROW.replace("0.9", "0.1,0.9"): "line 2 height_m",
    HEAD + ROW + "0.9,0.17,1,100\n": "line 3 rate 1.0 falls",
    HEAD + ROW * 1001: "1001 1000",
    HEAD + '"' + "x" * 200_000: "CSV",
    HEAD + ROW * 20_000: "256 kB",
}


@pytest.mark.parametrize(("text", "parts"), BAD.items(), ids=range(len(BAD)))
def test_a_bad_file_is_one_line(tmp_path, text, parts):
    path = tmp_path / "rates.csv"
    path.write_text(text)
    with refused(f"rates.csv {parts}"):
        pr.detection_rates(path)


def table(rates, frames=400, **row):
    """Return a table of rates at 0.2, 0.4, ... m."""
    return RateTable(
        [
            MeasuredRate(
                distance_m=0.2 * (i + 1), rate=r, frames=frames, **({"reflectance": 0.1} | row)
            )
            for i, r in enumerate(rates)
        ]
    )


def chances(of, distance, farthest):
    return per_frame((farthest / np.asarray(distance)[:, None]) ** 2, of)[:, 0]


@given(st.lists(st.integers(0, 400), min_size=1, max_size=12))
def test_the_fit_is_monotone_meets_the_rates_and_lies_within_its_bounds(hits):
    rates = [h / 400 for h in sorted(hits, reverse=True)]
    question = Detection("hand", rates=table(rates))
    far, d = 0.2 * len(rates), np.linspace(0.05, 0.2 * len(rates) * 1.5, 300)
    of, (low, high) = detectors([pr.Sensor()], question), bounds([pr.Sensor()], question)
    middle = chances(of, d, far)
    assert np.all(np.diff(middle) <= 1e-9)
    assert np.all(chances(low, d, far) <= middle + 1e-9)
    assert np.all(middle <= chances(high, d, far) + 1e-9)
    assert np.allclose(chances(of, 0.2 * np.arange(1, len(rates) + 1), far), rates, atol=1e-9)
    assert np.all(chances(of, [1.03 * far, 50.0], far) == 0)


@given(st.integers(0, 60), st.integers(1, 60), st.integers(1, 5))
def test_intervals_are_those_of_clopper_and_pearson(hits, frames, rows):
    hits = min(hits, frames)
    low, high = intervals(np.full(rows, hits / frames), np.full(rows, float(frames)))
    exact = binomtest(hits, frames).proportion_ci(1 - 0.05 / rows, "exact")
    assert (low[0], high[0]) == pytest.approx((exact.low, exact.high), abs=1e-9)


def test_the_next_darker_target_and_stronger_light_count_and_nothing_beyond():
    rows = [
        *table([0.9], reflectance=0.1, ambient="5klx").rows,
        *table([0.8], reflectance=0.05, ambient="5klx").rows,
        *table([1.0], reflectance=0.1).rows,
    ]
    rates = RateTable(rows)
    assert [r.rate for r in rates.rates("", None, 0.5)] == [1.0]
    assert [r.rate for r in rates.rates("", "3klx", 0.09)] == [0.8]
    assert [r.rate for r in rates.rates("", "dark", 0.09)] == [0.8]
    with pytest.raises(ValueError, match=r"1\.8 %"):
        rates.rates("", "dark", 0.018)
    with pytest.raises(ValueError, match="9klx"):
        rates.rates("", "9klx", 0.5)
    with pytest.raises(ValueError, match="overcast"):
        rates.rates("", "overcast", 0.5)


def test_rates_of_one_sensor_leave_the_others_to_the_law():
    mine, other = pr.sensors["vl53l5cx"], pr.sensors["vl53l1x"]
    question = Detection("torso", rates=table([1.0, 0.5], sensor="vl53l5cx", reflectance=0.01))
    of, law = detectors([mine, other], question), detectors([other], Detection("torso"))
    assert [*of.measured] == [True, False]
    s = np.linspace(0, 3, 50)[:, None]
    assert np.array_equal(per_frame(s, of)[:, 1], per_frame(s, law)[:, 0])
    with refused("crosstalk 0.1"):
        Detection("hand", crosstalk=0.1, rates=question.rates)
