"""Errors of the command line: each is one line that names what was found, and the way out."""

import fcntl
import os

import pytest

ERRORS = {  # words of a command: what the line names
    "verifi n2_16_25": ("verifi", "verify", "check"),
    "n2_16_25": ("n2_16_25", "check"),
    "verify": ("verify", "PROPOSAL_OR_NAME", "--help"),
    "verify n2_16_25 again": ("verify", "again", "--help"),
    "verify n2_16_25 --targt V_S": ("--targt", "--target"),
    "verify n2_16_25 --zzz": ("--zzz", "verify --help"),
    "--zzz": ("--zzz", "--help"),
    "verify n2_16_25 --radius": ("verify", "--radius", "--help"),
    "verify n2_16_25 --radius abc": ("--radius", '"abc"'),
    "--sensors many": ("--sensors", '"many"'),
    "--sensors 1.5": ("--sensors", '"1.5"'),
    "export n1_8_0 --to csv --pose 0.5": ("--pose", '"0.5"'),
    "robustness n1_8_0 --seed nan": ("--seed", '"nan"'),
    "--sensors 0": ("--sensors", "0", "1"),
    "view n2_16_25 --port 99999": ("--port", "99999", "65535"),
    "verify n2_16_25 --rule exact": ("--rule", '"exact"', "sampled, centre, touch, certified"),
    "schema soul": ("schema", '"soul"', "scene, robot"),
    "verify n2_16_25 --target V_S": ("--target V_S", "V_S:0.5", "--radius"),
    "verify n2_16_25 --target V_N": ("--target V_N", "V_N:0.5", "--radius"),
    "verify n2_16_25 --beam y": ("--frames", "--beam", ".urdf"),
    "report nothing": ("nothing", ".toml"),
    "check n2_16_25": ("check", "--rig sim", "--robot-host", "--replay"),
}


@pytest.mark.parametrize(("words", "parts"), ERRORS.items())
def test_a_wrong_command_is_one_line_that_helps(run, tmp_path, words, parts):
    code, out, err = run(*words.split())
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("place-rings: ")
    assert [part for part in parts if part not in err] == [], err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("words", ["report n1_8_0", "export n1_8_0 --to csv"])
def test_a_folder_that_another_run_holds_is_named_by_its_option(run, tmp_path, words):
    held = os.open(tmp_path, os.O_RDONLY)
    fcntl.flock(held, fcntl.LOCK_EX)
    code, out, err = run(*words.split(), "--out", tmp_path)
    os.close(held)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert f"--out {tmp_path}" in err
    assert not list(tmp_path.iterdir())
