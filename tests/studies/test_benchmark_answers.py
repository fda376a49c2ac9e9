"""Answers of the benchmark are judged by the question alone, whatever their files state, and what
the command writes has the value that it states."""

import json
import sys
from dataclasses import replace

import pytest
import tomli_w
from place_rings.cli.app import main
from place_rings.coverage.definitions.errors import UserError
from place_rings.formats.layouts.entry_csv import COLUMNS, read_entry
from place_rings.formats.sensors.sensor_lists import sensor_list
from place_rings.studies.benchmark.entries import ENTRIES, FOLDER
from place_rings.studies.benchmark.questions import QUESTIONS
from place_rings.studies.benchmark.score import broken_rules

HEAD = ",".join(COLUMNS) + "\n"
STRIP = QUESTIONS["panda_strip"]


def file_of(folder, text, name="panda_strip.csv"):
    folder.mkdir(exist_ok=True)
    (folder / name).write_text(text)
    return folder / name


def command(*words):
    """Run the command; return its exit code."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["place-rings", "benchmark", *map(str, words)])
        try:
            main()
        except SystemExit as end:
            return end.code
    return 0


@pytest.mark.parametrize("name", ["paper_near", "blind_ur5e", "square_ur5e", "hand", "panda_pads"])
def test_a_list_of_sensors_has_the_sensors_of_the_question(name, tmp_path):
    """A list states beams, not models."""
    question = QUESTIONS[name]
    _, setup = read_entry(ENTRIES["greedy"].file(name), question.scene)
    _, listed = read_entry(file_of(tmp_path, sensor_list(setup, question.scene)), question.scene)
    assert [ring.sensor for ring in listed.rings] == [ring.sensor for ring in setup.rings]
    assert [ring.radius for ring in listed.rings] == [ring.radius for ring in setup.rings]
    assert broken_rules(question, listed) == ()


RING = {"link": "forearm", "position": 0.5, "count": 8, "tilt_deg": 30.0, "phase_deg": 0.0}


@pytest.mark.parametrize(
    ("keys", "kept"),
    [
        (
            {
                "sensor": {
                    "fov_deg": 25.0,
                    "range_m": 0.4881,
                    "board": {"width": 0.002, "height": 0.002, "thickness": 0.001},
                }
            },
            True,
        ),
        ({"sensor": {"fov_deg": 25.0, "range_m": 0.6}}, False),
        ({"sensor": {"fov_deg": 26.0, "range_m": 0.4881}}, False),
        ({"sensor": {"model": "vl53l1x"}}, False),
        ({"radius": 0.2}, False),
    ],
)
def test_rings_of_a_proposal_count_only_with_the_sensor_and_radius_of_the_question(
    keys, kept, tmp_path
):
    """Its own scene has another robot body, no occlusion, and another sensor."""
    _, setup = read_entry(
        file_of(tmp_path, HEAD + ",".join(str(v) for v in RING.values()) + "\n"), STRIP.scene
    )
    radius, scene = setup.rings[0].radius, {"robot": "panda", "occlusion": "ignore"}
    ring = RING | {"radius": radius + 5e-5} | keys
    text = tomli_w.dumps({"scene": scene, "rings": [ring]})
    _, stated = read_entry(file_of(tmp_path, text, "panda_strip.toml"), STRIP.scene)
    assert (stated == setup) == kept
    assert (broken_rules(STRIP, stated) == ()) == kept


def test_a_question_has_one_answer_in_a_folder(tmp_path, capsys):
    folder, out = tmp_path / "answers", tmp_path / "out"
    text = ENTRIES["greedy"].file("panda_strip").read_text()
    for name in ("panda_strip.csv", "panda_strip.CSV"):
        file_of(folder, text, name)
    assert command("--score", folder, "--out", out) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
    assert not out.exists()


def test_what_is_written_is_what_is_scored(tmp_path, capsys):
    _, setup = read_entry(
        file_of(tmp_path, HEAD + "forearm,0.50000049,9,30.000049,7.1\n"), STRIP.scene
    )
    answers, out = tmp_path / "answers", tmp_path / "out"
    file_of(answers, sensor_list(setup, STRIP.scene))
    assert command("--score", answers, "--out", out, "--json") == 0
    (first,) = json.loads(capsys.readouterr().out)
    assert command("--score", out, "--json") == 0
    (again,) = json.loads(capsys.readouterr().out)
    assert first == again


def test_no_answer_that_breaks_a_rule_is_written(tmp_path):
    _, setup = read_entry(file_of(tmp_path, HEAD + "forearm,0.5,8,30,0\n"), STRIP.scene)
    far = replace(setup.rings[0], sensor=replace(setup.rings[0].sensor, range_m=1.0))
    answers, out = tmp_path / "answers", tmp_path / "out"
    file_of(answers, sensor_list(replace(setup, rings=(far,)), STRIP.scene))
    assert command("--score", answers, "--out", out) == 1
    assert not out.exists()


def test_too_many_rings_are_a_line_with_their_file(tmp_path):
    file = file_of(tmp_path, HEAD + "forearm,0.5,8,30,0\n" * 1001)
    with pytest.raises(UserError) as refused:
        read_entry(file, STRIP.scene)
    assert str(refused.value).startswith(f"{file}: ")


def test_every_folder_of_answers_is_an_entry_and_every_file_an_answer():
    assert set(ENTRIES) == {folder.name for folder in FOLDER.iterdir()}
    for folder in FOLDER.iterdir():
        assert {file.name for file in folder.iterdir()} <= {f"{name}.csv" for name in QUESTIONS}
