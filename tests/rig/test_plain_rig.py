"""A check that moves a controller and rings which share no code with the package: plain_rig.py."""

import os
import re
import subprocess
import sys
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from place_rings.objectives.motion_limits import Motion

from .cell import SCENE, SETUP
from .commands import proposed, result_of
from .moving import LIMITS, TRIES

TURNED = (-0.7, 0, 0, 0, 0, 0)  # rad, from the scene's pose to a second one


@contextmanager
def plain_rig(folder):
    """The controller's address; the rings are links in ``folder``."""
    address = f"127.88.{os.getpid() >> 8 & 255}.{os.getpid() & 255 or 1}"
    joints = ",".join(map(str, SCENE.poses[0].q))
    counts = ",".join(str(r.count) for r in SETUP.rings)
    words = [Path(__file__).with_name("plain_rig.py"), address, folder, counts, joints]
    path = {"PYTHONPATH": str(Path(__file__).parent)}  # of the arm, also where paths are safe
    with subprocess.Popen(
        [sys.executable, *words], stdout=subprocess.PIPE, text=True, env=os.environ | path
    ) as rig:
        assert rig.stdout.readline() == "open\n"
        try:
            yield address
        finally:
            rig.kill()


def checked(folder, out):
    """The exit code and the result of a check that answers every question."""
    with plain_rig(folder) as address:
        rings = [f"--ring={ring.link}={folder / f'ring{i}'}" for i, ring in enumerate(SETUP.rings)]
        numbers = ["--part", "self", "--part", "coverage", "--seconds", "1", "--trials", "4"]
        done = subprocess.run(
            [
                *(sys.executable, "-m", "place_rings.cli.entry"),
                *("check", folder / "moving.toml", "--robot-host", address, *rings, "--move"),
                *("--allow-differing-self-check", *numbers, "--voxel", "0.1", "--out", out),
            ],
            input="yes\n" + "\n" * 50,
            capture_output=True,
            text=True,
            timeout=300,
        )
    assert "Traceback" not in done.stderr
    return done, result_of(out)


@pytest.mark.slow
def test_a_check_of_an_independent_controller_moves_and_ends_by_itself(tmp_path):
    """Its distances are made up, so that they differ from the proposal; all else must hold."""
    pytest.importorskip("rtde_control")
    (pose,) = SCENE.poses
    poses = (pose, replace(pose, q=np.add(pose.q, TURNED)))
    motion = Motion(np.radians(15), np.radians(30), cell_complete=True, rings_as_proposed=True)
    proposed(tmp_path, SETUP, replace(SCENE, motion=motion, poses=poses), "moving.toml")
    for attempt in range(TRIES):
        done, result = checked(tmp_path, tmp_path / str(attempt))
        if not re.search(LIMITS, " ".join(result.reasons)):  # a busy machine
            break
    assert done.returncode in (1, 3), done.stderr
    assert not any("ended early" in reason for reason in result.reasons), result.reasons
    assert [c.trials == c.planned for c in result.coverage] == [True]
    assert result.robot.ended is None
    assert [(line.lost, line.corrupt, line.restarts) for line in result.lines] == [(0, 0, 0)] * 2
    assert result.self_check is not None
