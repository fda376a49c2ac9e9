"""Swapped ports in a live check: a simulated rig whose two rings are at exchanged ports, through
unmodified ur-rtde and pyserial.
"""

import re
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from place_rings.cli.app import app
from place_rings.coverage.rings.ring import Setup
from place_rings.formats.schema.proposal_models import ProposalFile
from place_rings.formats.writing import to_toml
from place_rings.rig.check.models import CheckResult
from place_rings.rig.simulated.process import SimulatedRig
from place_rings.rig.simulated_cell.cell import simulated_rig

from .cell import SCENE
from .test_ports import ALIKE

pytestmark = pytest.mark.slow  # processes that wait for each other
SERIALS = ("51D0000000000000", "51D0000000000001")  # of the simulated rings' boards


@pytest.mark.parametrize(
    "words",
    [["--part", "self", "--wave"], ["--part", "mount", "--stops", "8"]],
    ids=("hand", "see"),
)
def test_a_simulated_rig_at_exchanged_ports_is_said_with_the_rings_names(
    tmp_path, monkeypatch, words
):
    """By a hand that passes the rings, or by what they see at the stops."""
    pytest.importorskip("rtde_control")
    ports = list[str]()

    def exchanged(rig, number):
        ports.append(str(rig.folder / f"ring{1 - number}"))
        return ports[-1]

    monkeypatch.setattr(SimulatedRig, "ring", exchanged)
    (tmp_path / "two.toml").write_text(to_toml(ProposalFile.of(ALIKE, SCENE)))
    out = tmp_path / "out"
    more = ["--rig", "sim", "--injected", "none", "--seconds", "2", "--voxel", "0.1"]
    with pytest.raises(SystemExit) as end:
        app(
            ["check", str(tmp_path / "two.toml"), *more, *words, "--out", str(out)],
            exit_on_error=False,
            print_error=False,
            result_action="return_value",
        )
    result = CheckResult.model_validate_json((out / "check.json").read_text())
    said = (
        f"ports swapped: {ports[0]}, given for forearm, belongs to tool;"
        f" {ports[1]}, given for tool, belongs to forearm"
    )
    assert (result.verdict, result.reasons[0]) == ("differs", said)
    assert all("no way that keeps its distances" in other for other in result.reasons[1:])
    assert end.value.code == 1
    assert [line.serial for line in result.lines] == [*SERIALS[::-1]]


def test_a_check_refuses_exchanged_ports_of_known_boards_and_runs_as_it_said(tmp_path):
    """At an address, as on a real rig; the options of its refusal are then right."""
    pytest.importorskip("rtde_control")
    rings = (replace(r, serial=s) for r, s in zip(ALIKE.rings, SERIALS, strict=True))
    setup = Setup(tuple(rings))
    (tmp_path / "two.toml").write_text(to_toml(ProposalFile.of(setup, SCENE)))
    with simulated_rig(SCENE, setup, 0, tmp_path, "none") as rig:

        def run(*ports):
            words = ["check", "two.toml", "--robot-host", rig.address, *ports]
            more = ["--part", "self", "--seconds", "1", "--voxel", "0.1"]
            return subprocess.run(
                [sys.executable, "-m", "place_rings.cli.entry", *words, *more],
                capture_output=True,
                text=True,
                cwd=tmp_path,
            )

        one, other = rig.ring(1), rig.ring(0)
        refused = run("--ring", f"forearm={one}", "--ring", f"tool={other}")
        assert refused.returncode == 2
        assert f"ports swapped: {one}, given for forearm, belongs to tool" in refused.stderr
        options = re.search(r"; give (--ring .*)", refused.stderr)[1].split()
        done = run(*options)
        np.testing.assert_allclose(rig.do("state")["q"], SCENE.poses[0].q)
    result = CheckResult.model_validate_json(
        (tmp_path / "place-rings-check" / "check.json").read_text()
    )
    assert done.returncode in (0, 3), done.stderr  # a busy machine may end a real rig's link
    assert not any("swapped" in reason for reason in result.reasons)
