"""The largest unseen objects as a user asks for them."""

import json

import pytest
from place_rings.cli.app import app
from place_rings.coverage.definitions.definition import adapter
from place_rings.objectives.verified import Verified

from ..support.refusals import refused

VERIFY = ("verify", "n1_4_0", "--voxel", "0.05")
SCENE = """[[targets]]
name = "box"
volume = {{kind = "box", centre = [0.6, 0.0, 0.4], size = [0.2, 0.2, 0.2]}}
largest_gap_mm = {}
"""


def verified(capsys, *options):
    """The record that ``verify --json`` prints, read back."""
    app([*VERIFY, *options, "--json"], result_action="return_value")
    return adapter(Verified).validate_python(json.loads(capsys.readouterr().out))


def test_a_target_states_the_largest_gap_and_has_its_verdict(capsys, tmp_path):
    path = tmp_path / "cell.toml"
    for gap, verdict in ((400, "pass"), (20, "fail")):
        path.write_text(SCENE.format(gap))
        objects = verified(capsys, "--scene", str(path)).smallest_object
        assert objects is not None
        assert objects.verdict == verdict
        assert objects.sphere.low <= objects.sphere.high <= 0.2 + 1e-9
        assert 0 <= objects.rod.low <= objects.rod.high


@pytest.mark.parametrize("gap", [0, -5, "nan", '"wide"'])
def test_a_gap_that_is_no_length_is_refused(capsys, tmp_path, gap):
    path = tmp_path / "cell.toml"
    path.write_text(SCENE.format(gap))
    with refused("cell.toml targets[0].largest_gap_mm"):
        verified(capsys, "--scene", str(path))


def test_a_rod_length_out_of_range_is_refused(capsys):
    with refused("rod_length 9"):
        verified(capsys, "--smallest-object", "--rod-length", "9")
