"""Files state their version; those without are of the first, newer ones are refused."""

import json
import math
import subprocess
import sys
import tomllib
from dataclasses import replace

import numpy as np
import pytest
import tomli_w
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.definitions.errors import schema_of
from place_rings.coverage.rings.ring import named_setup
from place_rings.coverage.robots.built_in import ROBOTS, UR10
from place_rings.coverage.robots.separation_distance import Safety
from place_rings.coverage.sensors.board_packing import Printing
from place_rings.coverage.sensors.effective_range import Use
from place_rings.coverage.sensors.sensor import effective
from place_rings.formats.loader import read_proposal, read_robot, read_scene, resolve
from place_rings.formats.schema import versions
from place_rings.formats.schema.files import MODELS, model_named
from place_rings.formats.schema.proposal_models import ProposalFile
from place_rings.formats.schema.versions import (
    FILE_VERSION,
    FROM_FILE,
    RobotFile,
    SceneFile,
    VersionedFile,
)
from place_rings.formats.writing import to_toml, without_none
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import REFERENCE_POSE_DEG, Scene
from place_rings.objectives.verified import PoseZeta, Verified

from ..support.refusals import refused
from ..support.scene_tables import scene_table

RINGS = "[[rings]]\nlink = 'tool'\ncount = 8\n"
PRINTED = ("verify", "robustness", "report", "export")  # by --json, to no file
FILES = {name: model_named(name) for name in MODELS if name not in PRINTED}
WRITTEN = {
    "no version": f"""# zeta V_S(0.5) = 51.40 %
{RINGS}position = 0.71\ntilt_deg = 24.6\nphase_deg = 12.5
[scene]\nrobot = "ur10"\nocclusion = "ignore"\nring_radius = 0.08
[[scene.targets]]\nname = "V_S"\nradius = 0.5
""",
    "version 1": f"""version = 1
{RINGS}radius = 0.113
sensor = {{ model = "vl53l1x", fov_deg = 19.0919, fov_up_deg = 19.0919 }}
[scene]\nrobot = "ur5e"\nocclusion = "shadow"
[scene.rules]\nmount = "real"\nrings_per_link = 3\nring_width = 0.03\nring_thickness = 0.01
[[scene.poses]]\nq_deg = [0.0, -45.0, 60.0, -105.0, -90.0, 0.0]\nweight = 1.0
""",
    "version 2": f"""version = 2
{RINGS}zone_turn_deg = 0\nzone_mirrored = false
[[sensors]]\nname = "spot"\nlink = "forearm"\nposition = [0.1, 0, 0.1]\ndirection = [1, 0, 0]
[scene]\nrobot = "panda"\nocclusion = "blind"\n[scene.rules]\nmax_rings_per_link = 3
""",
}


@pytest.mark.parametrize("name", FILES)
def test_each_file_that_a_user_keeps_has_a_version(name):
    key = schema_of(FILES[name])["properties"]["version"]
    default = FILE_VERSION if name == "scene" else 1  # a scene is written by hand
    assert (key["default"], key["minimum"], key["maximum"]) == (default, 1, FILE_VERSION)


def test_what_is_written_states_its_version_once_and_first():
    proposal = ProposalFile.of(named_setup("n2_16_25"), Scene.paper())
    for held, file in (
        (proposal, None),
        (Scene.paper(), SceneFile),
        (Scene.paper().robot, RobotFile),
    ):
        text = to_toml(held, "two\nlines", file).removeprefix("# two\n# lines\n")
        assert text.startswith(f"version = {FILE_VERSION}\n")
        assert text.count("\nversion") == 0
        assert tomllib.loads(text)["version"] == FILE_VERSION


def test_a_file_with_and_without_its_version_is_the_same(tmp_path):
    readers = {FILE_VERSION: ("", read_scene), 1: (RINGS, lambda path: read_proposal(path)[2])}
    for version, (text, read) in readers.items():
        old, new = tmp_path / "old.toml", tmp_path / "new.toml"
        old.write_text(text)
        new.write_text(f"version = {version}\n" + text)
        assert repr(read(old)) == repr(read(new))


def test_the_scene_of_a_first_file_keeps_its_rings_where_they_were(tmp_path):
    path = tmp_path / "proposal.toml"
    cases = (
        ("", "ignore", "free"),
        ("occlusion = 'shadow'\n", "shadow", "free"),  # on a UR10: between its joints
        ("occlusion = 'shadow'\n[scene.rules]\nmount = 'real'\n", "shadow", "free"),
        ("robot = 'ur10_dh'\n[scene.rules]\nmount = 'real'\n", "ignore", "free"),
        ("robot = 'ur5e'\n[scene.rules]\nmount = 'real'\n", "ignore", "real"),
        ("occlusion = 'shadow'\nrobot = 'ur5e'\n", "shadow", "real"),
        ("occlusion = 'shadow'\nrobot = 'ur5e'\n[scene.rules]\nmount = 'free'\n", "shadow", "free"),
        ("[scene.rules]\nring_width = 0.03\nring_thickness = 0.01\n", "ignore", "free"),
    )
    for text, occlusion, mount in cases:
        path.write_text(RINGS + "[scene]\n" + text)
        _, scene, _ = read_proposal(path)
        assert (scene.occlusion, scene.rules.mount) == (occlusion, mount)
        path.write_text("version = 2\n" + RINGS + "[scene]\n" + text)
        if "ring_width" in text:
            with refused("proposal.toml scene.rules.ring_width"):
                read_proposal(path)
        else:
            assert read_proposal(path)[1].rules.mount == ("free" if "'free'" in text else "real")


@pytest.mark.filterwarnings("ignore:rules:DeprecationWarning")
@pytest.mark.parametrize("text", WRITTEN.values(), ids=WRITTEN)
def test_files_that_were_written_before_read_on(tmp_path, text):
    path = tmp_path / "proposal.toml"
    path.write_text(text)
    setup, scene, file = read_proposal(path)
    assert file.version == FILE_VERSION
    assert setup.sensors == file.rings[0].count + len(setup.singles)
    assert len(setup.singles) == text.count("[[sensors]]")
    path.write_text(to_toml(ProposalFile.of(setup, scene)))
    assert read_proposal(path)[0] == setup


def test_a_command_announces_each_key_that_is_to_go_in_one_line(tmp_path):
    robot = to_toml(UR10, file=RobotFile).replace(
        "\nlink = ", "\naside = 0\ntoward_deg = 9\nlink = "
    )
    (tmp_path / "robot.toml").write_text(robot)
    (tmp_path / "cell.toml").write_text('robot = "robot.toml"\n[rules]\nrings_per_link = 3\n')
    code = "from place_rings.cli.entry import main; main()"
    words = [sys.executable, "-c", code, "cones", "n1_4_0", "--scene", "cell.toml"]
    done = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0
    said = sorted(done.stderr.splitlines())
    assert len(said) == 3
    for key, line in zip(("aside", "toward_deg", "rings_per_link"), said, strict=True):
        assert f" {key} " in line


def test_a_newer_file_is_refused_in_one_line(run, tmp_path):
    texts = {"scene.toml": "", "robot.toml": "", "proposal.toml": RINGS}
    for name, text in texts.items():
        (tmp_path / name).write_text(f"version = {FILE_VERSION + 1}\nnew = 1\n" + text)
    (tmp_path / "sensors.json").write_text(json.dumps({"version": 9, "new": 1}))
    (tmp_path / "named.toml").write_text("robot = 'robot.toml'")
    read = {
        "scene.toml": read_scene,
        "robot.toml": read_robot,
        "named.toml": read_scene,
        "proposal.toml": read_proposal,
        "sensors.json": lambda path: resolve(str(path), None),
    }
    for name, reader in read.items():
        newer = 9 if name == "sensors.json" else FILE_VERSION + 1
        with refused(f"version {newer} 1 {FILE_VERSION}"):
            reader(tmp_path / name)
    code, out, err = run("verify", str(tmp_path / "proposal.toml"))
    assert (code, out, err.count("\n")) == (2, "", 1)


def test_an_older_file_is_upgraded_before_defaults_apply(tmp_path, monkeypatch):
    """As the next version will: what a file of the first does not state keeps its meaning."""

    def first(keys: dict) -> dict:
        scene = {"rules": {"mount": "free"}, **keys.get("scene", {})}
        return keys | {"scene": scene}

    monkeypatch.setattr(versions, "FILE_VERSION", 3)
    monkeypatch.setattr(versions, "UPGRADES", {1: first, 2: lambda keys: keys})
    path = tmp_path / "proposal.toml"
    for stated, mount in (("", "free"), ("version = 1\n", "free"), ("version = 3\n", "real")):
        path.write_text(stated + RINGS)
        _, scene, file = read_proposal(path)
        assert (scene.rules.mount, file.version) == (mount, 3)
    within = {"proposal": {"rings": [{"link": "tool", "count": 8}]}, "version": 3}

    class Holder(VersionedFile):
        proposal: ProposalFile

    found = Holder.model_validate(within, context=FROM_FILE)
    assert found.proposal.scene.rules.mount == "free"
    assert ProposalFile.of(named_setup("n2_16_25"), Scene.paper()).scene.rules.mount == "free"


def test_a_file_keeps_the_angles_of_a_less_precise_catalogue(tmp_path):
    """19.1° by 19.1° is what the catalogue once had for this sensor; today it has 18.98°."""
    path = tmp_path / "mine.toml"
    sensor = 'model = "vl53l1x"\nfov_deg = 19.091883\nfov_up_deg = 19.091883\n'
    path.write_text(RINGS + "[scene.sensor]\n" + sensor)
    setup, scene, _ = read_proposal(path)
    assert math.degrees(setup.rings[0].sensor.fov) == pytest.approx(19.091883, abs=1e-9)
    assert setup.rings[0].sensor.use.model == "vl53l1x"
    path.write_text(to_toml(ProposalFile.of(setup, scene)))
    assert read_proposal(path)[0] == setup
    path.write_text(RINGS + "[scene.sensor]\n" + sensor.replace("19.09", "19.59"))
    with refused("mine.toml scene.sensor.fov_deg 19.591883"):
        read_proposal(path)


@given(
    robot=st.sampled_from(["ur10", "ur5e", "panda"]),
    change=st.sampled_from(
        [
            {},
            {"rules": Rules(shared_tilt=True, spacing=0.05)},
            {"rules": Rules(mount="free"), "occlusion": "ignore"},
            {"over_poses": "worst", "safety": Safety(human=1.0)},
            {"printing": Printing(cover=True)},
            {
                "sensor": effective(Use("vl53l5cx")).sensor,
                "ring_radius": 0.09,
            },
            {"poses": (Pose(np.radians(REFERENCE_POSE_DEG)),), "robot": ROBOTS["ur10e"]},
        ]
    ),
    covered=st.integers(0, 9999),
)
def test_a_proposal_states_what_differs_and_is_read_back_whole(robot, change, covered):
    """To the same setup, scene and counts, whatever has its default; and no interval that is the
    count itself."""
    base = Scene(robot=ROBOTS[robot], poses=(Pose(ROBOTS[robot].rest),))
    scene = replace(base, **change)
    setup = named_setup("n1_8_0", scene.sensor)
    ends = dict.fromkeys(("zeta", "low", "high"), covered / 10_000)
    count = Verified(
        setup="proposal",
        target="V_S",
        radius=0.5,
        rule="centre",
        target_voxels=10_000,
        covered_voxels=covered,
        seconds=0.0,
        poses=[PoseZeta(weight=1.0, **ends)],
        **ends,
    )
    file = ProposalFile.of(setup, scene, zeta=[count])
    text = to_toml(file)
    read = ProposalFile.model_validate(tomllib.loads(text), context=FROM_FILE)
    without = {"zeta": []}
    assert read.model_copy(update=without).stated() == file.model_copy(update=without).stated()
    (again,) = read.zeta
    assert again.low == again.zeta == again.high == pytest.approx(count.zeta)
    assert replace(again, **ends, poses=count.poses) == count
    assert repr(read.scene) == repr(file.scene)
    keys = tomllib.loads(text)
    assert "low_percent" not in text
    defaults = scene_table(Scene())
    for table in {"curve", "safety", "motion", "link", "rules", "printing"} & keys["scene"].keys():
        assert all(defaults[table].get(k) != v for k, v in keys["scene"][table].items())
    whole = tomli_w.dumps(without_none(file.model_dump(mode="json")))  # as files stated before
    assert (
        ProposalFile.model_validate(tomllib.loads(whole), context=FROM_FILE).stated()
        == read.stated()
    )
