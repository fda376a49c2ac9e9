"""Poses in JSON and frames of a URDF on the command line: taken as a proposal is, and what is bad
is refused.
"""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from place_rings.cli.options.groups import SubjectOptions
from place_rings.coverage.definitions.errors import UserError
from place_rings.coverage.rings.ring import named_setup
from place_rings.formats.export.placed import PlacedSetup
from place_rings.formats.export.sensor_tables import json as poses
from place_rings.formats.export.urdf import urdf
from place_rings.formats.loader import resolve
from place_rings.formats.sensors.sensor_poses import setup_of_poses
from place_rings.objectives.scene import Scene

from ..support.refusals import has_parts

SETUP = named_setup("n1_4_25")


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """The texts of both files of ``SETUP``."""
    placed = PlacedSetup(Scene.paper(), SETUP, 0, tmp_path_factory.mktemp("exported"))
    return {
        "mounted.json": poses(placed)["sensors.json"].decode(),
        "mounted.urdf": urdf(placed)["robot.urdf"].decode(),
    }


def changed(*path_and_value):
    """A change of the JSON: the value at the end, under the keys before it."""

    def change(text):
        file = json.loads(text)
        at, (*path, last, value) = file, path_and_value
        for key in path:
            at = at[key]
        at[last] = value
        return json.dumps(file)

    return change


SENSOR = ("rings", 0, "sensors", 0)
BAD_JSON = {
    "not JSON": (lambda text: text[:-3], "JSON"),
    "deep": (lambda text: "[" * 100_000, "JSON"),
    "not a table": (lambda text: "[]", "table"),
    "not finite": (lambda text: text.replace("0.08", "NaN"), ""),
    "an unknown key": (changed("colour", 1), "colour"),
    "no rings": (changed("rings", []), "rings"),
    "an unknown frame": (changed("rings", 0, "frame", "hip"), 'rings[0].frame "hip"'),
    "the base": (changed("rings", 0, "frame", "base"), 'rings[0].frame "base"'),
    "an unknown link": (changed("rings", 0, "link", "leg"), 'rings[0].link "leg"'),
    "far away": (changed(*SENSOR, "xyz", [0, 0, 1e9]), "rings[0].sensors[0].xyz[2]"),
    "no rotation": (changed(*SENSOR, "xyzw", [0, 0, 0, 0]), "rings[0].sensors[0].xyzw"),
    "one of two": (changed(*SENSOR, "base_xyzw", None), "base_xyz base_xyzw"),
    "another pose": (changed("q_deg", [0, -45, 61, -105, -90, 0]), "xyz xyzw q_deg"),
    "no pose": (changed("q_deg", None), "q_deg nothing"),
    "angles too few": (changed("q_deg", [0, 1]), "q_deg 2 6"),
    "an unknown sensor": (changed("rings", 0, "sensor", {"model": "eye"}), "rings[0].sensor.model"),
}


def replaced(old, new):
    return lambda text: text.replace(old, new)


BAD_URDF = {
    "a document type": (lambda text: "<!DOCTYPE r>" + text.partition("?>")[2], "document type"),
    "another robot": (replaced('"elbow"', '"knee"'), 'joint "elbow"'),
    "a joint elsewhere": (replaced("0 -0.1719 0.612", "0 -0.1 0.612"), 'joint "elbow" 0.0719'),
    "no such frames": (replaced("tof_", "eye_"), '"tof_.*"'),
    "a frame beside": (
        replaced("</robot>", '<link name="tof_9" /></robot>'),
        'frame "tof_9" ur10',
    ),
}
BAD = [("mounted.json", *case) for case in BAD_JSON.values()]
BAD += [("mounted.urdf", *case) for case in BAD_URDF.values()]


@pytest.mark.parametrize(("file", "change", "parts"), BAD, ids=[*BAD_JSON, *BAD_URDF])
def test_a_bad_file_is_one_line_and_exit_code_2(run, exported, tmp_path, file, change, parts):
    text = change(exported[file])
    assert text != exported[file]
    (tmp_path / file).write_text(text)
    code, out, err = run("export", file, "--to", "csv", "--out", "out")
    assert (code, out) == (2, "")
    assert has_parts(err, f"{file} {parts}"), err
    assert [path.name for path in tmp_path.iterdir()] == [file]


REFUSED = {
    "no format": ((), "--to urdf, mjcf"),
    "an unknown format": (("--to", "step"), '--to "step" urdf'),
    "no such pose": (("--to", "csv", "--pose", "1"), "--pose 1 0"),
    "no such URDF": (("--to", "urdf", "--urdf", "none.urdf"), "none.urdf"),
    "frames of a name": (("--to", "csv", "--frames", "a"), "--frames"),
    "an unknown axis": (("--to", "csv", "--beam", "w"), "--beam"),
}


@pytest.mark.parametrize(("options", "parts"), REFUSED.values(), ids=REFUSED.keys())
def test_what_cannot_be_exported_is_refused(run, tmp_path, options, parts):
    code, out, err = run("export", "n1_4_25", *options)
    assert (code, out) == (2, "")
    assert has_parts(err, parts), err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("pattern", ["(", "x" * 201, "a{99999999999}"])
def test_a_bad_pattern_is_refused(run, exported, tmp_path, pattern):
    (tmp_path / "mounted.urdf").write_text(exported["mounted.urdf"])
    code, _, err = run("verify", "mounted.urdf", "--frames", pattern)
    assert code == 2
    assert has_parts(err, "--frames"), err


def test_what_is_mounted_is_verified_and_bettered_as_a_name_is(
    run, exported, tmp_path, monkeypatch
):
    """Commands are given the rings that were exported; what they make of rings is tested
    elsewhere.
    """
    for file, text in exported.items():
        (tmp_path / file).write_text(text)
    zeta, given = [], []
    resolve = SubjectOptions.resolve

    def enough(*asked):
        given.append((asked[1], resolve(*asked)[0]))
        raise UserError("enough")

    for subject in ("n1_4_25", *exported):
        code, out, _ = run(
            *("verify", subject, "--target", "V_S", "--radius", "0.5", "--voxel", "0.1"),
            *("--json", "--paper"),
        )
        assert code == 0
        zeta.append(json.loads(out)["zeta_percent"])
        frames = ("--frames", "tof_[012]_.*", "--beam", "x") if subject.endswith("urdf") else ()
        for command in ("improve", "robustness", "report", "view"):
            with monkeypatch.context() as patch:
                patch.setattr(SubjectOptions, "resolve", enough)
                assert run(command, subject, "--target", "V_S:0.5", "--paper", *frames)[0] == 2
    assert zeta[1:] == pytest.approx(zeta[:1] * 2, abs=0.02)
    names = [name for name in ("n1_4_25", *exported) for _ in range(4)]
    assert [name for name, _ in given] == names
    for _, setup in given:
        assert [(r.link, r.count) for r in setup.rings] == [(r.link, r.count) for r in SETUP.rings]
        for key in ("position", "tilt", "radius"):
            assert [getattr(r, key) for r in setup.rings] == pytest.approx(
                [getattr(r, key) for r in SETUP.rings], abs=1e-6
            )


def test_a_sensor_of_the_catalogue_is_kept_in_json_and_taken_of_the_scene_for_a_urdf(
    run, exported, tmp_path
):
    (tmp_path / "mounted.urdf").write_text(exported["mounted.urdf"])
    code, out, _ = run("export", "mounted.urdf", "--to", "json", "--out", "plain", "--paper")
    assert (code, out) == (0, "plain/sensors.json\n")
    text = (tmp_path / "plain" / "sensors.json").read_text()
    found = changed("rings", 0, "sensor", {"model": "vl53l1x"})(text)
    rings = setup_of_poses("list", found, Scene.paper()).rings
    assert rings[0].sensor.use.model == "vl53l1x"
    assert rings[1].sensor == Scene.paper().sensor
    wide = replace(Scene.paper().sensor, fov=0.7)
    again = resolve(str(tmp_path / "mounted.urdf"), Scene.paper(sensor=wide))[0]
    assert {r.sensor for r in again.rings} == {wide}


def test_json_by_hand_may_leave_the_base_out():
    """Eight sensors on the forearm, looking along x, in the frame of its joint."""
    turn = 2 * np.pi * np.arange(8) / 8
    sensors = [
        {
            "name": f"s{k}",
            "xyz": [0.1 * np.cos(a), 0.1 * np.sin(a), 0.3],
            "xyzw": [0, 0, np.sin(a / 2), np.cos(a / 2)],
        }
        for k, a in enumerate(turn)
    ]
    text = json.dumps({"beam": "x", "rings": [{"frame": "elbow", "sensors": sensors}]})
    (ring,) = setup_of_poses("list", text, Scene.paper()).rings
    assert (ring.link, ring.count, ring.sensor) == ("forearm", 8, Scene.paper().sensor)
    phase = math.remainder(ring.phase, 2 * math.pi)
    assert (ring.position * 0.5723, ring.radius, ring.tilt, phase) == pytest.approx(
        (0.3, 0.1, 0, 0), abs=1e-9
    )
