"""Targets of one's own: exact counts against dense ones, volumes against closed forms, and the
interval that holds the truth."""

import copy
import math
from dataclasses import replace

import numpy as np
import place_rings as pr
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from place_rings.coverage.definitions.errors import UserError, schema_of
from place_rings.coverage.rings.ring import named_setup
from place_rings.coverage.robots.built_in import UR10
from place_rings.coverage.robots.kinematics import transform
from place_rings.coverage.soft.sampling import EmptySolidError, sample
from place_rings.coverage.solids.polyhedra import box
from place_rings.coverage.targets.combined import (
    DifferenceOf,
    IntersectionOf,
    TargetInFiles,
    UnionOf,
)
from place_rings.coverage.targets.named import ProtectiveVolume, Shell
from place_rings.coverage.targets.own import Box, Capsule, Cylinder, HalfSpace, Implicit
from place_rings.coverage.targets.solid import target_solid
from place_rings.coverage.targets.target import KINDS
from place_rings.coverage.voxels.certified_bounds import bracket
from place_rings.coverage.voxels.octree import count, voxels
from place_rings.formats.loader import read_scene, read_target
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.obstacle import Obstacle
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import Verifier

from ..strategies.scenes import CELLS, scenes
from ..strategies.volumes import ANYWHERE, BOXES, CAPSULES, CONES, CYLINDERS, OWN_TARGETS, VOLUMES
from ..support.refusals import refused
from ..support.scene_tables import scene_of_table, scene_table, scene_toml
from .test_octree import agree, dense, lattice

NEAR = Shell(0.5)
FINE = 0.1337  # m: no centre of a voxel lies on a surface of whole millimetres
SETUP = named_setup("n2_16_25")
FREE = Scene(occlusion="ignore", rules=Rules(mount="free"))


def own(volume, name="my own"):
    return replace(volume, name=name)


def solid_of(volume):
    return target_solid(own(volume), UR10, Scene.poses[0].q)


def scene_of(*targets, **fields):
    return Scene(
        targets=tuple(t for t in targets),
        occlusion="ignore",
        rules=Rules(mount="free"),
        **fields,
    )


@pytest.mark.parametrize("rule", ["centre", "touch"])
@settings(max_examples=7)
@given(scenes(OWN_TARGETS, CELLS))
def test_count_is_the_dense_count(rule, scene):
    assume((np.ptp(scene.solid.bounds(), axis=0) > 0.1).all())
    agree(scene, scene.cones, rule)


@given(BOXES | CYLINDERS | CONES | CAPSULES)
def test_count_is_the_volume_of_the_closed_form(volume):
    found = voxels(volume.solid(ANYWHERE), 0.02)
    if isinstance(volume, Box):
        a, b, c = volume.size
        surface, inside = 2 * (a * b + b * c + c * a), a * b * c
    elif isinstance(volume, Capsule):
        r, length = volume.radius, math.dist(volume.start, volume.end)
        surface = 2 * math.pi * r * (length + 2 * r)
        inside = math.pi * r**2 * (length + 4 / 3 * r)
    else:
        r, h = volume.radius, volume.height
        t = getattr(volume, "top_radius", r)
        surface = math.pi * (r**2 + t**2 + (r + t) * math.hypot(h, r - t))
        inside = math.pi * (r**2 + r * t + t**2) / 3 * h
    assert abs(found.volume - inside) <= 0.02 * surface
    low, high = volume.solid(ANYWHERE).bounds()
    assert (found.centres() >= low - 1e-9).all()
    assert (found.centres() <= high + 1e-9).all()


def test_a_certified_volume_is_the_closed_form():
    """A box with a round hole, far from the robot: 8 - 2 pi / 4 m^3."""
    hole = Cylinder(0.5, 3.0, (5.0, 0.0, 0.0), (17.0, 0.0, 0.0))
    solid = solid_of(DifferenceOf((Box((2.0, 2.0, 2.0), (5.0, 0.0, 0.0), (17.0, 0.0, 0.0)), hole)))
    b = bracket(solid, Cylinder(0.5, 9.0, (5.0, 0.0, 0.0)).solid(ANYWHERE), 0.002)
    true = 8 - 2 * math.pi / 4
    assert b.volume_low <= true <= b.volume_high
    assert b.volume_high - b.volume_low < 0.05


@settings(max_examples=5)
@given(scenes(OWN_TARGETS))
def test_certified_interval_holds_the_dense_share(scene):
    solid = scene.solid
    low, high = solid.bounds()
    assume((high - low > 0.2).all())
    voxel = ((high - low).prod() / 40_000) ** (1 / 3)
    centres = lattice(low, high, voxel)
    target = dense(solid, centres, voxel, "centre")
    assume(target.sum() > 1000)
    share = (dense(scene.cones, centres, voxel, "centre") & target).sum() / target.sum()
    found = bracket(solid, scene.cones, 0.05)
    surface = 8 * voxel * (high - low).max() ** 2 / (target.sum() * voxel**3)
    assert found.low - surface <= share <= found.high + surface


@settings(max_examples=8)
@given(VOLUMES, VOLUMES)
def test_identities_of_sets(a, b):
    """A less B is A less (A and B); A or B less B is A less B; the parts of A make up A.

    A target with V_N in it excludes the robot's bodies, another V_R; only those of one kind are
    compared."""
    assume(("V_N" in own(a).names) == ("V_N" in own(b).names))
    box_ = Box((2.0, 2.0, 2.0))
    a, b = (IntersectionOf((v, box_)) for v in (a, b))

    def counted(rule, *of):
        return count(solid_of(KINDS[rule](of)), FINE)

    both = IntersectionOf((a, b))
    assert counted("difference", a, b) == counted("difference", a, both)
    either = counted("union", a, b)
    assert either == counted("union", b, a)
    assert abs(either - count(solid_of(b), FINE) - counted("difference", a, b)) <= 2
    assert (
        abs(count(solid_of(a), FINE) - count(solid_of(both), FINE) - counted("difference", a, b))
        <= 2
    )


def test_a_named_volume_in_a_tree_is_the_named_target():
    whole = Verifier(FREE, 0.02).verify(SETUP, Shell(0.5))
    tree = IntersectionOf((NEAR, Box((9.0, 9.0, 9.0))))
    found = Verifier(FREE, 0.02).verify(SETUP, own(tree))
    assert (found.target_voxels, found.zeta) == (whole.target_voxels, whole.zeta)


def test_protective_volume_in_a_tree_leaves_the_robot_out():
    scene = scene_of(ProtectiveVolume())
    tree = UnionOf((ProtectiveVolume(), ProtectiveVolume()))
    whole, found = (Verifier(scene, 0.04).verify(SETUP, t) for t in (ProtectiveVolume(), own(tree)))
    assert (found.target_voxels, found.zeta) == (whole.target_voxels, whole.zeta)


def test_obstacles_bound_a_target():
    wall = Obstacle("wall", box([0.5, 0.0, 0.5], [0.2, 4.0, 4.0]))
    zone = own(Box((1.0, 1.0, 1.0), (0.5, 0.0, 3.0)))
    found = Verifier(scene_of(zone, obstacles=(wall,)), 0.02).verify(SETUP, zone)
    assert found.target_voxels == 50**3
    zone = own(Box((1.0, 1.0, 1.0), (0.5, 0.0, 2.0)))
    found = Verifier(scene_of(zone, obstacles=(wall,)), 0.02).verify(SETUP, zone)
    assert found.target_voxels == 50**3 - 10 * 50 * 50


def test_a_function_counts_as_the_solid_it_describes():
    size, centre = np.array([0.6, 0.8, 1.0]), np.array([0.5, 0.0, 0.4])

    def function(points):
        return (np.abs(points - centre) - size / 2).max(axis=1)

    corners = tuple(centre - size), tuple(centre + size)
    target = own(Implicit(function, corners))
    same = own(Box(tuple(size), tuple(centre)), "box too")
    scene = scene_of(target, same)
    for rule, width in (("centre", 0.0), ("certified", 0.2)):
        found, true = (Verifier(scene, 0.02, rule, width).verify(SETUP, t) for t in (target, same))
        if rule == "centre":
            assert (found.zeta, found.target_voxels) == (true.zeta, true.target_voxels)
        else:
            assert found.low <= true.high
            assert true.low <= found.high
            assert found.high - found.low <= 0.2


@pytest.mark.parametrize(
    ("function", "found"),
    [(lambda p: p, "shape"), (lambda p: np.full(len(p), np.nan), "NaN")],
)
def test_a_function_that_returns_nonsense_is_refused(function, found):
    scene = pr.Scene(targets=pr.Implicit(function, ((0, 0, 0), (1, 1, 1))), occlusion="ignore")
    with pytest.raises(ValueError, match=found):
        pr.verify("n2_16_25", scene, voxel=0.05)


def test_what_is_empty_is_refused():
    apart = IntersectionOf((Box((1.0, 1.0, 1.0)), Box((1.0, 1.0, 1.0), (5.0, 0.0, 0.0))))
    scene = scene_of(own(apart))
    with pytest.raises(ValueError, match="my own"):
        Verifier(scene, 0.05).verify(SETUP, own(apart))
    with pytest.raises(ValueError, match="empty"):
        Verifier(scene, None, "certified", 0.1).verify(SETUP, own(apart))
    with pytest.raises(EmptySolidError):
        sample(scene.solid(own(apart), 0), 10, 0)


@settings(max_examples=8)
@given(st.lists(VOLUMES, min_size=1, max_size=3))
def test_there_and_back_through_files(volumes):
    goals = tuple(
        replace(own(v, f"zone {i}"), weight=1.0 + i, at_least_percent=25)
        for i, v in enumerate(volumes)
    )
    keys = scene_table(Scene(targets=goals))
    back = scene_of_table(keys)
    assert back.targets == goals
    assert scene_table(back) == scene_table(Scene(targets=goals))


def test_there_and_back_through_python():
    each = [
        pr.Box((1, 2, 3), (0.1, 0.2, 0.3), (10, 20, 30), weight=2, name="a"),
        pr.Cylinder(0.5, 1.0, at_least_percent=20, name="b"),
        pr.Sphere(0.5, (1, 0, 0)),
        pr.UnionOf([pr.Box((1, 1, 1)), pr.Shell(0.5), pr.RobotVolume()], name="d"),
        pr.DifferenceOf([pr.ToolSphere(), pr.ReachSphere()]),
        pr.IntersectionOf([pr.ReachSphere(), pr.HalfSpace((0, 0, 1), (0, 0, 0.5))]),
    ]
    scene = pr.Scene(targets=each)
    assert list(scene.targets) == each
    assert copy.deepcopy(scene.targets) == scene.targets
    text = scene_toml(scene)
    assert "[[targets]]" in text


BAD = {
    "name = 'a'": 'name "a" V_O V_P',
    "name = 'V_S'\nvolume = {kind = 'box', size = [1.0, 1.0, 1.0]}": 'name "V_S"',
    "name = 'a=b'\nvolume = {kind = 'box', size = [1.0, 1.0, 1.0]}": 'name "a=b"',
    "name = 'a'\nvolume = {kind = 'box'}": "volume.size",
    "name = 'a'\nvolume = {kind = 'sphere', radius = 1.0, height = 2.0}": "volume",
    "name = 'a'\nvolume = {kind = 'box', size = [1.0, 1.0, 0.0]}": "volume.size[2] 0.0",
    "name = 'a'\nvolume = {kind = 'torus'}": 'volume.kind "torus" box cylinder',
    "name = 'a'\nvolume = {kind = 'half_space', normal = [0.0, 0.0, 1.0]}": "volume",
    "name = 'a'\nvolume = {kind = 'half_space', normal = [0.0, 0.0, 0.0]}": "volume.normal",
    "name = 'a'\nradius = 1.0\nvolume = {kind = 'V_O'}": "radius 1.0",
    "name = 'a'\nvolume = {kind = 'V_O', radius = 1.0}": "volume",
    "name = 'a'\nvolume = {kind = 'union', of = [{kind = 'V_O'}]}": "volume.of 1",
    "name = 'a'\ncolour = 'red'\nvolume = {kind = 'V_O'}": "colour",
}


@pytest.mark.parametrize("text", BAD)
def test_bad_files_are_refused(text, tmp_path):
    file = tmp_path / "target.toml"
    file.write_text(text)
    with refused(f"target.toml {BAD[text]}"):
        read_target(file)


def test_a_scene_names_its_targets_apart(tmp_path):
    file = tmp_path / "scene.toml"
    table = "[[targets]]\nname = 'a'\nvolume = {kind = 'box', size = [1.0, 1.0, %s]}\n"
    file.write_text(table % 1.0 + table % 2.0)
    with refused('scene.toml targets[1].name "a"'):
        read_scene(file)
    file.write_text(table % 1.0 + table % 1.0)
    assert len(read_scene(file).targets) == 2


def test_functions_stay_out_of_files():
    function = pr.Implicit(lambda p: np.linalg.norm(p, axis=1) - 1, ((-1, -1, -1), (1, 1, 1)))
    scene = pr.Scene(targets=pr.UnionOf([function, pr.Shell(0.5)], name="round"))
    with pytest.raises(UserError):
        scene_table(scene)
    assert isinstance(scene.targets[0], pr.UnionOf)


def test_schema_describes_a_target_of_each_kind():
    table = schema_of(TargetInFiles)["properties"]
    (volume,) = (option for option in table["volume"]["anyOf"] if "oneOf" in option)
    kinds = {option["properties"]["kind"]["const"] for option in volume["oneOf"]}
    assert kinds == {*volume["properties"]["kind"]["enum"]} == {*KINDS} - {"implicit"}
    assert not {"weight", "at_least", "name"} & {
        k for o in volume["oneOf"] for k in o["properties"]
    }


def test_a_turned_half_space_cuts_as_its_plane_says():
    above = HalfSpace((0.0, 0.0, -2.0), (5.0, 5.0, 0.7))
    cut = IntersectionOf((Box((1.0, 1.0, 2.0), (4.0, 0.0, 0.0)), above))
    assert count(solid_of(cut), 0.05) == 20 * 20 * 6
    turn = transform(np.zeros(3), np.array([0.4, 0.0, 0.0]))[:3, :3]
    normal = tuple(turn @ [0.0, 0.0, -1.0])
    whole = Box((1.0, 1.0, 2.0), (4.0, 0.0, 0.0), (np.degrees(0.4), 0.0, 0.0))
    cut = IntersectionOf((whole, HalfSpace(normal, (4.0, 0.0, 0.0))))
    assert abs(count(solid_of(cut), 0.02) * 0.02**3 - 1.0) < 0.01
