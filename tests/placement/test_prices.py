"""Prices: a setup costs the sum over its new rings and their sensors, wherever it is stated."""

import json
from dataclasses import replace

import place_rings as pr
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.cli.runs import place
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.sensors.catalogue import model
from place_rings.coverage.sensors.effective_range import Use
from place_rings.coverage.sensors.sensor import PAPER_SENSOR, Sensor, effective
from place_rings.formats.loader import read_scene
from place_rings.formats.schema.versions import SensorFile
from place_rings.formats.writing import to_toml
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.prices import Prices
from place_rings.objectives.scene import Scene
from place_rings.placement.search import search as searching
from place_rings.placement.search import several_searches as fewest
from place_rings.reporting.lines.occlusion import price_line
from place_rings.reporting.pages import escaped
from place_rings.reporting.setup_report.bill_of_materials import materials

from .test_several_searches import QUICK

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


@given(RINGS, RINGS, CENTS, CENTS, CENTS)
def test_the_price_is_the_sum_over_new_rings_and_their_sensors(new, fixed, ring, sensor, other):
    fixed = [one for one in fixed if one not in new]
    prices = Prices(ring, sensor, "EUR", {"vl53l1x": other})
    scene, setup = Scene(prices=prices, rules=Rules(fixed=tuple(fixed))), (*new, *fixed)
    each = [ring] * len(new)
    for one in new:
        each += [other if one.sensor is L1X else sensor] * one.count
    record = scene.price_of(Setup(setup))
    assert record.total == pytest.approx(sum(each))
    assert record.rings + record.sensors == pytest.approx(record.total)
    assert record.rings == pytest.approx(ring * len(new))
    assert prices.text(sum(each)) in price_line(scene, Setup(setup))


def test_the_bill_of_materials_adds_up_to_the_price():
    rings = Ring("forearm", 0.5, 3), Ring("upper_arm", 0.5, 2, sensor=L1X)
    prices = Prices(10.0, 2.0, "EUR", {"vl53l1x": 7.5})
    scene = Scene(prices=prices, rules=Rules(fixed=rings[:1]))
    bill = "\n".join(materials(scene, Setup(rings)))
    assert f"**{escaped(prices.text(10 + 2 * 7.5))}**" in bill


def test_a_sensor_of_ones_own_has_a_price_by_its_name(tmp_path):
    own = replace(model("vl53l1x"), name="mine")
    (tmp_path / "mine.toml").write_text(to_toml(own, file=SensorFile))
    text = '[sensor]\nmodel = "mine.toml"\n[prices]\nsensor = 1\nmodels = { mine = 7 }\n'
    (tmp_path / "scene.toml").write_text(text)
    scene = read_scene(tmp_path / "scene.toml")
    assert scene.prices.of_sensor(scene.sensor) == 7
    assert scene.prices.of_sensor(Sensor()) == 1
    assert scene.price_of(Setup((Ring("forearm", 0.5, 5, sensor=scene.sensor),))).total == 35


def test_a_scene_without_prices_has_none():
    scene, setup = Scene(), Setup((Ring("forearm", 0.5, 5),))
    assert scene.price_of(setup) is price_line(scene, setup) is None
    assert pr.verify("n1_8_0", pr.Scene(), voxel=0.1).price is None


def test_prices_in_python():
    scene = pr.Scene(prices=pr.Prices(ring=10, sensor=2, currency="EUR"))
    coverage = pr.verify("n1_8_0", scene, voxel=0.1)
    assert coverage.price == 3 * 10 + 24 * 2
    assert "78 EUR" in repr(coverage)
    assert scene.replace(prices=None).prices is None
    with pytest.raises(pr.InputError, match="prices: found 10"):
        pr.Scene(prices=10)
    with pytest.raises(ValueError, match="ring: found -1"):
        pr.Prices(ring=-1)


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("ring = -1", ("prices.ring: found -1",)),
        ("models = { vl53 = 3 }", ("prices.models.vl53: found ",)),
        ("rings = 3", ("prices", "rings", "ring?")),
    ],
)
def test_wrong_prices_are_one_line(run, tmp_path, text, parts):
    (tmp_path / "scene.toml").write_text(f"[prices]\n{text}\n")
    code, out, err = run("verify", "n1_8_0", "--scene", "scene.toml")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert all(part in err for part in ("scene.toml", *parts))


@pytest.fixture
def placed(run, tmp_path, monkeypatch):
    """Run a short search in a scene with prices: its record and what it prints."""
    for module in (fewest, searching):
        monkeypatch.setattr(module, "usual", lambda *_: QUICK)
    monkeypatch.setattr(place, "placement_picture", lambda *_, **__: None)
    scene = 'occlusion = "ignore"\n[rules]\nmount = "free"\n[prices]\nring = 40\nsensor = 12.5\n'
    (tmp_path / "scene.toml").write_text(scene + 'currency = "EUR"\n')

    def call(*options):
        args = ("--scene", "scene.toml", "--voxel", "0.1", "--out", "found")
        code, out, err = run(*options, *args)
        assert code == 0, err
        return json.loads((tmp_path / "found" / "result.json").read_text()), out

    return call


@pytest.mark.slow
def test_the_command_shows_prices_and_the_fewest_rings(placed):
    record, out = placed("--sensors", "24", "--within", "5")
    rings = len(record["proposal"]["rings"])
    tried = {one["rings"]: one for one in record["fewest_rings"]["tried"]}
    best = max(one["exact_percent"] for one in tried.values())
    assert tried[rings]["exact_percent"] >= best - 5
    assert rings - 1 not in tried or tried[rings - 1]["exact_percent"] < best - 5
    assert record["price"]["total"] == 40 * rings + 12.5 * 24 == tried[rings]["price"]
    assert record["fewest_rings"]["conclusive"]
    assert all(one["finished"] for one in tried.values())
    assert f"{40 * rings + 300} EUR" in out


@pytest.mark.parametrize(
    ("options", "sensors", "each"),
    [
        pytest.param(("--rings", "4", "--sensors", "21"), 21, None, marks=pytest.mark.slow),
        (("--rings", "3", "--sensors-per-ring", "7"), 21, [7, 7, 7]),
        pytest.param(("--rings", "2"), 32, [16, 16], marks=pytest.mark.slow),
        pytest.param(("--sensors", "24", "--any-rings"), 24, None, marks=pytest.mark.slow),
    ],
)
def test_the_command_places_the_stated_number_of_rings(placed, options, sensors, each):
    record, _ = placed(*options)
    counts = [ring["count"] for ring in record["proposal"]["rings"]]
    assert sum(counts) == sensors
    assert len(counts) == int(options[1]) or "--rings" not in options
    assert each is None or counts == each
    assert record["gap"] is record["fewest_rings"] is None


def test_rings_in_python(monkeypatch):
    monkeypatch.setattr(searching, "usual", lambda *_: QUICK)
    scene = pr.Scene(occlusion="ignore", rules=pr.Rules(mount="free"))
    result = pr.search(scene, sensors=20, rings=3, voxel=0.1)
    assert (len(result.setup.rings), result.setup.sensors) == (3, 20)
    with pytest.raises(ValueError, match=r"8 sensors .*4 rings"):
        pr.search(scene, rings=4, sensors=8)
