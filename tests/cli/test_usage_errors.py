"""Errors of the command line: each is one line that names what was found, and the way out."""

import fcntl
import os
import re

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
FLOORS = {  # a floor: what its refusal names
    "V_Q=50": "V_Q",
    "V_S:0.1=50": "0.15",
    "V_S=50": "V_S:0.5=50",
    "V_N=50": "V_N:0.5=50",
    "V_O=101": "101",
    "V_O": '"V_O"',
    "V_S:1.5=60 --at-least V_S:1.5=40": "V_S:1.5=40",
}
ERRORS |= {
    f"--at-least {floor}": ("place-rings: --at-least", part) for floor, part in FLOORS.items()
}
REFUSED = """
--target V_X
--target V_S:0.5 --robot r2d2
--target V_S --radius -0.5
--target V_S --radius nan
--target V_S --radius 0.15
--target V_S:0.1
--target V_N:0
--target V_O --radius 0.3
--radius 0.5
--target V_S:0.5=0
--target V_S:0.5:3
--sensors-per-ring 0
--rings-per-link 0
--tagret V_S
--time 0
--voxel 1e-6
--voxel 10
--voxel -1
--out /proc/nowhere
--scene absent.toml
--sensor vl53l1x --ambient 300kcps
--sensor vl53l1x --target-size 0.1
--redundancy 0
--direction-error-deg 1
--target V_S:0.5 --at-least V_S:1.5=40 --losing ring
--losing ring --redundancy 2
--sensors 12 --rings-per-link 3
--reach 50 --sensors-per-ring 8
verify n7_1_1 --target V_O
verify n2_16_25 --rule guess
verify n2_16_25 --voxel 1e-7
verify n2_16_25 --sensor eye
verify n2_16_25 --ambient 50kcps
safety n2_16_25 --approaches 0
safety n2_16_25 --degrees
safety n2_16_25 --trajectory absent.csv
robustness n2_16_25 --draws 0
robustness n2_16_25 --k 0
robustness n2_16_25 --position-error-mm=-1
robustness n2_16_25 --direction-error-deg nan
robustness n2_16_25 --law murphy
robustness n9_1_1
robustness n2_16_25 --voxel 1e-7
report n9_1_1
report n2_16_25 --draws 0
report n2_16_25 --voxel 1e-7
study paper --workers 0
study paper --workers 2 --scheduler tcp://127.0.0.1:8786
study paper --scheduler here
study bound --sensors 40
study gap --quick
study convergence --seed 3
study pareto --target V_O --target V_O
study pareto --target V_S:0.5=0.6 --target V_O
study pareto --target V_S:0.1 --target V_O
study pareto --scene absent.toml
""".strip().splitlines()


@pytest.mark.parametrize("words", [*ERRORS, *REFUSED])
def test_a_wrong_command_is_one_line_that_helps(run, tmp_path, words):
    """It names what the table says, or else a word that was given."""
    parts = ERRORS.get(words, ())
    code, out, err = run(*words.split())
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("place-rings: ")
    assert [part for part in parts if part not in err] == [], err
    asked = set(re.split("[ =:]", words)) - {"verify", "robustness", "report", "study"}
    assert parts or [word for word in asked if word in err]
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
