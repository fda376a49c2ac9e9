"""The core is enough for most commands; the others say which extra they need."""

import json
import os
import subprocess
import sys

import pytest

from ..support.rooms import ROOT

WITHOUT = """
import contextlib, io, json, sys
for name in ("dask", "distributed", "cryptography", "serial", "rtde_control", "rtde_receive",
             "rosbags", "lz4", "backports"):
    sys.modules[name] = None  # as if it were not installed
from place_rings.cli.app import main
if any(words.startswith("report") for words in sys.argv):
    from place_rings.reporting import comparison
    comparison.PAPER_SETUPS, comparison.PAPER_TARGETS = ("n1_4_0",), ()
told = []
for words in sys.argv[1:]:
    sys.argv = ["place-rings", *words.split()]
    out, err, code = io.StringIO(), io.StringIO(), 0
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            main()
        except SystemExit as stop:
            code = stop.code or 0
    told.append((code, out.getvalue(), err.getvalue()))
print(json.dumps(told))
"""
CLUSTER, RIG = "dask, distributed, cryptography", "rtde_receive, rtde_control, serial"
NEEDS = {
    "study convergence --workers 2": ("--workers", CLUSTER, "[cluster]"),
    "study paper --scheduler tcp://127.0.0.1:9": ("--scheduler", CLUSTER, "[cluster]"),
    "check n1_8_0 --rig sim": ("check", RIG, "[rig]"),
    "check n1_8_0 --joints rig.mcap": ("--joints rig.mcap", "rosbags", "[bags]"),
    "check --replay recording-1.rig --bag": ("--bag", "rosbags", "[bags]"),
}
ENOUGH = (
    "verify n1_8_0 --target V_S:0.5 --voxel 0.1",
    "--target V_S:0.5 --sensors 8 --time 1 --voxel 0.1 --out made",
    "report n1_4_0 --target V_S:0.5 --voxel 0.1 --draws 1 --out made",
)


def without_extras(commands, folder):
    """Exit code, stdout and stderr of commands in one process without the extras."""
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT, *commands], cwd=folder, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.slow
def test_a_command_without_its_extra_says_what_to_install(tmp_path):
    told = without_extras([f"{words} --out none" for words in NEEDS], tmp_path)
    for parts, (code, out, err) in zip(NEEDS.values(), told, strict=True):
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert [part for part in parts if part not in err] == [], err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow  # imports all that a report needs
def test_the_core_is_enough(tmp_path):
    told = without_extras(ENOUGH, tmp_path)
    assert [code for code, _, _ in told] == [0] * len(ENOUGH), told
    made = {path.name for path in (tmp_path / "made").iterdir()}
    assert made >= {"proposal.toml", "report.html"}


@pytest.mark.slow
def test_pytest_starts_beside_a_plugin_of_dash_that_warns(tmp_path):
    """As where ``[test,bench]`` is installed: open3d brings dash, whose plugin warns as pytest
    loads it.
    """
    info = tmp_path / "dash-0.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: dash\nVersion: 0.0\n")
    (info / "entry_points.txt").write_text("[pytest11]\ndash = dash_plugin_that_warns\n")
    (tmp_path / "dash_plugin_that_warns.py").write_text("raise DeprecationWarning('old')\n")
    (tmp_path / "test_one.py").write_text("def test_one(): pass\n")
    options = ["-n0", "--noconftest", "-c", str(ROOT / "pyproject.toml"), "test_one.py"]
    done = subprocess.run(
        [sys.executable, "-P", "-m", "pytest", *options],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
