"""Errors of the command line: each is one line that says what was found and what to do."""

import pytest

ERRORS = {
    "verifi n2_16_25": 'unknown command "verifi"; did you mean verify? (allowed: check,',
    "n2_16_25": 'unknown command "n2_16_25" (allowed: check,',
    "verify": "verify: PROPOSAL_OR_NAME is missing; see place-rings verify --help",
    "verify n2_16_25 again": 'verify: unexpected argument "again"; see place-rings verify --help',
    "verify n2_16_25 --targt V_S": "unknown option --targt; did you mean --target?",
    "verify n2_16_25 --zzz": "unknown option --zzz; see place-rings verify --help",
    "--zzz": "unknown option --zzz; see place-rings --help",
    "verify n2_16_25 --radius": "verify: --radius needs a value; see place-rings verify --help",
    "verify n2_16_25 --radius abc": '--radius: found "abc", allowed: a number',
    "--sensors many": '--sensors: found "many", allowed: an integer',
    "--sensors 1.5": '--sensors: found "1.5", allowed: an integer',
    "export n1_8_0 --to csv --pose 0.5": '--pose: found "0.5", allowed: an integer',
    "robustness n1_8_0 --seed nan": '--seed: found "nan", allowed: an integer',
    "--sensors 0": "--sensors: found 0, allowed: at least 1",
    "view n2_16_25 --port 99999": "--port: found 99999, allowed: at most 65535",
    "verify n2_16_25 --rule exact": '--rule: found "exact", allowed: centre, touch, certified',
    "schema soul": 'schema NAME: found "soul", allowed: scene, robot,',
    "verify n2_16_25 --target V_S": (
        "--target V_S: target V_S needs a radius in metres; write V_S:0.5, or add --radius 0.5"
    ),
    "verify n2_16_25 --beam y": "--frames, --beam: allowed only with a URDF (.urdf), found",
    "report nothing": "nothing: cannot be read: no such file; give a proposal (.toml), a list of",
    "check n2_16_25": "check: give exactly one of --rig sim, --robot-host HOST, --replay FILE",
}


@pytest.mark.parametrize(("words", "line"), ERRORS.items())
def test_a_wrong_command_is_one_line_that_helps(run, tmp_path, words, line):
    code, out, err = run(*words.split())
    assert (code, out) == (2, "")
    assert err.startswith(f"place-rings: {line}")
    assert err.count("\n") == 1
    assert not list(tmp_path.iterdir())
