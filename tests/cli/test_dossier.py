"""The command that writes a dossier, and what it refuses."""

import json

import place_rings as pr
import pytest
from place_rings.coverage.robots.built_in import UR10

from tests.support.refusals import has_parts

HEAD = "joint,extension_percent,load_percent,speed_percent,stop_s,stop_rad,repeat\n"
STOPS = HEAD + "".join(f"elbow,100,100,66,{0.3 + n / 100},0.2,{n}\n" for n in range(1, 11))
SCENE = "[[poses]]\nq_deg = [0, -45, 60, -105, -90, 0]\nrate_deg_s = [30, 0, 0, 0, 0, 0]\n"
FACTS = 'cell = "A | <b>cell</b>"\n[stop_input]\nrating = "PL d"\ndefault = "PL c"\n'


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "stops.csv").write_text(STOPS)
    (tmp_path / "scene.toml").write_text(SCENE)
    (tmp_path / "facts.toml").write_text(FACTS)
    return tmp_path


def words(*more):
    return ("safety", "n1_8_0", "--scene", "scene.toml", "--approaches", 4, "--dossier", *more)


def test_a_dossier_has_the_numbers_that_follow_by_hand(run, folder):
    options = ("--stop-times", "stops.csv", "--facts", "facts.toml", "--out", "out")
    assert run(*words(*options))[0] == 0
    d = json.loads((folder / "out" / "dossier.json").read_text())
    s = d["simulation"]["separation"]
    assert s["stopping_s"] == pytest.approx(0.4)
    assert s["fastest_m_s"] > 0.3
    for row, speed in zip(d["distances"], (1.6, 2.0), strict=True):
        v_r = s["fastest_m_s"]
        own = v_r * 0.1 + v_r * 0.4 / 2 + 0.2 + 0.1 + 0.05
        assert row["S_p_m"] == pytest.approx(speed * (0.1 + 0.4) + own)
        assert row["S_m"] == pytest.approx(speed * 0.5 + 0.2 + 0.15)
        assert row["S_parallel_m"] == pytest.approx(speed * 0.5 + 1.2 + 0.15)
        assert row["reached"] == (d["least_range_m"] >= row["S_p_m"])
    (stops,) = d["simulation"]["stops"]
    assert stops["measurements"] == 10
    assert stops["enough"]
    assert stops["mean_s"] == pytest.approx(0.355)
    states = {one["name"]: one["state"] for one in d["inputs"]}
    assert states["stopping time"] == "measured by the user"
    assert states["speed of the robot's fastest part"] == "computed"
    assert states["period of the readings"] == "assumed"
    for name in (
        "effective detection capability d_e, verified with its test piece",
        "largest object that no sensor sees",
        "expected share in which a test piece is detected",
    ):
        assert states[name] == "open"
    assert all(one["source"] for one in d["inputs"])
    levels = {
        one["element"]: (one["default"], one["rating"], one["state"]) for one in d["elements"]
    }
    assert levels["robot's stop input"] == ("PL c", "PL d", "stated by the user")
    assert levels["bus between sensors and electronics"] == ("", "none stated", "open")
    page = (folder / "out" / "dossier.html").read_text()
    assert "<b>cell</b>" not in page
    assert page.index("does not prove") < page.index("<h2>Inputs")


def test_a_sensor_with_a_stated_rating_shows_it(run, folder):
    sensor = ("--sensor", "safevisionary2", "--reflectance", "0.1")
    code, _, err = run(*words(*sensor, "--out", "out"))
    assert code == 0, err
    first = json.loads((folder / "out" / "dossier.json").read_text())["elements"][0]
    assert "PL c" in first["rating"]
    assert first["state"] == "maker's"


BAD = {
    "--stop-times": ("bad.csv", HEAD + "elbow,100,100,66,nan,0.2,1\n", "bad.csv line 2 stop_s"),
    "--facts": ("bad.toml", 'cel = "x"\n', "bad.toml cel cell"),
}


@pytest.mark.parametrize("option", BAD)
def test_bad_input_is_one_line_and_writes_nothing(run, folder, option):
    name, text, parts = BAD[option]
    (folder / name).write_text(text)
    before = {path.name for path in folder.iterdir()}
    code, out, err = run(*words(option, name, "--out", "out"))
    assert (code, out) == (2, "")
    assert has_parts(err, parts), err
    assert {path.name for path in folder.iterdir()} == before


def test_facts_need_a_dossier(run, folder):
    code, _, err = run("safety", "n1_8_0", "--facts", "facts.toml")
    assert code == 2
    assert has_parts(err, "facts dossier"), err


def test_python_writes_what_the_command_writes(run, folder):
    assert run(*words("--stop-times", "stops.csv", "--out", "theirs"))[0] == 0
    scene = pr.load(folder / "scene.toml")
    report = pr.safety("n1_8_0", scene, approaches=4, stop_times=folder / "stops.csv")
    report.dossier(folder / "ours")
    ours, theirs = (
        json.loads((folder / d / "dossier.json").read_text()) for d in ("ours", "theirs")
    )
    for one in (ours, theirs):
        del one["simulation"]["seconds"]
    assert ours == theirs
    assert UR10.name == ours["robot"]


@pytest.mark.slow
def test_a_dossier_has_what_was_asked_of_detection(run, folder):
    scene = folder / "scene.toml"
    scene.write_text(SCENE + '[[targets]]\nname = "V_N"\nradius = 0.05\nlargest_gap_mm = 100\n')
    options = ("--sensor", "vl53l5cx", "--detect", "hand", "--smallest-object", "--out", "out")
    code, _, err = run(*words(*options))
    assert code == 0, err
    d = json.loads((folder / "out" / "dossier.json").read_text())
    (target,) = d["capability"]["targets"]
    assert target["objects"]["verdict"] == "pass"
    n, proved = target["detection"], target["proved"]
    assert proved["low_percent"] <= n["zeta_percent"] <= proved["high_percent"]
    open_ = {one["name"] for one in d["inputs"] if one["state"] == "open"}
    assert not any("unseen" in name or "no sensor sees" in name for name in open_)
    assert not any("expected share" in name for name in open_)
    assert "effective detection capability d_e, verified with its test piece" in open_


@pytest.mark.parametrize("option", [("--smallest-object",), ("--detect", "hand")])
def test_what_a_dossier_computes_needs_one(run, folder, option):
    code, _, err = run("safety", "n1_8_0", *option)
    assert code == 2
    assert has_parts(err, f"{option[0]} --dossier")
