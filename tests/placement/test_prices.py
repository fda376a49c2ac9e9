"""Prices: a setup costs the sum over its new rings and their sensors, wherever it is stated."""

import json
import re
from dataclasses import replace

import place_rings as pr
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.sensors.catalogue import model
from place_rings.coverage.sensors.effective_range import effective
from place_rings.coverage.sensors.sensor import PAPER_SENSOR, Sensor, Use
from place_rings.formats.loader import read_scene
from place_rings.formats.ring_frame import frame_length
from place_rings.formats.schema.own_sensor_models import OwnSensorFile
from place_rings.formats.schema.price_models import PriceModel
from place_rings.formats.writing import to_toml
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.prices import Prices
from place_rings.objectives.scene import CoreScene
from place_rings.placement.search import fewest_rings as fewest
from place_rings.placement.search import search as searching
from place_rings.reporting.lines.prices import price_line
from place_rings.reporting.pages import escaped
from place_rings.reporting.setup_report.bill_of_materials import materials

from .test_fewest_rings import QUICK

L1X = effective(Use("vl53l1x")).sensor
RINGS = st.lists(
    st.builds(
        Ring,
        st.sampled_from(["upper_arm", "forearm"]),
        st.floats(0, 1),
        st.integers(1, 24),
        sensor=st.sampled_from([PAPER_SENSOR, L1X]),
    ),
    min_size=1,
    max_size=5,
    unique_by=lambda ring: ring.position,
)
CENTS = st.integers(0, 100_000).map(lambda n: n / 100)


@pytest.mark.long
@given(RINGS, RINGS, CENTS, CENTS, CENTS)
def test_the_price_is_the_sum_over_new_rings_and_their_sensors(new, fixed, ring, sensor, other):
    fixed = [one for one in fixed if one not in new]
    prices = Prices(ring, sensor, "EUR", {"vl53l1x": other})
    scene, setup = CoreScene(prices=prices, rules=Rules(fixed=tuple(fixed))), (*new, *fixed)
    each = [ring] * len(new)
    for one in new:
        each += [other if one.sensor is L1X else sensor] * one.count
    assert scene.price_of(Setup(setup)) == pytest.approx(sum(each))
    record = PriceModel.of(scene, Setup(setup))
    assert record.rings + record.sensors == pytest.approx(record.total)
    assert record.rings == pytest.approx(ring * len(new))
    line, bill = price_line(scene, Setup(setup)), materials(scene, Setup(setup), frame_length)
    assert prices.text(sum(each)) in line
    assert f"**{escaped(prices.text(sum(each)))}**" in "\n".join(bill)


def test_a_sensor_of_ones_own_has_a_price_by_its_name(tmp_path):
    own = replace(model("vl53l1x"), name="mine")
    (tmp_path / "mine.toml").write_text(to_toml(OwnSensorFile.from_domain(own)))
    text = '[sensor]\nmodel = "mine.toml"\n[prices]\nsensor = 1\nmodels = { mine = 7 }\n'
    (tmp_path / "scene.toml").write_text(text)
    scene = read_scene(tmp_path / "scene.toml")
    assert scene.prices.of_sensor(scene.sensor) == 7
    assert scene.prices.of_sensor(Sensor()) == 1
    assert scene.price_of(Setup((Ring("forearm", 0.5, 5, sensor=scene.sensor),))) == 35


def test_a_scene_without_prices_has_none():
    scene, setup = CoreScene(), Setup((Ring("forearm", 0.5, 5),))
    assert scene.price_of(setup) is price_line(scene, setup) is PriceModel.of(scene, setup) is None
    assert pr.verify("n1_8_0", pr.Scene(), voxel=0.1).price is None


def test_prices_in_python():
    scene = pr.Scene(prices=pr.Prices(ring=10, sensor=2, currency="EUR"))
    coverage = pr.verify("n1_8_0", scene, voxel=0.1)
    assert coverage.price == 3 * 10 + 24 * 2
    assert "price: 78 EUR" in repr(coverage)
    assert scene.replace(prices=None).prices is None
    with pytest.raises(pr.InputError, match="allowed: Prices"):
        pr.Scene(prices=10)
    with pytest.raises(ValueError, match="price of ring: found -1"):
        pr.Prices(ring=-1)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("ring = -1", "scene.toml: prices.ring: found -1, allowed: a number from 0"),
        ("models = { vl53 = 3 }", "scene.toml: prices.models.vl53: found "),
        ("rings = 3", "did you mean ring?"),
    ],
)
def test_wrong_prices_are_one_line(run, tmp_path, text, says):
    (tmp_path / "scene.toml").write_text(f"[prices]\n{text}\n")
    code, out, err = run("verify", "n1_8_0", "--scene", "scene.toml")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert says in err


@pytest.fixture
def quick(monkeypatch):
    for module in (fewest, searching):
        monkeypatch.setattr(module, "usual", lambda *_: QUICK)


PRICED = 'occlusion = "ignore"\n[rules]\nmount = "free"\n[prices]\nring = 40\nsensor = 12.5\n'


def test_the_command_shows_prices_and_the_fewest_rings(run, tmp_path, quick):
    (tmp_path / "scene.toml").write_text(PRICED + 'currency = "EUR"\n')
    more = ("--scene", "scene.toml", "--voxel", "0.1", "--out", "found")
    code, out, err = run("--sensors", "24", "--fewest-rings", "--within", "5", *more)
    assert code == 0, err
    record = json.loads((tmp_path / "found" / "result.json").read_text())
    rings = len(record["proposal"]["rings"])
    tried = {one["rings"]: one for one in record["fewest_rings"]["tried"]}
    best = max(one["exact_percent"] for one in tried.values())
    assert tried[rings]["exact_percent"] >= best - 5
    assert rings - 1 not in tried or tried[rings - 1]["exact_percent"] < best - 5
    assert record["price"]["total"] == 40 * rings + 12.5 * 24 == tried[rings]["price"]
    assert f"Price: {40 * rings + 300} EUR ({rings} ring" in out
    assert "the fewest within 5 points of the best" in re.sub(r"\s+", " ", out)
    assert "For fewer rings" not in out


@pytest.mark.parametrize(
    ("options", "counts"),
    [
        (("--rings", "4", "--sensors", "21"), None),
        (("--rings", "3", "--sensors-per-ring", "7"), [7, 7, 7]),
        (("--rings", "2"), [16, 16]),
    ],
)
def test_the_command_places_the_stated_number_of_rings(run, tmp_path, quick, options, counts):
    (tmp_path / "scene.toml").write_text(PRICED)
    more = ("--scene", "scene.toml", "--voxel", "0.1", "--out", "found")
    code, _, err = run(*options, *more)
    assert code == 0, err
    rings = json.loads((tmp_path / "found" / "result.json").read_text())["proposal"]["rings"]
    assert len(rings) == int(options[1])
    if counts is None:
        assert sum(ring["count"] for ring in rings) == 21
    else:
        assert [ring["count"] for ring in rings] == counts


def test_a_search_that_chose_many_rings_says_how_to_have_fewer(run, tmp_path, quick):
    (tmp_path / "scene.toml").write_text(PRICED)
    more = ("--scene", "scene.toml", "--voxel", "0.1", "--out", "found")
    code, out, err = run("--sensors", "24", *more)
    assert code == 0, err
    assert "For fewer rings with nearly the same coverage" in re.sub(r"\s+", " ", out)


def test_rings_in_python():
    scene = pr.Scene(occlusion="ignore", rules=pr.Rules(mount="free"))
    result = pr.search(scene, sensors=20, rings=3, time_cap=1, voxel=0.1)
    assert (len(result.setup.rings), result.setup.sensors) == (3, 20)
    for wrong, says in (
        ({"rings": 3, "rings_per_link": 2}, "rings: found 3 with rings_per_link 2"),
        ({"fewest_rings": True}, "fewest_rings: found without sensors"),
        ({"fewest_rings": True, "sensors": 9, "rings": 2}, "fewest_rings: found with rings 2"),
        ({"fewest_rings": True, "reach_percent": 9.0}, "fewest_rings: found with reach_percent 9"),
        ({"within_points": 1.0}, "within_points: found 1 without fewest_rings"),
        ({"within_points": -1.0, "fewest_rings": True, "sensors": 9}, "allowed: 0 or more and"),
        ({"rings": 0}, "rings: found 0, allowed: 1 to 1000"),
        ({"rings": 4, "sensors": 8}, "8 sensors are too few for 4 rings"),
    ):
        with pytest.raises(ValueError, match=re.escape(says)):
            pr.search(scene, **wrong)
