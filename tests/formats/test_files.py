"""Files: what is written reads back, what is wrong is one line, what is killed leaves the old
file.
"""

import copy
import math
from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import place_rings as pr
import pytest
import tomli_w
from hypothesis import given
from place_rings.coverage.definitions.definition import adapter
from place_rings.coverage.definitions.errors import UserError
from place_rings.coverage.definitions.units import OF_SCENE
from place_rings.coverage.rings.ring import Ring, Setup, named_setup
from place_rings.coverage.rings.rounding import rounded, table_of, with_scene
from place_rings.coverage.sensors.effective_range import Use
from place_rings.coverage.sensors.sensor import Sensor, effective
from place_rings.formats import writing
from place_rings.formats.loader import how_found, read_proposal, read_scene, resolve
from place_rings.formats.writing import write_text
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.named_layouts import layout_in
from place_rings.objectives.scene import Scene
from place_rings.studies.engine.scenes import keys_of, scene_from

from ..support import drawing
from ..support.refusals import refused
from ..support.scene_tables import scene_table, scene_toml

RING = "[[rings]]\nlink = 'tool'\ncount = 8\n"
POSE = "[[poses]]\nq_deg = [0, 0, 0, 0, 0, 0]"
BAD_SCENES = {
    "version = 3": "version 3 1 2",
    "version = 3\nrobot = 'absent.toml'\nnew = 1": "version 3 1 2",
    "version = 0": "version 0 1 2",
    "version = '1'": 'version "1" 1 2',
    "version = true": "version true 1 2",
    "[sensor]\nversion = 1": "sensor.version",
    "robto = 'ur10'": "robto",
    "robot = 'ur11'": 'robot "ur11" ur10, ur10_dh',
    "robot = 10": "robot 10",
    "ring_radius = nan": "ring_radius nan",
    "ring_radius = inf": "ring_radius inf",
    "ring_radius = -0.1": "ring_radius -0.1",
    "ring_radius = '8 cm'": 'ring_radius "8 cm"',
    "ring_radius = true": "ring_radius true",
    "occlusion = 'magic'": 'occlusion "magic"',
    "poses = []": "poses 0",
    "[[poses]]\nq_deg = [0, 1]": "poses[0].q_deg 2 6",
    "[[poses]]\nq_deg = [0, 0, 0, 0, 0, nan]": "poses[0].q_deg[5] nan",
    "[[poses]]\nweight = 2": "poses[0].q_deg nothing",
    POSE + "\nweight = 0": "poses[0].weight 0",
    POSE + "\nrate_deg_s = [1]": "poses[0].rate_deg_s 1 6",
    "[[targets]]\nname = 'V_X'": 'targets[0].name "V_X" V_O, V_T, V_OT, V_S, V_N, V_P',
    "[[targets]]\nname = 'V_S'": "targets[0].radius nothing",
    "[[targets]]\nname = 'V_N'": "targets[0].radius nothing",
    "[[targets]]\nname = 'V_S'\nradius = -1": "targets[0].radius -1",
    "[[targets]]\nname = 'V_S'\nradius = 0.15": "targets[0].radius 0.15 0.15",
    "[[targets]]\nname = 'V_O'\nradius = 0.5": "targets[0].radius 0.5",
    "[sensor]\nfov_deg = 180": "sensor.fov_deg 180",
    "[sensor]\nrange = 1.5": "sensor.range range_m",
    "[sensor]\nmodel = 'vl53l9'": 'sensor.model "vl53l9" vl53l0x',
    "[sensor]\nmodel = 'vl53l1x'\nambient = '9klx'": "sensor '9klx' vl53l1x dark kcps",
    "[sensor]\nmodel = 'vl53l1x'\nrange_m = 3.9": "sensor.range_m 3.9",
    "[sensor]\nambient = 'dark'": "sensor.model",
    "[safety]\nreaction = 0.1": "safety.reaction",
    "[safety]\nhuman_speed = 0": "safety.human_speed 0",
    "[curve]\nblend = 0": "curve.blend 0",
    "[curve]\npoints_per_bend = 2.5": "curve.points_per_bend 2.5",
    "[mounts.tail]": "mounts.tail",
    "[mounts.tool]\ntilt_deg = [5, -5]": "mounts.tool.tilt_deg",
    "[mounts.tool]\nposition = [0, 1.5]": "mounts.tool.position[1] 1.5",
    "a = [": "TOML",
    "ring_radius = " + "9" * 6000: "TOML",
}
BAD_PROPOSALS = {
    "version = 99\nnew = 1": "version 99 1 2",
    "version = 1\n" + RING + "[scene]\nversion = 1": "scene.version",
    "": "rings nothing",
    "[[rings]]\nlink = 'tail'\ncount = 8": 'rings[0].link "tail" ur10',
    "[[rings]]\nlink = 'tool'\ncount = 0": "rings[0].count 0 1 1000",
    "[[rings]]\nlink = 'tool'\ncount = -3": "rings[0].count -3",
    "[[rings]]\nlink = 'tool'": "rings[0].count",
    RING + "tilt_deg = 90": "rings[0].tilt_deg 90",
    RING + "tilt = 1": "rings[0].tilt",
    RING + "position = 1.1": "rings[0].position 1.1",
    RING + "[scene]\nrobot = 'x'": 'scene.robot "x"',
}


@pytest.mark.parametrize(("text", "parts"), BAD_SCENES.items())
def test_a_bad_scene_is_one_line(tmp_path, text, parts):
    (tmp_path / "scene.toml").write_text(text)
    with refused(f"scene.toml {parts}"):
        read_scene(tmp_path / "scene.toml")


@pytest.mark.parametrize(("text", "parts"), BAD_PROPOSALS.items())
def test_a_bad_proposal_is_one_line(tmp_path, text, parts):
    (tmp_path / "mine.toml").write_text(text)
    with refused(f"mine.toml {parts}"):
        read_proposal(tmp_path / "mine.toml")


def test_what_is_no_file_is_one_line(tmp_path):
    (tmp_path / "latin.toml").write_bytes(b"robot = '\xff'")
    (tmp_path / "large.toml").write_bytes(b"#" * (17 * 2**20))
    (tmp_path / "deep.toml").write_text("a = " + "[" * 100_000)
    for name in ("absent.toml", ".", "latin.toml", "large.toml", "deep.toml", "a\0b"):
        with pytest.raises(UserError):
            read_scene(tmp_path / name)


def test_the_empty_scene_is_the_reference_scene(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text("")
    assert scene_table(read_scene(path)) == scene_table(Scene())
    assert scene_table(Scene()) == scene_table(Scene())


def test_a_write_that_fails_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "proposal.toml"
    write_text(path, "old")

    def full(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(writing.os, "fsync", full)
    with refused("proposal.toml"):
        write_text(path, "new")
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["proposal.toml"]


@pytest.mark.parametrize("tilt", [89.99996, -89.99996])
def test_a_tilt_just_short_of_90_degrees_stays_so(tilt):
    sensor = Scene.paper().sensor
    once = rounded(Setup((Ring("tool", 0.0, 8, math.radians(tilt), math.radians(400)),)), sensor)
    assert math.degrees(once.rings[0].tilt) == pytest.approx(math.copysign(89.9999, tilt), abs=1e-9)
    assert once == rounded(once, sensor)


def test_a_rewritten_file_keeps_its_mode_and_its_link(tmp_path):
    real, link = tmp_path / "real.toml", tmp_path / "link.toml"
    write_text(real, "old")
    real.chmod(0o600)
    link.symlink_to(real)
    write_text(link, "new \udcff")
    assert link.is_symlink()
    assert real.read_text() == "new ?"
    assert real.stat().st_mode & 0o777 == 0o600


def test_a_name_keeps_the_limits_of_a_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "n2_16_25").mkdir()
    assert resolve("n2_16_25", None)[0] == layout_in(Scene(), "n2_16_25")
    for name, key in (("n2_16_90", "rings[0].tilt_deg"), ("n2_5000_25", "rings[0].count")):
        with refused(f"{name} {key}"):
            resolve(name, None)


def test_names_and_files_resolve(tmp_path):
    setup, scene = resolve("n2_16_25", None)
    assert setup == layout_in(Scene(), "n2_16_25")
    assert resolve("n2_16_25", Scene.paper())[0] == named_setup("n2_16_25")
    assert scene_table(scene) == scene_table(Scene())
    path = tmp_path / "mine.toml"
    path.write_text(RING)
    assert resolve(str(path), None)[0].sensors == 8
    path.write_text(RING + "[scene]\nring_radius = 0.2\n[scene.sensor]\nrange_m = 1.1\n")
    ring = resolve(str(path), None)[0].rings[0]
    assert (ring.radius, ring.sensor.range_m) == (0.2, 1.1)
    for name in ("n9_1_1", "nothing", "../nothing.toml"):
        with refused(name):
            resolve(name, None)


@given(drawing.seeds)
def test_rounded_rings_are_those_that_a_file_gives_back(seed):
    scene, rng = Scene.paper(), np.random.default_rng(seed)
    sensors = (
        scene.sensor,
        Sensor(0.4321, 1.2345),
        Sensor(0.5, 1.0, None, 0.61, 4),
        effective(Use("vl53l5cx", "5klx")).sensor,
    )
    rings = tuple(
        Ring(
            "forearm_link",
            float(rng.uniform()),
            int(rng.integers(1, 9)),
            float(rng.choice([rng.uniform(-1.5, 1.5), math.nextafter(math.pi / 2, 0)])),
            float(rng.normal(scale=5)),
            float(rng.uniform(0.05, 0.2)),
            sensors[rng.integers(len(sensors))],
        )
        for _ in range(5)
    )
    read = adapter(Setup).validate_python(table_of(Setup(rings), scene.sensor))
    assert rounded(Setup(rings), scene.sensor) == with_scene(read, scene.sensor)


def test_what_a_file_leaves_to_its_scene_is_no_default_of_python():
    ring, other = Ring("forearm", 0.5, 3), Sensor(math.radians(30), 1.0)
    rules = Rules(fixed=(ring, replace(ring, sensor=other)))
    scene = Scene(sensor=other, ring_radius=0.1, rules=rules)
    assert scene_from(keys_of(scene)).rules.fixed == scene.rules.fixed
    read = adapter(Setup).validate_python({"rings": [{"link": "forearm", "count": 3}]})
    assert copy.deepcopy(read).rings[0].sensor is OF_SCENE
    wanted = Ring("forearm", 0.0, 3, radius=0.1, sensor=other)
    assert with_scene(read, other, 0.1).rings == (wanted,)


def test_the_former_name_of_the_largest_number_of_rings_on_a_link_is_read(tmp_path):
    path = tmp_path / "scene.toml"
    for key in ("rings_per_link", "max_rings_per_link"):
        path.write_text(f"[rules]\n{key} = 5\n")
        former = pytest.warns(DeprecationWarning, match="max_") if key[0] == "r" else nullcontext()
        with former:
            assert read_scene(path).rules.max_rings_per_link == 5
    text = scene_toml(read_scene(path))
    assert "max_rings_per_link = 5" in text
    path.write_text("[rules]\nrings_per_link = 5\nmax_rings_per_link = 4\n")
    with refused("scene.toml rules.rings_per_link"):
        read_scene(path)


NAMES = ("a", "b", "a.b", "one.csv", "x.toml:y", "a:b", "d/e", "[0]", "", 'q"q', "rings", "version")


def test_a_file_of_several_proposals_gives_the_one_that_is_named(tmp_path):
    """As every command takes it: FILE.toml:NAME."""
    path = tmp_path / "setups.TOML"
    ring = {"link": "forearm", "position": 0.5}
    tables = {name: {"rings": [ring | {"count": 4 + i}]} for i, name in enumerate(NAMES)}
    path.write_text(tomli_w.dumps(tables))
    for i, name in enumerate(NAMES):
        setup, scene = resolve(f"{path}:{name}", None)
        assert [r.count for r in setup.rings] == [4 + i]
        assert scene.robot.name == Scene().robot.name
        assert how_found(f"{path}:{name}") is None
        assert pr.load(f"{path}:{name}").setup == setup
    for read in (lambda name: resolve(name, None), pr.load):
        with refused(f'{path.name} "c" "a" "b"', error=Exception):
            read(f"{path}:c")
        with refused(f"{path.name} {len(NAMES)} setups.TOML:NAME", error=Exception):
            read(str(path))
    (tmp_path / "one.toml").write_text(RING + "[scene]\nring_radius = 0.2\n")
    for name in ("scene", "rings"):
        with refused(f'one.toml "{name}" one.toml'):
            resolve(f"{tmp_path / 'one.toml'}:{name}", None)
