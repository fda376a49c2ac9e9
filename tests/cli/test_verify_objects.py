"""The largest unseen objects as a user asks for them."""

import csv
import json

import place_rings as pr
import pytest
from place_rings.cli.app import app
from place_rings.coverage.definitions.definition import adapter
from place_rings.formats.schema.proposal_models import SearchFile
from place_rings.objectives.verified import Verified

from ..support.refusals import refused

VERIFY = ("verify", "n1_4_0", "--voxel", "0.05")
SCENE = """[[targets]]
name = "box"
volume = {{kind = "box", centre = [0.6, 0.0, 0.4], size = [0.1, 0.1, 0.1]}}
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
        assert objects.sphere.low <= objects.sphere.high
        assert (verdict == "pass") == (objects.sphere.high <= gap / 1000)
        assert 0 <= objects.rod.low <= objects.rod.high


@pytest.mark.parametrize("gap", [0, -5, 1000, "nan", '"wide"'])
def test_a_gap_that_is_no_length_is_refused(capsys, tmp_path, gap):
    path = tmp_path / "cell.toml"
    path.write_text(SCENE.format(gap))
    with refused("cell.toml targets[0].largest_gap_mm"):
        verified(capsys, "--scene", str(path))


def test_a_rod_length_out_of_range_is_refused(capsys):
    with refused("rod_length 9"):
        verified(capsys, "--smallest-object", "--rod-length", "9")


def test_a_rod_without_objects_is_refused(capsys):
    with refused("rod_length smallest_object"):
        verified(capsys, "--rod-length", "0.5")


@pytest.mark.slow
def test_a_search_says_whether_its_answer_keeps_the_largest_gap(tmp_path):
    scene, out = tmp_path / "cell.toml", tmp_path / "out"
    near = '[[targets]]\nname = "V_N"\nradius = 0.05\nlargest_gap_mm = {}\n'
    for gap, verdict in ((100, "pass"), (5, "fail")):
        scene.write_text(near.format(gap))
        limits = ("--sensors", "4", "--time", "1", "--voxel", "0.05", "--out", str(out))
        app(["--scene", str(scene), *limits], result_action="return_value")
        record = SearchFile.model_validate_json((out / "result.json").read_text())
        (target,) = record.proposal.zeta
        assert target.smallest_object.verdict == verdict


@pytest.mark.slow
def test_a_report_lists_the_diameters_at_places_of_its_target(tmp_path):
    scene = pr.Scene(targets=[pr.Near(0.05, largest_gap=0.09)])
    page = pr.report("n1_4_0", scene, folder=tmp_path, voxel=0.05, draws=2)
    assert "violated" in page.read_text()
    with (tmp_path / "smallest_object.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) > 100
    for row in rows:
        for shape in ("sphere", "rod"):
            assert 0 <= float(row[f"{shape}_low_mm"]) <= float(row[f"{shape}_high_mm"])
        assert float(row["sphere_high_mm"]) <= 100
    pr.report("n1_4_0", pr.Scene(targets=[pr.Near(0.05)]), folder=tmp_path, voxel=0.05, draws=2)
    assert not (tmp_path / "smallest_object.csv").exists()
