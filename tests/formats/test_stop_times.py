"""Measured stops in CSV: read whole, and refused in one line."""

import pytest
from place_rings.coverage.robots.built_in import UR10
from place_rings.formats.loader import read_proposal, read_scene
from place_rings.formats.schema.proposal_models import ProposalFile
from place_rings.formats.stop_times import read_stop_times
from place_rings.formats.writing import to_toml
from place_rings.objectives.named_layouts import layout_in

from tests.support.refusals import refused

HEAD = "joint,extension_percent,load_percent,speed_percent,stop_s,stop_rad,repeat\n"
JOINT = UR10.chain.joints[0]
ROW = f"{JOINT},100,100,66,0.41,0.31,1\n"
BAD = {
    "": "line 1 nothing joint,extension_percent",
    HEAD: "no stop",
    HEAD.replace("stop_rad", "stop_s"): "line 1 joint,extension_percent",
    HEAD.replace(",stop_rad", "") + ROW.replace(",0.31", ""): "line 2 stop_rad nothing stop_m",
    HEAD.replace("repeat", "note"): "line 1 joint,extension_percent",
    HEAD + ROW.replace("0.41", "nan"): "line 2 stop_s",
    HEAD + ROW.replace("0.41", "inf"): "line 2 stop_s",
    HEAD + ROW.replace("0.41", "-0.1"): "line 2 stop_s -0.1",
    HEAD + ROW.replace("0.41", ""): "line 2 stop_s",
    HEAD + ROW.replace("0.41", "0,41"): "line 2 fields 7",
    HEAD + ROW + ROW.replace("66", "101"): "line 3 speed_percent 101",
    HEAD + ROW.replace("66", "0"): "line 2 speed_percent 0",
    HEAD + ROW.replace(",1\n", ",1.5\n"): "line 2 repeat",
    HEAD + ROW.replace(JOINT, "tail"): 'line 2 joint "tail" ur10',
    HEAD + ROW + ROW: "line 3 repeat 1",
    HEAD + ROW.replace("0.41", "9" * 5000): "line 2 stop_s",
    HEAD + '"' + "x" * 200_000: "CSV",
    HEAD + ROW * 50_000: "1 MB",
}


@pytest.mark.parametrize(("text", "parts"), BAD.items(), ids=range(len(BAD)))
def test_a_bad_file_is_one_line(tmp_path, text, parts):
    path = tmp_path / "stops.csv"
    path.write_text(text)
    with refused(f"stops.csv {parts}"):
        read_stop_times(path, UR10)


def test_columns_may_stand_in_any_order_and_either_distance_may_be_empty(tmp_path):
    path = tmp_path / "stops.csv"
    path.write_text(
        "repeat,stop_m,stop_rad,stop_s,speed_percent,load_percent,extension_percent,joint\r\n"
        f"1,,0.31,0.41,66,100,100,{JOINT}\r\n2,0.2,,0.43,66,100,100,{JOINT}\r\n"
    )
    first, second = read_stop_times(path, UR10)
    assert (first.stop_rad, first.stop_m) == (0.31, None)
    assert (second.stop_rad, second.stop_m, second.stop_s) == (None, 0.2, 0.43)


def test_a_scene_names_the_file_and_a_proposal_holds_its_rows(tmp_path):
    (tmp_path / "stops.csv").write_text(HEAD + ROW)
    (tmp_path / "scene.toml").write_text('[safety]\nstop_times = "stops.csv"\n')
    scene = read_scene(tmp_path / "scene.toml")
    assert scene.safety.stop_times == read_stop_times(tmp_path / "stops.csv", UR10)
    setup = layout_in(scene, "n1_8_0")
    (tmp_path / "mine.toml").write_text(to_toml(ProposalFile.of(setup, scene)))
    (tmp_path / "stops.csv").unlink()
    assert read_proposal(tmp_path / "mine.toml")[1].safety == scene.safety
    with refused("scene.toml safety.stop_times stops.csv"):
        read_scene(tmp_path / "scene.toml")
