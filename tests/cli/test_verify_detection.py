"""The count of detection as a user runs it."""

import json

import place_rings as pr
import pytest
from place_rings.cli.app import app
from place_rings.coverage.definitions.definition import adapter
from place_rings.objectives.verified import Verified

from ..support.refusals import refused

VERIFY = ("verify", "n1_4_0", "--target", "V_S:0.4", "--voxel", "0.08")


def printed(capsys, *options: str) -> str:
    """What ``verify`` prints with options."""
    app([*VERIFY, *options], result_action="return_value")
    return str(capsys.readouterr().out)


def test_json_reads_back_and_is_what_python_counts(capsys):
    options = ("--sensor", "vl53l5cx", "--detect", "torso:0.3", "--json")
    record = adapter(Verified).validate_python(json.loads(printed(capsys, *options)))
    share = record.detection
    assert share is not None
    assert 0 < share.assumed_low < share.zeta < share.assumed_high < 1
    assert (share.low, share.high, len(share.poses)) == (None, None, 1)
    scene = pr.Scene(targets=[pr.Shell(0.4)], sensor=pr.sensors["vl53l5cx"])
    question = pr.Detection("torso", seconds=0.3)
    counted = pr.verify("n1_4_0", scene, voxel=0.08, detect=question)
    own = counted.each[0].detection
    assert own is not None
    assert (own.question, own.zeta, own.error) == (question, share.zeta, share.error)
    assert "torso" in repr(counted)


def test_a_table_and_the_assumptions_are_printed(capsys):
    text = printed(capsys, "--detect", "0.1x0.4")
    assert "0.1x0.4" in text
    assert "88 %" in text
    interval = printed(capsys, "--detect", "hand", "--rule", "certified")
    assert "80 mm" in interval


@pytest.mark.parametrize(
    ("options", "parts"),
    [
        (("--rule", "touch", "--detect", "hand"), "rule touch detect"),
        (("--sensor", "vl53l5cx", "--ambient", "9e9klx", "--detect", "hand"), "9e9klx"),
        (("--detected-by", "1"), "--detected-by --detect"),
    ],
)
def test_what_cannot_be_counted_is_refused_in_one_line(capsys, options, parts):
    with refused(parts):
        printed(capsys, *options)
