"""A user's own sensor: its file has the catalogue's fields, and it counts as the catalogue does."""

import json
from dataclasses import replace

import place_rings as pr
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.cli.runs.sensors import sensors as listing
from place_rings.cli.runs.sensors import uses_of
from place_rings.coverage.definitions.definition import adapter
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.sensors.catalogue import MODELS, model
from place_rings.coverage.sensors.effective_range import Use
from place_rings.coverage.sensors.sensor import Sensor, effective
from place_rings.coverage.sensors.sensor_model import DARK, Model, Price, Range, Supply
from place_rings.formats.loader import read_proposal, read_scene
from place_rings.formats.model_reader import read_sensor
from place_rings.formats.schema.versions import SensorFile
from place_rings.formats.writing import to_toml
from place_rings.objectives.scene import Scene
from place_rings.reporting.setup_report.bill_of_materials import materials
from pydantic import ValidationError

from ..support.refusals import refused

MINE = """
name = "mine"
fov_deg = 40.0
fov_up_deg = 30.0
zones = 8
zones_up = 4
rate_hz = 20.0
source = "our laboratory"
supply = { power_w = 0.3, source = "our laboratory" }

[[ranges]]
range_m = 2.0

[[ranges]]
ambient = "5klx"
range_m = 1.0
"""


@pytest.fixture
def mine(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(MINE)
    return path


def own_models():
    """Models as a file may state them; ranges fall with light and with the target's darkness."""
    lights = st.sampled_from([(DARK,), (DARK, "5klx"), ("a", "b")])
    share = st.floats(0.3, 1.0)

    def model_of(lights, first, falls, square, zones, least):
        ranges = tuple(
            Range(
                ambient=light,
                reflectance=reflectance,
                range_m=round(first * falls[0] ** i * falls[1] ** (j + i), 6),
            )
            for i, light in enumerate(lights)
            for j, reflectance in enumerate((0.8, 0.2))
        )
        shape = {"fov_deg": 40.0} if square is None else square
        return Model(
            name="own",
            title="Own",
            ranges=ranges,
            source="drawn",
            **shape,
            zones=1 if square is None else zones,
            least_m=least,
            supply=Supply(power_w=0.5, limit=True, source="drawn"),
            price=Price(5.0, "EUR", "2026-11-22", "a shop"),
        )

    squares = st.sampled_from(
        [None, {"fov_deg": 45.0, "fov_up_deg": 20.0}, {"diagonal_deg": 65.0, "corners": "sines"}]
    )
    return st.builds(
        model_of,
        lights,
        st.floats(0.1, 50.0),
        st.tuples(share, share),
        squares,
        st.integers(1, 8),
        st.none() | st.floats(0.001, 0.01),
    )


def as_file(own: Model, folder):
    path = folder / "own.toml"
    path.write_text(to_toml(own, file=SensorFile))
    return path


@pytest.mark.parametrize("name", MODELS)
def test_a_file_states_all_that_the_catalogue_does(name, tmp_path):
    own = replace(model(name), name="own")
    assert read_sensor(as_file(own, tmp_path)) == own


@given(own_models())
def test_a_model_reads_back_from_its_table(own):
    for value in (own, effective(Use(own)).sensor):
        of = adapter(type(value))
        for mode in ("python", "json"):
            assert of.validate_python(of.dump_python(value, mode=mode)) == value


@given(own_models(), st.floats(0.05, 1.0), st.floats(0.1, 1.0), st.booleans())
def test_rules_only_take_away_from_an_own_sensor(own, reflectance, darker, small):
    size = (0.1, 0.2) if small else None
    for light in own.levels:
        use = replace(Use(own), ambient=light, reflectance=reflectance, target_size=size)
        found = effective(use)
        ranges = [step.range_m for step in found.steps]
        assert ranges == sorted(ranges, reverse=True)
        less = effective(replace(use, reflectance=reflectance * darker))
        assert less.range_m <= found.range_m * (1 + 1e-12)


def test_the_same_sensor_by_file_scene_and_python_scores_the_same(mine, tmp_path, run):
    beam = {"fov_deg": 40.0, "fov_up_deg": 30.0, "zones": 8}
    own = read_sensor(mine)
    used = effective(replace(Use(own), ambient="5klx")).sensor
    scene_file = tmp_path / "scene.toml"
    scene_file.write_text("[sensor]\nmodel = 'mine.toml'\nambient = '5klx'\n")
    by_scene = read_scene(scene_file)
    loaded = pr.load(mine)
    assert loaded == effective(Use(own)).sensor
    assert by_scene.sensor == used == pr.sensors.under(loaded, ambient="5klx")
    nominal = adapter(Sensor).validate_python({**beam, "range_m": used.range_m})
    by_beam = pr.verify("n1_8_0", pr.Scene(sensor=nominal), voxel=0.1)
    assert by_beam.coverage == pr.verify("n1_8_0", pr.Scene(sensor=used), voxel=0.1).coverage
    command = ["verify", "n1_8_0", "--voxel", "0.1", "--target", "V_S", "--radius", "0.5", "--json"]
    for given_as in (["--sensor", mine, "--ambient", "5klx"], ["--scene", scene_file]):
        result = json.loads(run(*command, *given_as)[1])
        record = result[0] if isinstance(result, list) else result
        assert record["zeta_percent"] == pytest.approx(100 * by_beam.coverage)
        assert record["sensors"][0]["model"] == "mine"


def test_a_proposal_keeps_the_sensor_whole(mine, tmp_path):
    sensor = pr.sensors.under(pr.load(mine), ambient="5klx", reflectance=0.5)
    setup = Setup((Ring("forearm", 0.5, 6, sensor=sensor), Ring("upper_arm", 0.5, 4)))
    pr.save(pr.verify(setup, pr.Scene(sensor=sensor), voxel=0.2), tmp_path / "proposal.toml")
    mine.unlink()  # the proposal does not need the file
    again, scene, _ = read_proposal(tmp_path / "proposal.toml")
    assert scene.sensor == sensor
    assert [ring.sensor.use for ring in again.rings] == [sensor.use, None]


def test_a_ring_and_a_mount_name_a_file(mine, tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(
        "[mounts.forearm.sensor]\nmodel = 'mine.toml'\n"
        "[[fixed]]\nlink = 'tool'\ncount = 3\nsensor = { model = 'mine.toml' }\n"
    )
    scene = read_scene(path)
    assert scene.limits_of("forearm").sensor == pr.load(mine) == scene.rules.fixed[0].sensor


def test_the_bill_of_an_own_sensor(mine):
    setup = Setup((Ring("forearm", 0.5, 5, sensor=pr.load(mine)),))
    said = "\n".join(materials(Scene.paper(), setup))
    assert "| 5 | mine |" in said
    assert "1.50 W" in said
    assert f"{5 * 32 * 20:,} distances" in said


def test_the_listing_of_a_file_and_of_the_catalogue(mine, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    listing(uses_of(str(mine)), True, False)
    (record,) = json.loads(capsys.readouterr().out)
    assert (record["model"], record["zones"], record["fov_up_deg"]) == ("mine", [8, 4], 30.0)
    listing(uses_of(None), False, True)
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    assert all(any(name in line for line in lines) for name in MODELS)


WRONG = {
    'name = "mine"': {
        'name = "vl53l1x"': 'name "vl53l1x"',
        'name = "My Sensor"': 'name "My Sensor"',
        "": "name",
    },
    "fov_deg = 40.0": {"fov_deg = 0.0": "fov_deg 0.0", "": "fov_deg nothing"},
    "fov_up_deg = 30.0": {
        "": "zones 8 1",
        "diagonal_deg = 60.0": "fov_up_deg nothing",
        "fov_up_deg = 40.0\ndiagonal_deg = 65.0": "diagonal_deg 65.0",
        "fov_up_deg = 30.0\nfov_side_deg = 3.0": "fov_side_deg",
    },
    "range_m = 1.0": {
        "range_m = 3.0": "ranges[1].range_m 3.0 2",
        "range_m = 1.0\n[[ranges]]\nambient = '50kcps'\nrange_m = 0.5": "ranges",
        "range_m = 1.0\n[[ranges]]\nambient = '5klx'\nrange_m = 1.0": "ranges[2]",
    },
    '"5klx"': {"5": "ranges[1].ambient 5", '"0klx"': "ranges[1].ambient"},
    "rate_hz = 20.0": {"rate_hz = -1.0": "rate_hz -1.0", "least_m = 2.0": "least_m"},
    'source = "our laboratory"': {"": "source"},
}


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [(old, new, parts) for old, news in WRONG.items() for new, parts in news.items()],
)
def test_a_wrong_file_is_one_clear_line(old, new, parts, mine, tmp_path):
    mine.write_text(MINE.replace(old, new, 1))
    scene = tmp_path / "scene.toml"
    scene.write_text("sensor = { model = 'mine.toml' }\n")
    for read in (lambda: read_sensor(mine), lambda: read_scene(scene)):
        with refused(f"mine.toml {parts}"):
            read()
    with refused(parts, error=pr.InputError):
        pr.load(mine)


@pytest.mark.parametrize("name", ["missing.toml", "../mine.toml", "/mine.toml"])
def test_a_scene_names_a_file_beside_it(name, tmp_path):
    scene = tmp_path / "scene.toml"
    scene.write_text(f"[sensor]\nmodel = '{name}'\n")
    with refused("scene.toml sensor.model") as told:
        read_scene(scene)
    assert name in str(told.value)


def test_conditions_without_a_figure_are_refused(mine):
    with refused("9klx", error=pr.InputError):
        pr.sensors.under(pr.load(mine), ambient="9klx")
    with refused("", error=pr.InputError):
        pr.sensors.under(pr.Sensor())
    with pytest.raises(ValidationError, match="range_m"):
        adapter(Sensor).validate_python({"model": read_sensor(mine), "range_m": 1.9})
