"""Printed rings: closed forms, files that are closed, boards that fit and one more that does not,
lenses in place.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from manifold3d import Manifold
from place_rings.coverage.electronics.electronics import Electronics
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.robots.built_in import ROBOTS
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.ring_section import axes_of
from place_rings.coverage.sensors.board_packing import (
    Pocket,
    Printing,
    best_pocket,
    most_boards,
    roomy_radius,
    tilt_range,
)
from place_rings.coverage.sensors.boards import VL53L4CD, VL53L5CX, Board
from place_rings.coverage.sensors.catalogue import MODELS
from place_rings.coverage.sensors.effective_range import Use
from place_rings.coverage.sensors.sensor import Sensor, effective
from place_rings.formats.loader import read_scene
from place_rings.formats.printing.blocks import thread
from place_rings.formats.printing.primitives import FACETS, union
from place_rings.formats.printing.print_checks import least_wall, overhang, read_stl, stl
from place_rings.formats.printing.print_files import print_ring, ring_files
from place_rings.formats.printing.print_plan import UnbuildableError, plan_ring
from place_rings.formats.printing.ring_solids import assemble, collar, envelope_solid
from place_rings.objectives.feasibility.ring_envelopes import envelope
from place_rings.objectives.feasibility.violations import mount_faults
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.named_layouts import ring_layout
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.placement.space.design import Space
from place_rings.placement.space.feasible_set import InfeasibleError
from place_rings.placement.space.starts import fresh
from place_rings.reporting.ring_pictures import ring_pictures

from ..support import drawing
from ..support.refusals import has_parts, refused
from ..support.scene_tables import reread, scene_toml

OWN = Electronics(bus="own")
BOARDED = ("vl53l0x", "vl53l1x", "vl53l4cd", "vl53l5cx")


def sensor_of(model: str) -> Sensor:
    """A sensor of the catalogue with its nominal range."""
    return effective(Use(model)).sensor


L4CD = sensor_of("vl53l4cd")
TIGHT = Printing(wall=0.0008, least_wall=0.0002, clearance=0.0, relief=0.0, gap=0.0)


def drawn_ring(rng: np.random.Generator, robot: str, sensor: Sensor = L4CD) -> tuple[Scene, Ring]:
    """A ring anywhere that can be built, with as many sensors as fit or fewer."""
    scene = Scene(
        robot=ROBOTS[robot], poses=(Pose(ROBOTS[robot].rest),), occlusion="shadow", sensor=sensor
    )
    link, tilt = str(rng.choice(scene.robot.links)), float(rng.uniform(-1.2, 1.2))
    ring = Ring(
        link, float(rng.uniform()), 1, tilt, float(rng.uniform(0, 6)), scene.radius_of(link), sensor
    )
    return scene, replace(ring, count=int(rng.integers(1, 6)))


def test_the_plain_clamp_has_the_volume_of_its_formula():
    plan = plan_ring(Scene.paper(), Ring("forearm", 0.5, 4, 0.3, 0.0, 0.08, L4CD))
    area = FACETS / 2 * math.sin(2 * math.pi / FACETS) * (plan.collar**2 - plan.bore**2)
    assert collar(plan).volume() == pytest.approx(area * (plan.lug[1] - plan.low), rel=1e-6)


def pocket_solid(pocket: Pocket, radius: float, tilt: float, angle: float) -> Manifold:
    """The room of a board at an angle about the ring's axis, mm."""
    low = np.array([-pocket.half, pocket.low, -pocket.deep]) * 1000
    size = np.array([2 * pocket.half, pocket.high - pocket.low, pocket.deep]) * 1000
    room = Manifold.cube(tuple(size)).translate(tuple(low))
    # x along the ring, y up, z ahead; before it is turned: ahead along x
    c, s = math.cos(tilt), math.sin(tilt)
    lean = np.array([[0, -s, c, 1000 * radius], [1, 0, 0, 0], [0, c, s, 0]])
    return room.transform(lean).rotate((0, 0, math.degrees(angle)))


@given(
    st.floats(0.03, 0.15),
    st.floats(-1.3, 1.3),
    st.floats(0.008, 0.04),
    st.floats(0.008, 0.04),
    st.floats(0.0008, 0.003),
)
def test_boards_of_the_largest_count_are_disjoint_and_of_one_more_are_not(
    radius, tilt, width, height, wall
):
    board, printing = Board(width, height, 0.0016), replace(TIGHT, wall=wall)
    most = int(most_boards(board, printing, radius, np.array([tilt]))[0])
    if most < 2:
        return
    for board_of in (board, board.turned):
        pocket = best_pocket(board_of, printing, radius, tilt)
        for count in (most, most + 1):
            one, next_ = (
                pocket_solid(pocket, radius, abs(tilt), k * 2 * math.pi / count) for k in (0, 1)
            )
            apart = one.min_gap(next_, 50.0)
            if count == most:
                assert apart >= 1000 * wall - 1e-4
            else:
                assert apart < 1000 * wall + 1e-4


@given(drawing.seeds)
def test_fewer_boards_fit_where_there_is_less_room(seed):
    rng = np.random.default_rng(seed)
    board, printing, radius = VL53L5CX, Printing(), float(rng.uniform(0.04, 0.15))
    tilt = np.linspace(-1.4, 1.4, 41)
    most = most_boards(board, printing, radius, tilt)
    assert np.all(most_boards(board, printing, radius + 0.01, tilt) >= most)
    assert np.all(most_boards(board, replace(printing, wall=0.004), radius, tilt) <= most)
    assert np.all(most_boards(board, printing, radius, tilt, inside=0.05) <= most)
    for count in (1, 3, 6, 9, 12, 20):
        span = tilt_range(board, printing, radius, count)
        if span is not None:
            assert np.all(most_boards(board, printing, radius, np.linspace(*span, 31)) >= count)
    roomy = roomy_radius(board, printing, 0.05, (-1.2, 1.2))
    assert np.all(
        most_boards(board, printing, roomy + 1e-6, tilt[np.abs(tilt) <= 1.2], inside=0.0535) >= 1
    )


@given(drawing.seeds, st.sampled_from(["ur10", "panda", "iiwa14"]))
def test_a_lens_looks_where_its_sensor_looks(seed, name):
    rng = np.random.default_rng(seed)
    scene, ring = drawn_ring(rng, name)
    q = drawing.pose(rng, len(scene.robot.chain))
    plan, mount = plan_ring(scene, ring), scene.robot.mount(ring.link)
    seen = sensor_cones(scene.robot, Setup((ring,)), q)
    T = forward(scene.robot.chain, q)[mount.frame]
    axis, zero, side = axes_of(mount)
    R_link_print = np.stack([zero, side, axis], axis=1) @ plan.T_ring_print
    np.testing.assert_allclose(R_link_print.T @ R_link_print, np.eye(3), atol=1e-12)
    assert np.linalg.det(R_link_print) > 0  # printed as it is, not as its mirror image
    for k in range(ring.count):
        frame = plan.frame(k)
        lens = mount.start + ring.position * mount.length * axis + R_link_print @ frame[:, 3] / 1000
        np.testing.assert_allclose(T[:3, :3] @ lens + T[:3, 3], seen.apex[k], atol=1e-9)
        np.testing.assert_allclose(T[:3, :3] @ R_link_print @ frame[:, 2], seen.axis[k], atol=1e-9)


@pytest.mark.parametrize("name", ["ur10", "panda", "iiwa14"])
def test_a_drawn_ring_is_closed_and_keeps_all_checks(name):
    scene, ring = drawn_ring(np.random.default_rng(len(name)), name)
    record, files, plan, _ = print_ring(scene, 0, ring)
    for data in files:
        mesh = read_stl(data)
        assert mesh.is_watertight
        assert mesh.is_winding_consistent
        assert mesh.volume > 0
        assert mesh.bounds[0, 2] == pytest.approx(0, abs=1e-5)  # on the bed
    assert all(check.holds for check in record.checks), (ring, record.checks)
    assert record.flipped == (ring.tilt < 0)
    assert plan.tilt == pytest.approx(abs(ring.tilt))


# Rings of a search whose links stand beside where the ring parts: the band alone was 0.3 mm and
# less at its ends, and in the last of them a window left 0.5 mm of what carries a bolt's ear.
@pytest.mark.parametrize(
    ("count", "tilt_deg", "phase_deg"),
    [(6, 63.163, 22.8933), (4, 44.9135, 71.6007), (24, 31.175334044213997, 10.83020960215625)],
)
def test_a_ring_keeps_all_checks_and_goes_around_its_link(count, tilt_deg, phase_deg):
    scene, turned = Scene(occlusion="blind", sensor=L4CD), (tilt_deg, phase_deg)
    ring = Ring("upper_arm", 0.2, count, *map(math.radians, turned), 0.113, L4CD)
    record, _, _, made = print_ring(scene, 0, ring)
    assert min(least_wall(half, seed) for half in made.parts for seed in range(4)) >= 1.2
    assert all(check.holds for check in record.checks)
    for half, way in zip(made.parts, (1, -1), strict=True):  # laid on from its side
        for d in (0, 5, 20, 60, 120):
            assert (half.translate((0, way * d, 0)) ^ made.link).volume() < 0.01


def iiwa_ring(link: str, at: float, count: int, degrees: tuple[float, float], radius: float):
    """A scene and a ring by its tilt and phase, degrees."""
    robot = ROBOTS["iiwa14"]
    scene = Scene(robot=robot, poses=(Pose(robot.rest),), occlusion="shadow", sensor=L4CD)
    return scene, Ring(link, at, count, *map(math.radians, degrees), radius, L4CD)


def test_no_thin_ledge_is_left_where_an_ear_leaves_the_collar():
    """Facets of the collar lie within its radius: an ear's foot that ended at the radius left 0.5
    mm below the cables.
    """
    turned = (31.42932851904606, 18.958014003393565)
    made = assemble(plan_ring(*iiwa_ring("forearm", 0.188, 4, turned, 0.08)))
    assert min(least_wall(half, seed) for half in made.parts for seed in range(8)) >= 1.2


def test_a_steep_board_leaves_the_ears_of_the_bolts_their_walls():
    scene, ring = iiwa_ring("upper_arm", 0.5, 15, (67.254, 20.074), 0.131)
    made = assemble(plan_ring(scene, ring))
    # 0.35 mm beside a bolt's hole
    assert min(least_wall(half, seed) for half in made.parts for seed in range(2)) >= 1.2
    near, far = (plan_ring(scene, replace(ring, radius=r)).lug[0] for r in (0.15, 0.16))
    assert near == far


@pytest.mark.parametrize("model", ["vl53l1x", "vl53l5cx"])
@pytest.mark.parametrize("tilt_deg", [0, 20, 45, 70, 80])
def test_threads_of_screws_end_within_the_ring(model, tilt_deg):
    """A steep board's screws go down, and were bored through the bottom or to less than a
    millimetre above it.
    """
    ring = Ring("forearm", 0.5, 6, math.radians(tilt_deg), 0.0, 0.12, sensor_of(model))
    plan = plan_ring(Scene.paper(), ring)
    radius = 0.4 * 1000 * plan.pocket.board.hole
    for x, y in plan.pocket.board.holes:
        deep = thread(plan, 1000 * (y - plan.pocket.board.lens[1]))
        end = plan.frame(0) @ (1000 * x, 1000 * y, -plan.seat - deep, 1)
        assert 3 < deep <= 8
        assert end[2] - radius * math.cos(plan.tilt) >= plan.low + 1.5 - 1e-6
    if tilt_deg == 80:
        made = assemble(plan)
        assert min(least_wall(half) for half in made.parts) >= 1.2


def test_a_full_ring_keeps_all_checks_and_one_board_more_is_refused_with_the_count():
    scene, ring = Scene.paper(), Ring("forearm", 0.5, 9, 0.4, 0.1, 0.064, sensor_of("vl53l5cx"))
    with refused("20", error=UnbuildableError) as full:
        plan_ring(scene, replace(ring, count=20))
    most = max(n for n in range(1, 20) if has_parts(str(full.value), f"most {n}"))
    record, *_ = print_ring(scene, 0, replace(ring, count=most))
    assert all(check.holds for check in record.checks)
    with refused(f"{most}", error=UnbuildableError):
        plan_ring(scene, replace(ring, count=most + 1))


@pytest.mark.parametrize("plugs", [(0.004, 0.0), (0.0, 0.004), (0.009, 0.0001)])
def test_plugs_of_a_board_narrower_than_they_are_stay_in_the_envelope(plugs):
    """The room of a plug was 6 mm wide along any edge, so a search's ring could not be printed."""
    board = Board(0.0264, 0.0037, 0.001, (-0.008, -0.0016), 0.0014, plugs=plugs, plug_height=0.006)
    sensor = replace(L4CD, board=board)
    scene = Scene(occlusion="shadow", sensor=sensor)
    for tilt_deg in (0, -40, 73):
        radius = scene.radius_of("upper_arm") + 0.005
        ring = Ring("upper_arm", 0.5, 4, math.radians(tilt_deg), 0.3, radius, sensor)
        plan = plan_ring(scene, ring)
        outside = union(assemble(plan).plugs) - envelope_solid(plan, envelope(scene, ring))
        assert outside.volume() < 0.01


@pytest.mark.parametrize(
    "ring",
    [
        Ring("forearm", 0.5, 4),  # no board is known
        Ring("forearm", 0.5, 4, radius=0.05, sensor=L4CD),
        Ring("forearm", 0.5, 30, radius=0.08, sensor=L4CD),
    ],
)
def test_what_cannot_be_printed_is_refused(ring):
    with refused("ring 0 (forearm)"):
        ring_files(Setup((ring,)), Scene.paper(), ring_pictures)


def test_a_check_can_fail():
    wide = replace(L4CD, fov=math.radians(172))
    scene, ring = Scene.paper(), Ring("forearm", 0.5, 2, 1.2, 0.0, 0.07, wide)
    with refused("beams", error=UnbuildableError):
        print_ring(scene, 0, ring)
    with refused("overhang", error=UnbuildableError):
        print_ring(scene, 0, replace(ring, sensor=L4CD), Printing(overhang=0.0))


def test_overhang_and_least_wall_of_a_table():
    table = Manifold.cube((20, 20, 2)).translate((0, 0, 10)) + Manifold.cube((5, 5, 11))
    mesh = read_stl(stl(table))
    assert overhang(mesh) == pytest.approx((400 - 25) / mesh.area, rel=1e-6)
    assert least_wall(table) == pytest.approx(2, abs=1e-3)


def test_files_and_pictures_of_a_proposal():
    """With a link whose name is a formula, and without lids."""
    ur10 = ROBOTS["ur10"]
    mounts = (replace(m, link=r"$\frac$") if m.link == "tool" else m for m in ur10.mounts)
    ring = Ring(r"$\frac$", 0.0, 3, -0.3, 0.0, 0.07, L4CD)
    scene = Scene.paper(robot=replace(ur10, mounts=tuple(mounts)))
    result, data = ring_files(Setup((ring,)), scene, ring_pictures)
    files = ["ring0___frac__a.stl", "ring0___frac__b.stl", "ring0___frac_.png"]
    assert data.keys() == {*files, "mounted.png", "plate0.3mf", "printing.json"}
    assert result.rings[0].flipped
    assert result.rings[0].lids is None
    assert data["printing.json"].decode() == result.model_dump_json(indent=2) + "\n"
    assert b"lid" not in data["printing.json"]


@pytest.mark.parametrize(("seed", "sensors"), [(0, 12), (1, 40)])
def test_a_search_proposes_only_rings_whose_boards_fit(seed, sensors):
    rng, sensor = np.random.default_rng(seed), sensor_of("vl53l5cx")
    scene = Scene(sensor=sensor, ring_radius=0.085, electronics=OWN)
    space = Space(scene, sensors=sensors)
    c = fresh(space, rng)
    for _ in range(5):
        for ring in space.setup(c).rings:
            tilt = np.array([ring.tilt])
            assert ring.count <= most_boards(VL53L5CX, scene.printing, ring.radius, tilt)[0]
        assert not mount_faults(scene, space.setup(c))
        c = fresh(space, rng)


def test_a_layout_of_too_many_boards_is_refused_in_the_search_and_named_by_verify():
    scene = Scene(sensor=sensor_of("vl53l5cx"), electronics=OWN)
    with refused("20 forearm 15", error=InfeasibleError):
        Space(scene, ring_layout(scene, 2, 20))
    tool = Setup((Ring("tool", 0.0, 20, sensor=scene.sensor),))
    assert mount_faults(scene, tool)
    with refused("16 15", error=InfeasibleError):  # rings, each of at most 15 boards
        Space(scene, sensors=2000)
    free = replace(scene, rules=Rules(mount="free"))  # no bodies, so no boards
    assert Space(free, ring_layout(free, 2, 20)).sensors == 100
    assert not mount_faults(free, tool)


def test_a_real_ring_is_wide_enough_for_its_boards_at_every_tilt():
    scene = Scene(sensor=L4CD, occlusion="shadow")
    assert scene.smallest_radius("upper_arm") > scene.least_radius("upper_arm")
    ring = Ring("upper_arm", 0.5, 4, math.radians(70), 0.0, scene.radius_of("upper_arm"), L4CD)
    pocket, inner = plan_ring(scene, ring).pocket, plan_ring(scene, ring).inner
    assert 1000 * pocket.innermost(ring.radius, np.array([ring.tilt]))[0] >= inner - 1e-6


def test_boards_and_printing_in_a_scenes_file(tmp_path):
    own = Board(0.02, 0.03, 0.001, (0.002, -0.001), 0.002, ((0.008, 0.012),), 0.002, source="mine")
    scene = Scene.paper(
        sensor=Sensor(board=own), printing=Printing(wall=0.004, bolt="M4", nut="through")
    )
    path = tmp_path / "scene.toml"
    path.write_text(scene_toml(scene))
    again = read_scene(path)
    assert (again.sensor, again.printing) == (scene.sensor, scene.printing)
    named = reread(Scene.paper(sensor=L4CD))
    assert named.sensor.board == VL53L4CD == MODELS["vl53l4cd"].board
    holes = "width = 0.02\nheight = 0.02\nholes = [[0.01, 0]]"
    for text, parts in (
        ("[printing]\nwall = 0.002", "printing.wall 0.002 0.0024"),
        ('[printing]\nbolt = "M2"', 'printing.bolt "M2"'),
        (f"[sensor.board]\n{holes}", "sensor.board.holes[0]"),  # the hole is cut by the edge
    ):
        path.write_text(text)
        with refused(f"scene.toml {parts}"):
            read_scene(path)
