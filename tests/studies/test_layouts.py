"""Layouts of others: what a file says is what is scored, and what is bad is one clear line."""

import json
import math
import re
import tomllib
from dataclasses import replace

import numpy as np
import place_rings as pr
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.definitions.errors import UserError
from place_rings.coverage.rings.mounted_sensor import MountedSensor
from place_rings.coverage.rings.ring import Setup, named_setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.robots.built_in import UR10
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.formats.export.placed import PlacedSetup
from place_rings.formats.export.urdf import urdf
from place_rings.formats.layouts.csv_poses import COLUMNS, ORIENTED
from place_rings.formats.layouts.layout import read_layout
from place_rings.formats.schema.layout_models import LayoutModel
from place_rings.objectives.scene import Pose, Scene
from place_rings.objectives.verify import Verifier
from place_rings.studies.engine.runner import TASKS
from place_rings.studies.engine.scenes import scene_from, setup_keys
from place_rings.studies.layouts import study
from scipy.io import savemat

from ..strategies.singles import SENSORS, singles

ABOUT = LayoutModel(
    title="Drawn | <b>",
    source="nowhere",
    date="2026-11-22",
    licence="none",
    how="drawn",
    robot="ur10",
    sensor=Sensor(),
    beam_source="the paper's",
)
KEYS = """title = "t"
source = "s"
date = "2026-11-22"
licence = "l"
how = "h"
robot = "ur10"
beam_source = "b"
sensor = { fov_deg = 30.0, range_m = 1.0 }
"""
ROWS = "name,link,x,y,z,axis_x,axis_y,axis_z\npad,forearm,0.1,0,0.2,2,0,0\n"


def commented(keys):
    return "".join(f"# {line}\n" for line in keys.splitlines())


def layout_csv(model, sensors):
    """A layout as CSV."""
    keys = model.model_dump(mode="json", exclude_defaults=True, exclude_none=True)
    beam = ", ".join(f"{key} = {json.dumps(value)}" for key, value in keys.pop("sensor").items())
    lines = [f"# {key} = {json.dumps(value)}" for key, value in keys.items()]
    lines += [f"# sensor = {{ {beam} }}"]
    oriented = any(one.up is not None for one in sensors)
    lines += [",".join(ORIENTED if oriented else COLUMNS)]
    for one in sensors:
        up = one.up or tuple(one.T_link_sensor[:3, 1])
        place = (*one.position, *one.direction, *(up if oriented else ()))
        lines.append(",".join([one.name, one.link, *(repr(float(v)) for v in place)]))
    return "\n".join([*lines, ""])


@settings(max_examples=6)
@given(st.lists(singles(), min_size=1, max_size=4), SENSORS)
def test_a_drawn_layout_is_scored_as_verify_counts_it(tmp_path_factory, some, sensor):
    path = tmp_path_factory.mktemp("layout") / "drawn.csv"
    each = tuple(replace(one, sensor=sensor, name=f"s{i}") for i, one in enumerate(some))
    path.write_text(layout_csv(ABOUT.model_copy(update={"sensor": sensor}), each), "utf-8")
    layout = read_layout(path)
    assert layout.setup == Setup((), each)
    assert layout.about.title == ABOUT.title
    cell = {
        "scene": study.scene_keys(layout, "shadow"),
        "setup": json.loads(json.dumps(setup_keys(layout.setup, layout.scene))),
        "rule": "centre",
        "voxel": 0.1,
    }
    scene = Scene(robot=UR10, poses=(Pose(UR10.rest),), sensor=sensor)
    for target in study.TARGETS[:2]:
        asked = {"target": target.name, "radius": target.radius}
        scored = TASKS["zeta"](**cell, **asked)
        counted = Verifier(scene, 0.1, "centre").verify(Setup((), each), target)
        assert scored["zeta_percent"] == 100 * counted.zeta


def keys(old, new):
    """The file of the pad with other keys."""
    return commented(KEYS.replace(old, new)) + ROWS


def rows(old, new):
    """The file of the pad with another table."""
    return commented(KEYS) + ROWS.replace(old, new)


BAD = {  # a file: what its refusal names
    "no comment": (ROWS, ["title"]),
    "not TOML": ("# title\n" + ROWS, ["TOML"]),
    "an unknown key": (commented(KEYS + 'colour = "red"') + ROWS, ["colour"]),
    "a date of another form": (keys("2026-11-22", "22.11.2026"), ["date", "22.11.2026"]),
    "no such robot": (keys("ur10", "hal"), ["robot", "hal"]),
    "a name too long": (keys("ur10", "a" * 280 + ".toml"), ["robot"]),
    "a lift of text": (commented(KEYS + 'lift_mm = "far"') + ROWS, ["lift_mm", "far"]),
    "a wrong number of angles": (commented(KEYS + "pose_deg = [1.0]") + ROWS, ["1 ", "6"]),
    "an angle beyond the limits": (
        commented(KEYS + "pose_deg = [0.0, 0.0, 700.0, 0.0, 0.0, 0.0]") + ROWS,
        ["elbow"],
    ),
    "other columns": (rows("axis_z", "axis_w"), ["line 9", "axis_w"]),
    "a missing field": (rows(",2,0,0", ",2,0"), ["line 10"]),
    "text for a number": (rows(",2,", ",two,"), ["line 10: axis_x", "two"]),
    "an infinite place": (rows("0.1", "inf"), ["line 10: x", "inf"]),
    "no direction": (rows(",2,0,0", ",0,0,0"), ["line 10: axis"]),
    "no such link": (rows("forearm", "hip"), ["link", '"hip"']),
    "no row": (commented(KEYS) + ROWS.splitlines()[0] + "\n", ["no sensor"]),
    "a square beam without up": (keys("fov_deg", "fov_up_deg = 20.0, fov_deg"), ["line 10: up"]),
}


@pytest.mark.parametrize("name", BAD)
def test_a_wrong_layout_is_refused_by_what_is_wrong(tmp_path, name):
    text, parts = BAD[name]
    file = tmp_path / "wrong.csv"
    file.write_text(text)
    with pytest.raises(UserError) as refused:
        read_layout(file)
    said = str(refused.value)
    assert [part for part in ("wrong.csv", *parts) if part not in said] == [], said
    assert "\n" not in said


def test_layouts_that_cannot_be_scored_are_one_line_and_nothing_is_written(
    run, tmp_path, monkeypatch
):
    """A wrong file, another study, one layout twice, results over it, and too few sensors."""
    monkeypatch.setattr(study, "PUBLISHED", tmp_path / "none")
    (tmp_path / "none").mkdir()
    head, row = ROWS.splitlines()
    three = [head, *(row.replace("pad", name) for name in "abc")]
    texts = dict.fromkeys(("data", "mine"), commented(KEYS) + "\n".join(three))
    texts |= {"wrong": ROWS, "one": commented(KEYS) + ROWS}
    for name, text in texts.items():
        (tmp_path / f"{name}.csv").write_text(text)

    def refused(*names, name="layouts", out="out"):
        words = [word for one in names for word in ("--layout", tmp_path / f"{one}.csv")]
        code, out, err = run("study", name, *words, "--out", tmp_path / out)
        assert (code, out, err.count("\n")) == (2, "", 1)
        return err

    assert "wrong.csv" in refused("wrong")
    assert "--layout" in refused("mine", name="robots")
    assert "mine" in refused("mine", "mine")
    assert "data.csv" in refused("data", out=".")
    # no search places a single sensor
    assert "one.csv" in refused("one")
    assert {path.name for path in tmp_path.iterdir()} == {"none", *(f"{n}.csv" for n in texts)}
    assert {n: (tmp_path / f"{n}.csv").read_text() for n in texts} == texts


def test_a_layout_reads_the_frames_of_a_urdf_as_single_sensors(tmp_path):
    setup = named_setup("n1_4_25")
    placed = PlacedSetup(Scene.paper(), setup, 0, tmp_path)
    (tmp_path / "robot.urdf").write_bytes(urdf(placed)["robot.urdf"])
    (tmp_path / "mine.toml").write_text(
        KEYS.partition("sensor =")[0]
        + '[sensor]\nfov_deg = 25.0\n[urdf]\nfile = "robot.urdf"\nframes = "tof_.*"\n'
    )
    layout = read_layout(tmp_path / "mine.toml")
    assert (layout.setup.rings, layout.setup.sensors) == ((), setup.sensors)
    one, other = (
        sensor_cones(scene.robot, s, UR10.rest)
        for scene, s in ((layout.scene, layout.setup), (Scene.paper(), setup))
    )
    np.testing.assert_allclose(np.asarray(one.apex), np.asarray(other.apex), atol=1e-6)
    np.testing.assert_allclose(np.asarray(one.axis), np.asarray(other.axis), atol=1e-6)
    (tmp_path / "mine.toml").write_text(
        KEYS.partition("sensor =")[0]
        + '[sensor]\n[urdf]\nfile = "../robot.urdf"\nframes = "tof_.*"\n'
    )
    with pytest.raises(UserError, match=r"mine\.toml: urdf\.file: .*\.\./robot\.urdf"):
        read_layout(tmp_path / "mine.toml")


def strip(count, shift):
    """Transforms along a line, which look along x."""
    each = np.empty(count, object)
    for k in range(count):
        T = np.eye(4)
        T[:3, :3] = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
        T[:3, 3] = [0.1, 0.02 * k, shift]
        each[k] = T
    return each


def test_a_layout_reads_the_frames_of_a_matlab_file(tmp_path):
    rows = np.empty(3, object)
    for i in range(3):
        rows[i] = strip(4, 0.1 * i)
    savemat(tmp_path / "frames.mat", {"all": rows, "one": strip(2, 0.5), "no": np.eye(3)})

    def layout(*mats):
        text = KEYS.partition("sensor =")[0] + "[sensor]\n"
        (tmp_path / "mine.toml").write_text(
            text + "".join(f'[[mat]]\nfile = "frames.mat"\nlink = "elbow"\n{m}\n' for m in mats)
        )
        return read_layout(tmp_path / "mine.toml")

    setup = layout('variable = "all"\nrow = 2', 'variable = "one"\nbeam = "z"').setup
    assert [one.position[2] for one in setup.singles] == [0.1] * 4 + [0.5] * 2
    assert setup.singles[0].direction == (0.0, 1.0, 0.0)  # x of the frame
    assert setup.singles[-1].direction == (1.0, 0.0, 0.0)  # its z
    assert setup.singles[1].name == "frames_2_1"
    for wrong, named in (
        ('variable = "none"', "none"),
        ('variable = "all"\nrow = 4', "row.*4.*1 to 3"),
        ('variable = "no"', "no"),
        ('variable = "all"', "all"),
    ):
        with pytest.raises(UserError, match=rf"mat.*{named}"):
            layout(wrong)
    (tmp_path / "frames.mat").write_bytes(b"MATLAB 5.0" + bytes(200))
    with pytest.raises(UserError, match=r"frames\.mat"):
        layout('variable = "one"')


def test_the_layouts_of_the_package_read_and_say_where_they_are_from():
    some = {layout.name: layout for layout in study.layouts()}
    assert {"paper_n2_16_55", "woomessi_strip", "gentact_fr3_12356"} <= set(some)
    counts = [some[f"gentact_fr3_{f}"].setup.sensors for f in ("56_fancy", "2356_fancy", "12356")]
    assert counts == [14, 29, 37]
    assert some["paper_n3_16_55"].setup.sensors == 112
    for layout in some.values():
        assert all(lift.lifted for lift in layout.lifts)
        assert layout.scene.occlusion == "shadow"


@pytest.fixture
def small(monkeypatch, tmp_path):
    """A study of one layout with coarse voxels and a stand-in for the search."""
    for name, value in (("VOXEL", 0.1), ("WIDTH", 0.3), ("PUBLISHED", tmp_path / "published")):
        monkeypatch.setattr(study, name, value)
    (tmp_path / "published").mkdir()
    one = MountedSensor("panda_joint5", (0.02, 0.08, 0.0), (0, 1, 0), name="pad")
    dome = Sensor(math.pi, 0.4, shape="dome")
    about = ABOUT.model_copy(update={"robot": "panda", "sensor": dome, "lift_mm": 90.0})
    text = layout_csv(about, [replace(one, sensor=dome)])
    (tmp_path / "published/pad.csv").write_text(text, "utf-8")

    def place(**asked):
        rings = [{"link": "forearm", "position": 0.5, "count": asked["sensors"], "radius": 0.15}]
        return {"rings": rings, "finished": False, "processor_seconds": 10.0, "wall_seconds": 20.0}

    monkeypatch.setitem(TASKS, "place in time", place)
    return tmp_path


@pytest.mark.slow
def test_a_score_lies_in_its_interval_and_the_page_is_made_of_its_cells(small, run, monkeypatch):
    folder = small / "out"
    (row,) = pr.study("layouts", folder=folder).data
    for score in (row.score, row.proposed):
        for name, value in score.shadow.items():
            assert value <= score.ignore[name]  # occlusion takes from it
            assert score.low[name] - 4 <= value <= score.high[name] + 4
    assert row.sensors == 1 == sum(ring["count"] for ring in row.proposal["rings"])
    assert row.setup["sensors"][0]["lifted_mm"] > 0
    scene = scene_from(row.scene)
    assert (scene.robot.name, scene.occlusion) == ("panda", "shadow")
    made = {"README.md", "data.csv", "layouts.png", "setups.toml"}
    assert {file.name for file in folder.iterdir()} == made | {"cells.sqlite"}
    read = {name: (folder / name).read_bytes().splitlines() for name in made}
    assert len(read["data.csv"]) == 1 + 2 * len(study.TARGETS)
    page = (folder / "README.md").read_text()
    assert "Drawn | \\<b\\>" in page
    assert not re.search(r"\bnan\b", page)
    assert f"{row.score.shadow['V_S(0.25)']:.1f} →" in page
    assert list(tomllib.loads((folder / "setups.toml").read_text())) == ["pad"]
    for name in made:
        (folder / name).unlink()
    monkeypatch.setattr("place_rings.studies.engine.runner.time", None)  # to measure needs it
    code, out, _ = run("study", "layouts", "--out", folder)
    assert (code, out.strip()) == (0, str(folder / "README.md"))
    again = {name: (folder / name).read_bytes().splitlines() for name in made}
    for files in (read, again):
        del files["README.md"][2]  # the header, with the load
    assert again == read


def test_a_layout_has_sensors_of_one_kind(tmp_path):
    single = "position = [0.1, 0, 0.2]\ndirection = [1, 0, 0]\nlink = 'forearm'\n"
    own = "[sensors.sensor]\nfov_deg = 10.0\n"
    (tmp_path / "a.toml").write_text(KEYS + "[[sensors]]\n" + single + own)
    with pytest.raises(UserError, match=r"a\.toml: "):
        read_layout(tmp_path / "a.toml")
