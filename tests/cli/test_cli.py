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
from place_rings.cli.entry import never_lost
from place_rings.cli.options.scenes import with_motion
from place_rings.coverage.definitions.definition import adapter
from place_rings.coverage.definitions.errors import UserError
from place_rings.coverage.rings.ring import named_setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.robots.built_in import ROBOTS, UR10
from place_rings.formats.loader import read_proposal, read_scene
from place_rings.formats.schema.proposal_models import SearchFile
from place_rings.formats.schema.written_models import ExportResult
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.robustness import Robustness
from place_rings.objectives.scene import Scene
from place_rings.objectives.verified import Verified
from place_rings.objectives.verify import Verifier
from place_rings.placement.search import search as searching
from place_rings.placement.search.options import SearchOptions
from place_rings.placement.search.schedule import Round
from place_rings.placement.search.several_searches import space_of
from place_rings.reporting import comparison
from place_rings.simulation.safety import SafetyResult
from place_rings.studies.engine.scenes import scene_from
from place_rings.studies.pareto import study as pareto

from ..support.scene_tables import scene_table


def test_the_worst_of_one_pose_is_its_mean():
    assert with_motion(Scene.paper(), None, False, worst=True) == Scene.paper()
    two = replace(Scene.paper(), poses=(*Scene.paper().poses, *Scene.paper().poses))
    assert with_motion(two, None, False, worst=True).over_poses == "worst"


@pytest.fixture
def measured(monkeypatch):
    """What the study of fronts is asked to measure: its scene's keys and its numbers of sensors."""
    asked = []

    def measure(run, where, targets, budgets, *_):
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
    scenes = scene_from(where), read_scene(tmp_path / "cell.toml")
    first, second = (scene_table(scene) for scene in scenes)
    assert first == second
    assert len(where["poses"]) == 6
    assert list(budgets) == [48, 80, 112, 64]  # 24 are fewer than the fixed ring has
    code, _, err = run("study", "pareto", "--scene", "cell.toml", "--sensors", "24")
    assert code == 2
    assert "24" in err
    assert "30" in err


NOWHERE = "".join(
    f"[mounts.{link}]\nkeep_out = [[0.0, 1.0]]\n" for link in ("upper_arm", "forearm", "tool")
)


@pytest.mark.parametrize(
    ("text", "args", "parts"),
    [
        (NOWHERE, ["--reach", "50"], ["0 rings"]),
        ("[rules]\nsensors_per_ring = [4, 8]\n", ["--sensors-per-ring", "9"], ["9", "4 to 8"]),
    ],
)
def test_what_a_scene_has_no_room_for_is_refused_and_leaves_nothing(
    run, tmp_path, text, args, parts
):
    (tmp_path / "cell.toml").write_text(text)
    code, out, err = run("--scene", "cell.toml", *args, "--out", "a/b")
    assert (code, out) == (2, "")
    assert len(err.split("place-rings: ")) == 2
    assert [part for part in parts if part not in err] == []
    assert [path.name for path in tmp_path.iterdir()] == ["cell.toml"]


def test_rings_of_a_layout_keep_to_the_sensors_that_a_scene_allows():
    few, usual = Scene.paper(rules=Rules(sensors=(4, 8))), Scene.paper()
    for scene, given, count in (
        (few, {}, 8),
        (usual, {}, 16),
        (usual, {"sensors_per_ring": 40}, 40),
    ):
        space = space_of(SearchOptions(rings_per_link=2, **given), scene)
        assert {ring.count for ring in space.layout.rings} == {count}


NEAR = ("--target", "V_S:0.5")


def record_of(out):
    return adapter(Verified).validate_python(json.loads(out))


def test_verify_prints_one_object_or_a_list_and_a_table(run):
    code, out, _ = run("verify", "n3_16_55", *NEAR, "--voxel", "0.1", "--json")
    assert code == 0
    one = record_of(out)
    said = (one.setup, one.target, one.radius, one.rule, one.voxel)
    assert said == ("n3_16_55", "V_S", 0.5, "sampled", 0.1)
    assert one.low == one.zeta == one.high
    assert one.zeta == pytest.approx(one.covered_voxels / one.target_voxels)
    assert 0 < one.error < 0.05
    _, out, _ = run("verify", "n3_16_55", *NEAR, "--voxel", "0.1", "--rule", "centre", "--json")
    assert record_of(out).error is None
    several = ("--target", "V_O", "--target", "V_T", "--voxel", "0.1", "--rule", "certified")
    _, out, _ = run("verify", "n2_16_25", *several, "--json")
    results = [adapter(Verified).validate_python(r) for r in json.loads(out)]
    assert [r.target for r in results] == ["V_O", "V_T"]
    for r in results:
        assert r.low < r.zeta < r.high
        assert r.target_voxels is None
    code, out, _ = run("verify", "n3_16_55", *NEAR, "--voxel", "0.1", "--rule", "touch", "--paper")
    assert code == 0
    assert "98.69" in out


def test_robustness_prints_one_object(run):
    args = ("robustness", "n3_16_55", *NEAR, "--voxel", "0.1", "--draws", "5", "--k", "2")
    code, out, _ = run(*args, "--json")
    assert code == 0
    r = adapter(Robustness).validate_json(out)
    assert r.seen[0] == pytest.approx(r.zeta)
    assert (len(r.seen), len(r.drawn), len(r.without_ring)) == (2, 5, 7)
    assert r.worst_ring.zeta <= r.worst_sensor.zeta <= r.zeta
    assert r.worst_ring.link in UR10.links
    assert r.worst <= r.fifth_percentile <= max(r.drawn)
    assert r.mean == pytest.approx(np.mean(r.drawn))
    code, out, _ = run(*args)
    assert f"{100 * r.zeta:.2f}" in out


def test_cones_are_those_of_the_geometry(run, reference_pose):
    _, out, _ = run("cones", "n2_16_25", "--paper")
    rows = list(csv.DictReader(io.StringIO(out)))
    expected = sensor_cones(UR10, named_setup("n2_16_25"), reference_pose)
    assert len(rows) == 80
    header = "pose,ring,sensor,apex_x,apex_y,apex_z,axis_x,axis_y,axis_z,fov_deg,range_m"
    assert ",".join(rows[0]) == header
    for part, array in (("apex", expected.apex), ("axis", expected.axis)):
        assert np.allclose(
            [[float(r[f"{part}_{a}"]) for a in "xyz"] for r in rows], array, atol=1e-8
        )
    assert {(r["fov_deg"], r["range_m"]) for r in rows} == {("25.0", "1.5")}


@pytest.fixture
def quick(monkeypatch):
    """Searches of few steps for few sensors, compared with one of the paper's layouts."""
    monkeypatch.setattr(searching, "usual", lambda *_: (Round(512, 4, 2, 8, 0.2, 8),))
    monkeypatch.setattr(comparison, "PAPER_SETUPS", ("n1_4_0",))
    layout = ("--rings-per-link", "1", "--sensors-per-ring", "4")
    return (*NEAR, *layout, "--voxel", "0.1", "--out", "found")


def test_place_leaves_proposal_picture_and_result(run, quick, tmp_path):
    code, out, _ = run(*quick, "--paper")
    assert code == 0
    assert "n1_4_0" in out
    assert "found/proposal.toml" in out
    setup, _, file = read_proposal(tmp_path / "found/proposal.toml")
    result = SearchFile.model_validate_json((tmp_path / "found/result.json").read_text())
    assert result.proposal.stated() == file.stated()
    assert setup.sensors == 12
    assert (tmp_path / "found/placement.png").read_bytes().startswith(b"\x89PNG")
    code, out, _ = run("verify", "found/proposal.toml", "--voxel", "0.1", "--json")
    assert record_of(out).covered_voxels == file.zeta[0].covered_voxels


@pytest.mark.slow
def test_a_search_for_redundancy_says_what_it_aimed_at(run, quick, tmp_path):
    assert run(*quick, "--redundancy", "2", "--paper")[0] == 0
    file = read_proposal(tmp_path / "found/proposal.toml")[2]
    result = SearchFile.model_validate_json((tmp_path / "found/result.json").read_text())
    assert file.found.redundancy == 2
    assert result.asked_percent["proposal"] == pytest.approx(100 * file.found.exact)
    assert set(result.asked_percent) == {"proposal", "n1_4_0"}


def test_an_interrupt_while_comparing_keeps_the_proposal(run, quick, monkeypatch, tmp_path):
    real = Verifier.verify

    def interrupted(self, setup, target):
        if not any(ring.tilt for ring in setup.rings):  # the paper's
            raise KeyboardInterrupt
        return real(self, setup, target)

    monkeypatch.setattr(Verifier, "verify", interrupted)
    code, _, err = run(*quick, "--paper")
    assert code == 0
    assert "kept" in err
    assert read_proposal(tmp_path / "found/proposal.toml")[0].sensors == 12


def test_what_a_full_disk_does_not_take_is_printed(run, quick, monkeypatch, tmp_path):
    def full(path, text):
        raise UserError(f"{path}: cannot be written: No space left on device")

    monkeypatch.setattr("place_rings._proposal.write_text", full)
    code, out, err = run(*quick, "--paper")
    assert code == 2
    assert "proposal.toml" in err
    (tmp_path / "kept.toml").write_text(out)
    assert read_proposal(tmp_path / "kept.toml")[0].sensors == 12


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


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="signals")
@pytest.mark.parametrize(
    ("told", "kept"),
    [(rb"drawing points", False), (rb"best so far [1-9]", True)],
    ids=["early", "in the search"],
)
def test_ctrl_c_keeps_the_best_so_far(heeded, tmp_path, told, kept):
    """Pressed as soon as the progress bar, which is drawn for a terminal only, says so."""
    program = Path(sys.executable).parent / "place-rings"
    asked = [*NEAR, "--sensors", "16", "--paper", "--voxel", "0.1", "--out", "out"]
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
    assert (tmp_path / "out" / "proposal.toml").exists() == kept


def collect_and_wait():
    gc.collect()
    for _ in range(1000):
        time.sleep(0.02)


def test_ctrl_c_that_is_dropped_in_callbacks_comes_again(heeded, monkeypatch):
    left = [KeyboardInterrupt]

    def pressed(phase, info):
        if left:
            raise left.pop()

    monkeypatch.setattr(sys, "unraisablehook", never_lost)
    gc.callbacks.append(pressed)
    try:
        with pytest.raises(KeyboardInterrupt):
            collect_and_wait()
    finally:
        gc.callbacks.remove(pressed)
    assert not left


def test_safety_refuses_a_robot_without_stopping_time_before_its_work(run, monkeypatch):
    monkeypatch.setattr(
        "place_rings._safety.motion_of", Mock(spec=_safety.motion_of, side_effect=AssertionError)
    )
    code, out, err = run("safety", "n1_8_0", "--robot", "ur5e")
    assert (code, out) == (2, "")
    assert err.startswith("place-rings: [safety]")
    assert "ur5e" in err
    assert err.count("\n") == 1


def test_export_prints_json(run):
    code, out, _ = run("export", "n1_8_0", "--to", "csv", "--to", "json", "--out", "b", "--json")
    assert code == 0
    exported = ExportResult.model_validate_json(out)
    assert exported.formats == ["csv", "json"]
    assert [Path(file).is_file() for file in exported.files] == [True, True]


def test_safety_says_that_a_sensor_does_not_reach_and_leaves_a_report(run, tmp_path):
    sensor = ["--sensor", "vl53l1x", "--ambient", "200kcps", "--approaches", "8"]
    sensor += ["--directions", "4"]
    (tmp_path / "floor.toml").write_text("[[obstacles]]\nfloor = -0.9\n")
    code, out, _ = run(
        "safety", "n1_8_0", *sensor, "--scene", "floor.toml", "--out", "found", "--json"
    )
    assert code == 0
    found = adapter(SafetyResult).validate_json(out)
    assert found.in_time.share <= found.if_far_enough.share
    assert found.range_m < found.range_needed_m
    assert found.sensors[0].reflectance == 0.17
    assert found.floor_m == -0.9
    page = (tmp_path / "found" / "README.md").read_text()
    assert "safety rating" in page
    assert f"{found.range_needed_m:.2f} m" in page
    with (tmp_path / "found" / "approaches.csv").open() as file:
        assert len(list(csv.DictReader(file))) == 8
    assert (tmp_path / "found" / "safety.png").stat().st_size > 10_000


def test_v_p_is_printed_with_its_terms_no_rating_and_a_sensor_that_does_not_reach(run, tmp_path):
    target = ("--target", "V_P", "--voxel", "0.1")
    code, out, _ = run("verify", "n1_8_0", *target)
    assert code == 0
    assert "0.88 + 0.00 + 0.00 + 0.20 + 0.10 + 0.05 = 1.23 m" in out
    assert "safety rating" in out
    assert "1.50 m" not in out
    (tmp_path / "slow.toml").write_text("[safety]\nreaction_s = 1.0\n")
    code, out, _ = run("verify", "n1_8_0", "--scene", "slow.toml", *target)
    assert code == 0
    assert "1.50 m" in out  # the range of the nominal sensor


def test_safety_refuses_a_motion_beyond_the_joints_limits(run, tmp_path):
    (tmp_path / "far.csv").write_text(
        "t,q0,q1,q2,q3,q4,q5\n0,0,0,0,0,0,0\n1,7,0,0,0,0,0\n2,0,0,0,0,0,0\n"
    )
    code, out, err = run("safety", "n1_8_0", "--trajectory", "far.csv", "--out", "found")
    assert code == 2
    assert out == ""
    for part in ("far.csv", "1 s", "401.07", "-360 to 360", "ur10"):
        assert part in err
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
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize("bad", ["proof.npz", "zeta.png"])
def test_the_files_of_a_count_come_together_or_not_at_all(run, bad):
    two = "[[poses]]\nq_deg = [0, -45, 57, -103, -91, 0]\n"
    Path("two.toml").write_text(two + two.replace("45", "60"))
    words = ["verify", "n1_4_0", "--paper", "--target", "V_S:0.2", "--scene", "two.toml"]
    words += ["--rule", "certified", "--voxel", "0.2", "--certificate", "proof.npz"]
    code, _, err = run(*words, "--plot-by-pose", "./proof.npz")
    assert code == 2
    assert "--plot-by-pose" in err
    words += ["--plot-by-pose", "zeta.png"]
    Path(bad).mkdir()
    assert run(*words)[0] == 2
    assert [p.name for p in Path().rglob("*") if p.is_file()] == ["two.toml"]
    Path(bad).rmdir()
    code, out, _ = run(*words)
    assert code == 0
    for name in ("proof.npz", "zeta.png"):
        assert Path(name).stat().st_size
        assert name in out


def test_the_robots_are_listed_for_scripts(run):
    records = json.loads(run("robots", "--json")[1])
    assert [record["name"] for record in records] == list(ROBOTS)
    for record, robot in zip(records, ROBOTS.values(), strict=True):
        assert tuple(record["joints"]) == robot.chain.joints
        assert (record["reach_m"], record["source"]) == (robot.reach, robot.source)
        assert tuple(record["links_m"]) == robot.links
        for mount in robot.mounts:
            assert record["links_m"][mount.link] == mount.length * np.ptp(mount.usable)
