"""Occlusion and obstacles from a scene's file to the counts: what is asked is what is counted, what
is wrong is one line.
"""

import json
import re
from dataclasses import replace

import numpy as np
import place_rings as pr
import pytest
import trimesh
from place_rings.coverage.definitions.errors import UserError
from place_rings.coverage.occlusion.occlusion_mode import OCCLUSIONS
from place_rings.coverage.rings.mounting_errors import Mountings
from place_rings.coverage.rings.ring import Ring, Setup, named_setup
from place_rings.coverage.robots.built_in import ROBOTS, UR10
from place_rings.coverage.targets.named import Shell
from place_rings.formats.loader import read_scene
from place_rings.formats.schema.proposal_models import ProposalFile
from place_rings.formats.schema.versions import RobotFile
from place_rings.formats.writing import to_toml
from place_rings.objectives.feasibility.clearance import MountClearance
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.named_layouts import layout_in
from place_rings.objectives.obstacle import Obstacle
from place_rings.objectives.occlusion import BodilessError, occluders, own_link_fault, unseeing
from place_rings.objectives.redundancy import redundancy
from place_rings.objectives.scene import Scene
from place_rings.objectives.tolerance import tolerance
from place_rings.objectives.verify import Verifier
from place_rings.objectives.verify_breakdown import by_occlusion

from ..support.scene_tables import scene_of_table, scene_table, scene_toml

FLAT = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]
NEAR = Shell(0.5)
TABLE = Obstacle("table", centre=(0.6, 0.0, 0.2), size=(0.8, 1.2, 0.05))


def test_obstacles_are_no_target_and_shadow_under_every_model():
    setup, bare = named_setup("n1_8_0"), Verifier(Scene.paper(), 0.04)
    cell = Verifier(Scene.paper(obstacles=(TABLE,)), 0.04)
    before, after = bare.verify(setup, NEAR), cell.verify(setup, NEAR)
    assert after.target_voxels < before.target_voxels
    assert after.covered_voxels < before.covered_voxels
    each = {model: one.zeta for model, one in by_occlusion(cell, setup, after).items()}
    assert each["ignore"] == after.zeta > each["shadow"] > each["blind"] > 0
    under = {
        m: Verifier(replace(cell.scene, occlusion=m), 0.04).verify(setup, NEAR).zeta for m in each
    }
    assert under == each
    assert by_occlusion(Verifier(Scene.paper(), 0.04, "certified"), setup, before) == {}


def test_returns_is_counted_where_a_one_zone_sensor_reports_several_targets():
    for name in ("vl53l4cx", "vl53l1x", "vl53l5cx"):
        sensor = pr.sensors[name]
        several = len(sensor.separations) > 1 and not sensor.zoned
        assert several == (name == "vl53l4cx")
        verifier, setup = Verifier(Scene(sensor=sensor), 0.08), named_setup("n1_8_0", sensor)
        each = by_occlusion(verifier, setup, verifier.verify(setup, Shell(0.5)))
        assert list(each) == [m for m in OCCLUSIONS if several or m != "returns"]


def test_certified_holds_the_count_under_every_model():
    scene = Scene.paper(obstacles=(TABLE, Obstacle("floor", floor=-0.3)))
    for occlusion in ("shadow", "blind"):
        one = replace(scene, occlusion=occlusion)
        found = Verifier(one, None, "certified", 0.04).verify(named_setup("n1_8_0"), NEAR)
        zeta = Verifier(one, 0.03).verify(named_setup("n1_8_0"), NEAR).zeta
        assert found.low - 2e-3 <= zeta <= found.high + 2e-3
        assert found.high - found.low <= 0.0401


def test_redundancy_and_tolerance_count_past_the_robot():
    verifier = Verifier(Scene(occlusion="shadow"), 0.05)
    setup = named_setup("n1_8_0")
    zeta = verifier.verify(setup, NEAR).zeta
    sure = redundancy(verifier, setup, NEAR, 2)
    astray = tolerance(verifier, setup, NEAR, Mountings(draws=2))
    assert sure.zeta == pytest.approx(zeta, abs=1e-12)
    assert abs(astray.mean() - zeta) < 0.05


def test_sensors_in_housings_and_in_their_own_tube_are_named():
    scene = Scene(occlusion="shadow", rules=Rules(mount="free"))
    setup = named_setup("n2_16_25")
    assert own_link_fault(scene, setup) is None
    found = unseeing(scene, setup)
    assert {u.within for u in found} >= {"shoulder", "elbow"}
    assert unseeing(Scene.paper(), setup) == found
    assert unseeing(scene, Setup((Ring("upper_arm", 0.5, 4),))) == []
    thin = Setup((Ring("upper_arm", 0.5, 4), Ring("forearm", 0.4, 6, radius=0.04)))
    fault = own_link_fault(scene, thin)
    assert re.match(r"ring 1, sensor \d \(forearm\): .*5.0 mm .*forearm", fault)
    blocked = unseeing(scene, thin)
    assert [(u.ring, u.sensor, u.within) for u in blocked] == [(1, k, "forearm") for k in range(6)]
    assert [u.depth for u in blocked] == pytest.approx([0.005] * 6)
    assert Verifier(scene, 0.05).verify(thin, NEAR).zeta == pytest.approx(
        Verifier(scene, 0.05).verify(Setup(thin.rings[:1]), NEAR).zeta, abs=1e-12
    )


@pytest.mark.slow
@pytest.mark.parametrize("robot", sorted(ROBOTS))
@pytest.mark.parametrize("occlusion", ["shadow", "blind"])
def test_a_layout_that_cannot_be_mounted_has_an_answer_and_stated_faults(robot, occlusion):
    """One rule for all robots: sensors in a body, the own link's or another, see nothing."""
    scene = pr.Scene(robot=robot, occlusion=occlusion)
    setup = named_setup("n2_16_55", scene.sensor, scene.default_radius)
    counted = pr.verify(setup, scene, voxel=0.1)
    assert counted.setup == setup
    free = pr.verify(setup, scene.replace(occlusion="ignore"), voxel=0.1)
    assert 0 < counted.coverage < free.coverage
    (record,) = counted.records
    within = {(u.ring, u.within) for u in record.unseeing if u.within}
    assert within
    assert any(f"ring {ring} (" in line for ring, _ in within for line in record.mounting)
    own = own_link_fault(scene, counted.setup)
    if own is not None:
        assert any(own.startswith(f"ring {ring}, ") for ring, _ in within)


@pytest.mark.parametrize("robot", sorted(ROBOTS))
def test_a_layouts_name_puts_real_rings_where_they_can_be_closed(robot):
    scene = pr.Scene(robot=robot, occlusion="shadow")
    counted, rings = pr.verify("n2_16_25", scene, voxel=0.1), named_setup("n2_16_25").rings
    assert [(r.link, r.count, r.tilt) for r in counted.setup.rings] == [
        (r.link, r.count, r.tilt) for r in rings
    ]
    for ring in counted.setup.rings:
        assert ring.radius >= scene.smallest_radius(ring.link)
        low, high = MountClearance(scene).closed(ring)
        assert low > high or low - 1e-9 <= ring.position <= high + 1e-9
    through = pr.verify("n2_16_25", scene.replace(occlusion="ignore"), voxel=0.1)
    assert through.setup == counted.setup  # another model of occlusion moves no ring
    paper = pr.verify("n2_16_25", pr.Scene.paper(robot=robot), voxel=0.1)
    assert paper.setup.rings == rings


def test_a_robot_without_bodies_occludes_nothing_and_says_so(run, tmp_path):
    bare = replace(UR10, bodies=())
    scene = Scene(robot=bare)
    assert (scene.occlusion, scene.real) == ("ignore", False)
    verifier, setup = Verifier(scene, 0.1), named_setup("n1_8_0")
    assert by_occlusion(verifier, setup, verifier.verify(setup, NEAR)) == {}
    counted, paper = (v.verify(setup, NEAR) for v in (verifier, Verifier(Scene.paper(), 0.1)))
    assert counted.covered_voxels == paper.covered_voxels
    with pytest.raises(BodilessError, match=r"robot ur10 .*blind"):
        occluders(scene, UR10.rest, "blind")
    with pytest.raises(pr.InputError, match='occlusion: found "shadow"'):
        pr.Scene(robot=bare, occlusion="shadow")
    (tmp_path / "bare.toml").write_text(to_toml(replace(bare, name="bare"), file=RobotFile))
    (tmp_path / "scene.toml").write_text('robot = "bare.toml"\n')
    words = ("verify", "n1_8_0", "--scene", "scene.toml", "--voxel", 0.1)
    code, out, err = run(*words)
    assert (code, err, "Robot bare" in out) == (0, "", True)
    for key in ('occlusion = "shadow"', 'rules.mount = "real"'):
        (tmp_path / "scene.toml").write_text(f'robot = "bare.toml"\n{key}\n')
        code, out, err = run(*words)
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert "bare" in err


def test_the_papers_world_is_one_option(run, tmp_path):
    """``--paper`` puts the named rings where the paper has them, but moves none of a proposal."""
    words = ("--target", "V_S:0.5", "--voxel", 0.1, "--json")
    code, out, _ = run("verify", "n2_16_25", "--paper", *words)
    counted = Verifier(Scene.paper(), 0.1).verify(named_setup("n2_16_25"), Shell(0.5))
    assert (code, json.loads(out)["covered_voxels"]) == (0, counted.covered_voxels)
    mine = layout_in(Scene(), "n2_16_25")
    (tmp_path / "mine.toml").write_text(to_toml(ProposalFile.of(mine, Scene())))
    for given, says in (
        (("n2_16_25", "--occlusion", "blind"), "--occlusion blind"),
        (("mine.toml",), "proposal"),
    ):
        code, out, err = run("verify", *given, "--paper", *words)
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert all(part in err for part in ("--paper: ", says))
    assert run("cones", "mine.toml", "--paper")[0] == 2
    (tmp_path / "mine.toml").write_text(to_toml(ProposalFile.of(mine, Scene.paper())))
    code, out, _ = run("verify", "mine.toml", "--paper", *words)
    again = Verifier(Scene.paper(), 0.1).verify(mine, Shell(0.5))
    assert (code, json.loads(out)["covered_voxels"]) == (0, again.covered_voxels)


@pytest.mark.parametrize("robot", ["ur10", "ur5e", "panda", "iiwa14"])
def test_rings_that_cannot_be_mounted_are_counted_and_named(robot):
    record = pr.verify("n2_16_25", pr.Scene(robot=robot), voxel=0.1).records[0]
    assert record.unmounted == (0, 1, 2, 3)  # beside the housings
    for ring in record.unmounted:
        assert any(f"ring {ring} (" in line for line in record.mounting)
    assert pr.verify("n2_16_25", pr.Scene.paper(robot=robot), voxel=0.1).records[0].mounting == ()


def test_a_scene_with_a_cell_reads_back(tmp_path):
    parts = [
        trimesh.creation.box((0.2, 0.1, 0.1)),
        trimesh.creation.torus(0.2, 0.05, major_sections=12, minor_sections=8),
    ]
    parts[1].apply_translation((0, 0, 0.5))
    trimesh.util.concatenate(parts).export(tmp_path / "part.stl")
    text = """occlusion = "blind"
[[obstacles]]
name = "table"
centre = [0.5, 0, -0.4]
size = [1, 1, 0.1]
rpy_deg = [0, 0, 30]
[[obstacles]]
floor = -0.8
[[obstacles]]
file = "part.stl"
centre = [0, 1, 0]
"""
    (tmp_path / "scene.toml").write_text(text)
    scene = read_scene(tmp_path / "scene.toml")
    assert scene.occlusion == "blind"
    assert [o.name for o in scene.obstacles] == ["table", "floor", "part part 0", "part part 1"]
    assert [o.hulled for o in scene.obstacles] == [False, False, False, True]
    model = scene_table(scene)
    (tmp_path / "again.toml").write_text(scene_toml(scene))
    again = read_scene(tmp_path / "again.toml")
    points = np.random.default_rng(0).uniform(-1, 1, (500, 3))
    for a, b in zip(scene.obstacles, again.obstacles, strict=True):
        assert np.allclose(a.body(points), b.body(points), atol=1e-6)
    assert scene_table(scene_of_table(model)) == model


def test_parts_of_a_mesh_with_a_long_name_or_moved_from_afar_are_written(tmp_path):
    far = [trimesh.creation.box((0.2, 0.1, 0.1)), trimesh.creation.box((0.1, 0.1, 0.1))]
    for part, x in zip(far, (60, 61), strict=True):
        part.apply_translation((x, 0, 0))
    trimesh.util.concatenate(far).export(tmp_path / "far.stl")
    cell = '[[obstacles]]\nname = "%s"\nfile = "far.stl"\ncentre = [%g, 0, 0]\n'
    path = tmp_path / "scene.toml"
    path.write_text(cell % ("x" * 100, -60))
    scene = read_scene(path)
    assert [o.name for o in scene.obstacles] == ["x" * 93 + f" part {n}" for n in (0, 1)]
    assert len(scene_table(scene)["obstacles"]) == 2
    path.write_text(cell % ("x", 60))
    with pytest.raises(UserError, match=r"obstacles\[0\].file: part 0 .*far.stl.*100 m"):
        read_scene(path)


@pytest.mark.parametrize(
    ("text", "says"),
    {
        "[[obstacles]]\nname = 'x'": "obstacles[0]: found nothing",
        "[[obstacles]]\nfloor = 0\nsize = [1, 1, 1]": 'obstacles[0]: found "size, floor"',
        "[[obstacles]]\nsize = [1, 1, 0]": "obstacles[0].size[2]: found 0",
        "[[obstacles]]\nsize = [1, 1]": "obstacles[0].size: found a list of 2",
        "[[obstacles]]\nfloor = nan": "obstacles[0].floor: found nan",
        f"[[obstacles]]\npoints = {FLAT}": "obstacles[0]: found a list of 4",
        "[[obstacles]]\nfile = '../a.stl'": "obstacles[0].file: found",
        "[[obstacles]]\nfile = 'none.stl'": "obstacles[0].file: none.stl",
        "[[obstacles]]\nfile = 'bad.stl'": "obstacles[0].file: ",
        "[[obstacles]]\nfile = 'scene.toml'": 'obstacles[0].file: found "scene.toml"',
        "ring_radius = 5.0": "ring_radius: found 5.0",
        "[mounts.tool]\nring_radius = 5.0": "mounts.tool.ring_radius: found 5.0",
        "occlusion = 'some'": 'occlusion: found "some"',
    }.items(),
)
def test_a_bad_cell_is_one_line(tmp_path, text, says):
    (tmp_path / "bad.stl").write_bytes(b"solid nothing")
    (tmp_path / "scene.toml").write_text(text)
    with pytest.raises(UserError) as error:
        read_scene(tmp_path / "scene.toml")
    assert f"scene.toml: {says}" in str(error.value)
    assert "\n" not in str(error.value)


def test_verify_prints_all_models_and_json_has_them(run, tmp_path):
    (tmp_path / "free.toml").write_text('[rules]\nmount = "free"\n')
    args = ("verify", "n2_16_25", "--scene", "free.toml", "--target", "V_S:0.5", "--voxel", "0.1")
    code, out, _ = run(*args, "--occlusion", "shadow")
    assert code == 0
    assert all(part in out for part in ("blind", "shoulder"))
    code, out, _ = run(*args, "--occlusion", "shadow", "--json")
    found = json.loads(out)
    assert found["occlusion"] == "shadow"
    each = found["by_occlusion_percent"]
    assert each["ignore"] > each["shadow"] == found["zeta_percent"] > each["blind"]
    assert {u["within"] for u in found["unseeing"]} >= {"shoulder"}
    code, _, err = run(*args, "--occlusion", "magic")
    assert (code, err.count("\n")) == (2, 1)
    assert all(part in err for part in ("--occlusion", "magic"))
