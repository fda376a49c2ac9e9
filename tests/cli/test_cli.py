"""The commands as a user runs them: what they print, what they refuse, what they leave behind."""

import csv
import gc
import io
import json
import os
import re
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
import trimesh
from place_rings import _safety
from place_rings._rings import Rings
from place_rings.cli.entry import never_lost
from place_rings.cli.options.scenes import with_motion
from place_rings.coverage.rings.ring import named_setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.robots.built_in import UR10
from place_rings.formats.errors import UserError
from place_rings.formats.loader import read_proposal, read_scene
from place_rings.formats.schema.proposal_models import SearchFile
from place_rings.formats.schema.result_models import VerifyResult
from place_rings.formats.schema.robustness_models import RobustnessResult
from place_rings.formats.schema.scene_models import SceneModel
from place_rings.formats.schema.separation_models import SafetyResult
from place_rings.formats.schema.written_models import ExportResult, ReportResult
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.scene import paper_scene
from place_rings.objectives.verify import Verifier
from place_rings.placement.search import search as searching
from place_rings.placement.search.round import Round
from place_rings.reporting.comparison import comparable
from place_rings.studies.engine.scenes import scene_from
from place_rings.studies.pareto import study as pareto

REFUSED = {
    "unknown target": ["--target", "V_X"],
    "unknown robot": ["--target", "V_S", "--radius", "0.5", "--robot", "r2d2"],
    "negative radius": ["--target", "V_S", "--radius", "-0.5"],
    "radius not a number": ["--target", "V_S", "--radius", "nan"],
    "radius inside V_R": ["--target", "V_S", "--radius", "0.15"],
    "radius inside V_R, long form": ["--target", "V_S:0.1"],
    "radius missing": ["--target", "V_S"],
    "radius without use": ["--radius", "0.5"],
    "weight of zero": ["--target", "V_S:0.5=0"],
    "malformed target": ["--target", "V_S:0.5:3"],
    "no sensors": ["--sensors-per-ring", "0"],
    "no rings": ["--rings-per-link", "0"],
    "unknown option": ["--tagret", "V_S"],
    "time of zero": ["--time", "0"],
    "no workers": ["study", "paper", "--workers", "0"],
    "workers beside a scheduler": [
        "study",
        "paper",
        "--workers",
        "2",
        "--scheduler",
        "tcp://127.0.0.1:8786",
    ],
    "a scheduler that is no address": ["study", "paper", "--scheduler", "here"],
    "voxel too fine": ["--voxel", "1e-6"],
    "voxel larger than the target": ["--voxel", "10"],
    "voxel negative": ["--voxel", "-1"],
    "folder that cannot be": ["--out", "/proc/nowhere"],
    "scene that is not there": ["--scene", "absent.toml"],
    "unknown setup": ["verify", "n7_1_1", "--target", "V_O"],
    "unknown rule": ["verify", "n2_16_25", "--rule", "guess"],
    "verify too fine": ["verify", "n2_16_25", "--voxel", "1e-7"],
    "unknown schema": ["schema", "soul"],
    "safety: no approaches": ["safety", "n2_16_25", "--approaches", "0"],
    "safety: degrees alone": ["safety", "n2_16_25", "--degrees"],
    "safety: no such record": ["safety", "n2_16_25", "--trajectory", "absent.csv"],
    "unknown sensor": ["verify", "n2_16_25", "--sensor", "eye"],
    "a light without a figure": ["--sensor", "vl53l1x", "--ambient", "300kcps"],
    "a light without a sensor": ["verify", "n2_16_25", "--ambient", "50kcps"],
    "a size that is none": ["--sensor", "vl53l1x", "--target-size", "0.1"],
    "robust: no draws": ["robustness", "n2_16_25", "--draws", "0"],
    "robust: no sensors": ["robustness", "n2_16_25", "--k", "0"],
    "robust: negative error": ["robustness", "n2_16_25", "--position-error-mm=-1"],
    "robust: error that is no number": ["robustness", "n2_16_25", "--direction-error-deg", "nan"],
    "robust: unknown law": ["robustness", "n2_16_25", "--law", "murphy"],
    "robust: unknown setup": ["robustness", "n9_1_1"],
    "robust: voxel too fine": ["robustness", "n2_16_25", "--voxel", "1e-7"],
    "report: unknown setup": ["report", "n9_1_1"],
    "report: no draws": ["report", "n2_16_25", "--draws", "0"],
    "report: voxel too fine": ["report", "n2_16_25", "--voxel", "1e-7"],
    "search for nobody": ["--redundancy", "0"],
    "errors without use": ["--direction-error-deg", "1"],
    "loss and floor": ["--target", "V_S:0.5", "--at-least", "V_S:1.5=40", "--losing", "ring"],
    "loss and redundancy": ["--losing", "ring", "--redundancy", "2"],
    "rings beside free ones": ["--sensors", "12", "--rings-per-link", "3"],
    "sizes of rings beside free ones": ["--reach", "50", "--sensors-per-ring", "8"],
    "a front of another study": ["study", "bound", "--sensors", "40"],
    "a seed where nothing is drawn": ["study", "convergence", "--seed", "3"],
    "a front of one target": ["study", "pareto", "--target", "V_O", "--target", "V_O"],
    "a front with a weight": ["study", "pareto", "--target", "V_S:0.5=0.6", "--target", "V_O"],
    "a front of what lies inside V_R": [
        "study",
        "pareto",
        "--target",
        "V_S:0.1",
        "--target",
        "V_O",
    ],
    "a front in no scene": ["study", "pareto", "--scene", "absent.toml"],
}
FLOORS = {
    "V_Q=50": "--at-least V_Q: unknown target",
    "V_S:0.1=50": "V_S:0.1=50, radius: found 0.1, allowed: above 0.15",
    "V_S=50": 'found "V_S=50", allowed: a V_S with its radius, like V_S:0.5=50',
    "V_O=101": "found 101, allowed: above 0 and at most 100 (percent)",
    "V_O": 'found "V_O", allowed: NAME[:RADIUS]=PERCENT',
}


@pytest.mark.parametrize(("floor", "words"), FLOORS.items())
def test_a_bad_floor_is_blamed_by_its_own_option(run, floor, words):
    code, _, err = run("--at-least", floor)
    assert code == 2
    assert err.startswith("place-rings: --at-least")
    assert words in err


def test_two_floors_for_one_target_are_refused(run):
    code, _, err = run("--at-least", "V_S:1.5=60", "--at-least", "V_S:1.5=40")
    assert (code, err) == (
        2,
        (
            "place-rings: --at-least V_S:1.5=40: V_S(1.5) has a minimum already; state one for"
            " each target\n"
        ),
    )


def test_the_worst_of_one_pose_is_its_mean():
    assert with_motion(paper_scene(), None, False, worst=True) == paper_scene()
    two = replace(paper_scene(), poses=(*paper_scene().poses, *paper_scene().poses))
    assert with_motion(two, None, False, worst=True).over_poses == "worst"


@pytest.fixture
def measured(monkeypatch):
    """What the study of fronts is asked to measure: its scene's keys and its numbers of sensors."""
    asked = []

    def measure(run, where, targets, budgets, seed):
        asked.append((where, budgets))
        raise UserError("enough")

    monkeypatch.setattr(pareto, "measure", measure)
    return asked


def test_a_front_is_of_the_scene_with_its_motion_and_its_meshes(run, tmp_path, measured):
    trimesh.creation.box((0.2, 0.1, 0.1)).apply_translation((0.9, 0, 0)).export(
        tmp_path / "box.stl"
    )
    rows = "".join(f"{t},{0.1 * t},-0.8,1,-1.8,-1.6,0\n" for t in range(9))
    (tmp_path / "task.csv").write_text("t,q0,q1,q2,q3,q4,q5\n" + rows)
    (tmp_path / "cell.toml").write_text(
        'trajectory = { file = "task.csv", poses = 6 }\n[[obstacles]]\nfile = "box.stl"\n'
        '[[fixed]]\nlink = "tool"\nposition = 0.0\ncount = 30\n'
    )
    code, _, err = run("study", "pareto", "--scene", "cell.toml", "--sensors", "64")
    assert (code, err.strip()) == (2, "place-rings: enough")
    ((where, budgets),) = measured
    assert SceneModel.from_domain(scene_from(where)) == SceneModel.from_domain(
        read_scene(tmp_path / "cell.toml")
    )
    assert len(where["poses"]) == 6
    assert list(budgets) == [48, 80, 112, 64]  # 24 are fewer than the fixed ring has
    code, _, err = run("study", "pareto", "--scene", "cell.toml", "--sensors", "24")
    assert code == 2
    assert "24 sensors are fewer than the 30 of the fixed rings" in err


@pytest.mark.parametrize("args", REFUSED.values(), ids=REFUSED.keys())
def test_bad_input_is_one_line_and_exit_code_2(run, tmp_path, args):
    code, out, err = run(*args)
    assert code == 2
    assert out == ""
    assert err.startswith("place-rings: ")
    assert err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


NOWHERE = "".join(
    f"[mounts.{link}]\nkeep_out = [[0.0, 1.0]]\n" for link in ("upper_arm", "forearm", "tool")
)


@pytest.mark.parametrize(
    ("text", "args", "words"),
    [
        (NOWHERE, ["--reach", "50"], "room for 0 rings"),
        (
            "[rules]\nsensors_per_ring = [4, 8]\n",
            ["--sensors-per-ring", "9"],
            "found 9, allowed: 4 to 8",
        ),
    ],
)
def test_what_a_scene_has_no_room_for_is_refused_and_leaves_nothing(
    run, tmp_path, text, args, words
):
    (tmp_path / "cell.toml").write_text(text)
    code, out, err = run("--scene", "cell.toml", *args, "--out", "a/b")
    assert (code, out) == (2, "")
    assert len(err.split("place-rings: ")) == 2
    assert words in err
    assert [path.name for path in tmp_path.iterdir()] == ["cell.toml"]


def test_rings_of_a_layout_keep_to_the_sensors_that_a_scene_allows():
    few, usual = paper_scene(rules=Rules(sensors=(4, 8))), paper_scene()
    assert {ring.count for ring in Rings(rings_per_link=2).space(few).layout.rings} == {8}
    assert {ring.count for ring in Rings(rings_per_link=2).space(usual).layout.rings} == {16}
    assert {
        ring.count
        for ring in Rings(rings_per_link=2, sensors_per_ring=40).space(usual).layout.rings
    } == {40}


def test_verify_prints_one_object(run):
    code, out, _ = run(
        "verify", "n3_16_55", "--target", "V_S", "--radius", "0.5", "--voxel", "0.05", "--json"
    )
    assert code == 0
    result = VerifyResult.model_validate_json(out)
    assert (result.setup, result.target, result.radius, result.rule, result.voxel) == (
        "n3_16_55",
        "V_S",
        0.5,
        "centre",
        0.05,
    )
    assert result.low_percent == result.zeta_percent == result.high_percent
    assert result.zeta_percent == pytest.approx(100 * result.covered_voxels / result.target_voxels)


def test_verify_prints_a_list_for_several_targets_and_brackets_when_certified(run):
    _, out, _ = run(
        "verify",
        "n2_16_25",
        "--target",
        "V_O",
        "--target",
        "V_T",
        "--voxel",
        "0.1",
        "--rule",
        "certified",
        "--json",
    )
    results = [VerifyResult.model_validate(r) for r in json.loads(out)]
    assert [r.target for r in results] == ["V_O", "V_T"]
    for r in results:
        assert r.low_percent < r.zeta_percent < r.high_percent
        assert r.target_voxels is None


def test_touch_at_ten_centimetres_prints_a_table(run):
    code, out, _ = run(
        "verify",
        "n3_16_55",
        "--target",
        "V_S",
        "--radius",
        "0.5",
        "--voxel",
        "0.1",
        "--rule",
        "touch",
        "--paper",
    )
    assert code == 0
    assert "98.69" in out


def test_robustness_prints_one_object(run):
    args = (
        "robustness",
        "n3_16_55",
        "--target",
        "V_S",
        "--radius",
        "0.5",
        "--voxel",
        "0.05",
        "--draws",
        "5",
        "--k",
        "2",
    )
    code, out, _ = run(*args, "--json")
    assert code == 0
    r = RobustnessResult.model_validate_json(out)
    assert r.seen_percent[0] == pytest.approx(r.zeta_percent)
    assert (len(r.seen_percent), len(r.drawn_percent), len(r.without_ring_percent)) == (2, 5, 7)
    assert r.worst_ring.zeta_percent <= r.worst_sensor.zeta_percent <= r.zeta_percent
    assert r.worst_ring.link in UR10.links
    assert r.worst_percent <= r.fifth_percentile_percent <= max(r.drawn_percent)
    assert r.mean_percent == pytest.approx(np.mean(r.drawn_percent))
    code, out, _ = run(*args)
    assert f"{r.zeta_percent:.2f}" in out
    assert "largest losses" in out


def test_a_search_for_redundancy_says_what_it_aimed_at(run, monkeypatch, tmp_path):
    monkeypatch.setattr(searching, "usual", lambda *_: (Round(256, 3, 1, 4, 0.2, 4),))
    code, out, _ = run(
        "--target",
        "V_S",
        "--radius",
        "0.5",
        "--redundancy",
        "2",
        "--paper",
        "--voxel",
        "0.1",
        "--out",
        "found",
    )
    assert code == 0
    assert "seen by at least 2 sensors" in out
    file = read_proposal(tmp_path / "found" / "proposal.toml")[2]
    result = SearchFile.model_validate_json((tmp_path / "found" / "result.json").read_text())
    assert file.found.redundancy == 2
    assert result.asked_percent["proposal"] == pytest.approx(file.found.exact_percent)
    assert set(result.asked_percent) == {
        "proposal",
        "n1_8_0",
        "n1_16_0",
        "n2_16_25",
        "n2_16_55",
        "n3_16_55",
    }


def test_cones_are_those_of_the_geometry(run, reference_pose):
    _, out, _ = run("cones", "n2_16_25", "--paper")
    rows = list(csv.DictReader(io.StringIO(out)))
    expected = sensor_cones(UR10, named_setup("n2_16_25"), reference_pose)
    assert len(rows) == 80
    assert list(
        rows[0]
    ) == "pose,ring,sensor,apex_x,apex_y,apex_z,axis_x,axis_y,axis_z,fov_deg,range_m".split(",")  # noqa: SIM905
    for part, array in (("apex", expected.apex), ("axis", expected.axis)):
        assert np.allclose(
            [[float(r[f"{part}_{a}"]) for a in "xyz"] for r in rows], array, atol=1e-8
        )
    assert {(r["fov_deg"], r["range_m"]) for r in rows} == {("25.0", "1.5")}


def test_place_leaves_proposal_picture_and_result(run, monkeypatch, tmp_path):
    monkeypatch.setattr(searching, "usual", lambda *_: (Round(512, 4, 2, 8, 0.2, 8),))
    code, out, _ = run("--target", "V_S", "--radius", "0.5", "--voxel", "0.1", "--out", "found")
    assert code == 0
    for word in ("n3_16_55", "proposal.toml", "Search: coverage", "off by up"):
        assert word in out
    said = out[out.index("Search: coverage") :].split("Another random seed")[0]
    assert said.count("(") == said.count(")") > 0
    setup, _, file = read_proposal(tmp_path / "found" / "proposal.toml")
    result = SearchFile.model_validate_json((tmp_path / "found" / "result.json").read_text())
    assert result.proposal == file
    assert setup.sensors == 80
    assert (tmp_path / "found" / "placement.png").read_bytes().startswith(b"\x89PNG")
    code, out, _ = run("verify", "found/proposal.toml", "--voxel", "0.1", "--json")
    assert VerifyResult.model_validate_json(out).covered_voxels == file.zeta[0].covered_voxels


def test_an_interrupt_while_comparing_keeps_the_proposal(run, monkeypatch, tmp_path):
    assert comparable(paper_scene())  # imported before what it imports is replaced
    monkeypatch.setattr(searching, "usual", lambda *_: (Round(512, 4, 2, 8, 0.2, 8),))
    real, calls = Verifier.verify, []

    def interrupted(self, setup, target):
        calls.append(1)
        if len(calls) == 8:
            raise KeyboardInterrupt
        return real(self, setup, target)

    monkeypatch.setattr(Verifier, "verify", interrupted)
    options = ("--paper", "--voxel", "0.1", "--out", "found")
    code, _, err = run("--target", "V_S", "--radius", "0.5", *options)
    assert code == 0
    assert "the proposal is kept" in err
    assert read_proposal(tmp_path / "found" / "proposal.toml")[0].sensors == 80


def test_schemas_are_json(run):
    for name in ("scene", "proposal", "verify", "robustness", "result", "report", "export"):
        code, out, _ = run("schema", name)
        assert code == 0
        assert json.loads(out)["additionalProperties"] is False


@pytest.fixture
def heeded():
    """Ctrl-C as in a terminal: where pytest runs in the background it is ignored, and its children
    would ignore it too.
    """
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.skipif(os.name != "posix", reason="signals")
@pytest.mark.parametrize(
    ("told", "kept"),
    [(rb"drawing points", False), (rb"best so far [1-9]", True)],
    ids=["early", "in the search"],
)
def test_ctrl_c_keeps_the_best_so_far(heeded, tmp_path, told, kept):
    """Pressed as soon as the progress bar, which is drawn for a terminal only, says so."""
    program = Path(sys.executable).parent / "place-rings"
    asked = ["--target", "V_S", "--radius", "0.5", "--paper", "--voxel", "0.1", "--out", "out"]
    terminal = {**os.environ, "FORCE_COLOR": "1"}
    pipe = subprocess.PIPE
    with subprocess.Popen(
        [program, *asked], stdout=pipe, stderr=pipe, cwd=tmp_path, env=terminal
    ) as process:
        try:
            err = b""
            while not re.search(told, err) and (more := os.read(process.stderr.fileno(), 4096)):
                err += more
            process.send_signal(signal.SIGINT)
            out, more = process.communicate()
        finally:
            process.kill()
    assert process.returncode == (0 if kept else 130), err + more
    assert (b"interrupted" in out) == kept
    assert (b"interrupted before there was anything to keep" in more) != kept
    assert (tmp_path / "out" / "proposal.toml").exists() == kept


@pytest.mark.long
def test_ctrl_c_that_is_dropped_in_callbacks_comes_again(heeded, monkeypatch):
    left = [KeyboardInterrupt]

    def pressed(phase, info):
        if left:
            raise left.pop()

    monkeypatch.setattr(sys, "unraisablehook", never_lost)
    gc.callbacks.append(pressed)
    try:
        with pytest.raises(KeyboardInterrupt):
            gc.collect(), time.sleep(60)
    finally:
        gc.callbacks.remove(pressed)
    assert not left


def test_safety_refuses_a_robot_without_stopping_time_before_its_work(run, monkeypatch):
    monkeypatch.setattr(
        "place_rings._safety.motion_of", Mock(spec=_safety.motion_of, side_effect=AssertionError)
    )
    code, out, err = run("safety", "n1_8_0", "--robot", "ur5e")
    assert (code, out) == (2, "")
    assert err.startswith("place-rings: [safety] of the scene: robot ur5e has no stopping time: ")
    assert err.count("\n") == 1


@pytest.mark.long
def test_report_and_export_print_json(run):
    few = ("--voxel", "0.1", "--draws", "1", "--out", "a")
    code, out, _ = run("report", "n1_8_0", *few, "--json")
    assert code == 0
    written = ReportResult.model_validate_json(out)
    assert Path(written.page).read_text().startswith("<!doctype html>")
    assert [r.target for r in written.zeta] == ["V_S"]
    code, out, _ = run("export", "n1_8_0", "--to", "csv", "--to", "json", "--out", "b", "--json")
    assert code == 0
    exported = ExportResult.model_validate_json(out)
    assert exported.formats == ["csv", "json"]
    assert [Path(file).is_file() for file in exported.files] == [True, True]


def test_safety_says_that_a_sensor_does_not_reach_and_leaves_a_report(run, tmp_path):
    sensor = [
        "--sensor",
        "vl53l1x",
        "--ambient",
        "200kcps",
        "--approaches",
        "8",
        "--directions",
        "4",
    ]
    (tmp_path / "floor.toml").write_text("[[obstacles]]\nfloor = -0.9\n")
    code, out, _ = run(
        "safety", "n1_8_0", *sensor, "--scene", "floor.toml", "--out", "found", "--json"
    )
    assert code == 0
    found = SafetyResult.model_validate_json(out)
    assert found.in_time.percent <= found.if_far_enough.percent
    assert found.range_m < found.range_needed_m
    assert found.sensors[0].reflectance == 0.17
    assert found.floor_m == -0.9
    page = (tmp_path / "found" / "README.md").read_text()
    assert "confers a safety rating" in page
    assert "too late, whatever their direction" in page
    assert f"The fastest part requires {found.range_needed_m:.2f} m" in page
    with (tmp_path / "found" / "approaches.csv").open() as file:
        assert len(list(csv.DictReader(file))) == 8
    assert (tmp_path / "found" / "safety.png").stat().st_size > 10_000


def test_v_p_is_told_with_its_terms_and_no_rating(run):
    code, out, _ = run("verify", "n1_8_0", "--target", "V_P", "--voxel", "0.1")
    assert code == 0
    assert "0.88 + 0.00 + 0.00 + 0.20 + 0.10 + 0.05 = 1.23 m" in out
    assert "no safety rating" in out
    assert "less than" not in out


def test_v_p_names_a_nominal_sensor_that_does_not_reach_as_far(run, tmp_path):
    (tmp_path / "slow.toml").write_text("[safety]\nreaction_s = 1.0\n")
    code, out, _ = run(
        "verify", "n1_8_0", "--scene", "slow.toml", "--target", "V_P", "--voxel", "0.1"
    )
    assert code == 0
    assert "A nominal sensor of 25° reaches 1.50 m, less than the" in out


def test_safety_refuses_a_motion_beyond_the_joints_limits(run, tmp_path):
    (tmp_path / "far.csv").write_text(
        "t,q0,q1,q2,q3,q4,q5\n0,0,0,0,0,0,0\n1,7,0,0,0,0,0\n2,0,0,0,0,0,0\n"
    )
    code, out, err = run("safety", "n1_8_0", "--trajectory", "far.csv", "--out", "found")
    assert code == 2
    assert out == ""
    assert "at 1 s: found 401.07 degrees, allowed: -360 to 360, its limits on ur10" in err
    assert not (tmp_path / "found").exists()


def test_rings_of_a_proposal_are_printed(run, tmp_path):
    (tmp_path / "mine.toml").write_text(
        'version = 2\n[[rings]]\nlink = "forearm"\nposition = 0.3\ncount = 3\ntilt_deg = -30\n'
        "radius = 0.08\n"
        '[scene]\nocclusion = "blind"\n[scene.sensor]\nmodel = "vl53l1x"\n'
    )
    code, out, err = run("export", "mine.toml", "--to", "stl", "--out", "rings")
    assert code == 0, err
    assert [Path(line) for line in out.split()] == [
        Path("rings") / name
        for name in (
            "ring0_forearm_a.stl",
            "ring0_forearm_b.stl",
            "ring0_forearm.png",
            "mounted.png",
            "plate0.3mf",
            "printing.json",
            "assembled.png",
        )
    ]
    (tmp_path / "mine.toml").write_text(
        (tmp_path / "mine.toml").read_text().replace("blind", "ignore").replace("0.08", "0.03")
        + '[scene.rules]\nmount = "free"\n'
    )
    code, out, err = run("export", "mine.toml", "--to", "stl", "--out", "none")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "ring 0 (forearm): " in err
    assert err.rstrip().endswith('search without --paper and rules.mount = "free"')
    assert not (tmp_path / "none").exists()
