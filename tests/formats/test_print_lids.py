"""Lids of printed rings, judged from the written files: they overlap nothing, and leave the beams
free.
"""

import math
import re
import tomllib
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from manifold3d import Manifold, OpType
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.robots.built_in import ROBOTS
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.sensors.board_packing import Printing, best_pocket, most_boards
from place_rings.coverage.sensors.boards import VL53L4CD, VL53L5CX, Board
from place_rings.coverage.sensors.lids import lid_fault
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.formats.loader import read_scene
from place_rings.formats.printing.lids import flat_lid, lid_solid, mounted_lids, screw_heads
from place_rings.formats.printing.mounted_boards import beam
from place_rings.formats.printing.payload import ring_parts
from place_rings.formats.printing.primitives import union
from place_rings.formats.printing.print_checks import least_wall, read_stl, stl
from place_rings.formats.printing.print_files import board_screws, print_ring, ring_files
from place_rings.formats.printing.print_plan import plan_ring
from place_rings.formats.printing.ring_solids import assemble
from place_rings.objectives.feasibility.board_fit import most_sensors
from place_rings.objectives.feasibility.ring_envelopes import envelope
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.reporting.setup_report.bill_of_materials import printed_parts

from ..support import drawing
from ..support.assembly import judge, part
from ..support.refusals import refused
from ..support.scene_tables import scene_of_table, scene_toml
from .test_assembly import drawn_proposal, holds
from .test_printing import BOARDED, sensor_of

COVERED = Printing(cover=True)


def covered_ring(seed: int) -> tuple[Scene, Ring]:
    """A ring with lids of any built-in board on any link, with up to six sensors if they fit."""
    rng = np.random.default_rng(seed)
    robot, sensor = ROBOTS[str(rng.choice(list(ROBOTS)))], sensor_of(str(rng.choice(BOARDED)))
    printing = replace(COVERED, bolt=str(rng.choice(["M3", "M4", "M5"])))
    scene = Scene(
        robot=robot, poses=(Pose(robot.rest),), occlusion="shadow", sensor=sensor, printing=printing
    )
    link, more = str(rng.choice(robot.links)), float(rng.choice([0.0, 0.01, 0.04]))
    tilt, phase = float(rng.uniform(-1.2, 1.2)), float(rng.uniform(0, 6))
    ring = Ring(link, 0.5, 1, tilt, phase, scene.radius_of(link) + more, sensor)
    most = min(most_sensors(scene, ring), 6)
    return scene, replace(ring, count=int(rng.integers(1, most + 1)))


def placed_lids(record, data: bytes) -> list[Manifold]:
    """The lids of a written ring in its link's frame, mm."""
    solid, closed = part(data)
    assert closed
    places = [np.array(T) for T in record.lids.T_link_print]
    for T in places:
        T[:3, 3] *= 1000
        np.testing.assert_allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), atol=1e-8)
        assert np.linalg.det(T[:3, :3]) > 0  # printed as it is, not as its mirror image
    return [solid.transform(T[:3]) for T in places]


def sensor_frames(scene: Scene, ring: Ring) -> list[np.ndarray]:
    """The pose (4, 4) mm of each lens in its link's frame, by the ring's kinematics: x along the
    ring, y up the board as it is printed, z along the beam."""
    T = np.linalg.inv(
        forward(scene.robot.chain, scene.poses[0].q)[scene.robot.mount(ring.link).frame]
    )
    seen = sensor_cones(scene.robot, Setup((ring,)), scene.poses[0].q)
    mount, frames = scene.robot.mount(ring.link), []
    for apex, axis in zip(seen.apex, seen.axis, strict=True):
        z = T[:3, :3] @ axis
        up = mount.axis if ring.tilt >= 0 else -mount.axis
        y = up - (up @ z) * z
        frame = np.eye(4)
        frame[:3, 1], frame[:3, 2] = y / np.linalg.norm(y), z
        frame[:3, 0] = np.cross(frame[:3, 1], z)
        frame[:3, 3] = 1000 * (T[:3, :3] @ apex + T[:3, 3])
        frames.append(frame)
    return frames


def board_box(board: Board, frame: np.ndarray) -> Manifold:
    """A board's outline with the whole room of its plugs on it and beyond its edges, mm."""
    (x, y), w, h = 1000 * np.array(board.lens), 1000 * board.width, 1000 * board.height
    front, thick = -1000 * board.lens_height, 1000 * board.thickness
    solid = Manifold.cube((w, h, thick)).translate((-w / 2 - x, -h / 2 - y, front - thick))
    side, up = 1000 * np.array(board.plugs)
    high = 1000 * board.plug_height
    across, upright = min(6.0, w), min(6.0, h)
    for wide, tall in ((w + 2 * side, upright), (across, h + 2 * up)):
        if (wide > w) or (tall > h):
            plug = Manifold.cube((wide, tall, high))
            solid += plug.translate((-wide / 2 - x, -tall / 2 - y, front))
    return solid.transform(frame[:3])


@pytest.mark.parametrize("seed", range(4))
def test_lids_overlap_nothing_leave_the_beams_free_and_lie_in_the_envelope(seed):
    """Measured from the written files. Rays start anywhere on a sensor's package, and run anywhere
    within its beam."""
    scene, ring = covered_ring(seed)
    record, files, plan, made = print_ring(scene, 0, ring)
    lids, frames = placed_lids(record, files[-1]), sensor_frames(scene, ring)
    overlap_nothing(scene, record, files, plan, lids, frames)
    # a lid comes off along its beam, and the heads of its screws with it
    ring_solid = Manifold.batch_boolean([*made.parts, made.bolts], OpType.Add)
    ahead = plan.frame(0)[:, 2]
    for far in (0.5, 2.0, 4.0, 6.0):
        moved = made.lids[0] + made.heads[0]
        assert (moved.translate(tuple(far * ahead)) ^ ring_solid).volume() < 0.01
    leave_beams_free(ring.sensor, lids, frames, np.random.default_rng(seed))
    lie_in_envelope(scene, ring, lids)


def overlap_nothing(scene, record, files, plan, lids, frames) -> None:
    """Neither ring, nor boards, nor each other."""
    assert len(lids) == record.lids.copies == len(frames)
    whole = Manifold.batch_boolean(lids, OpType.Add)
    assert whole.volume() == pytest.approx(len(lids) * part(files[-1])[0].volume(), rel=1e-5)
    for data, T in zip(files[:-1], record.T_link_print.values(), strict=True):
        there = np.array(T)
        there[:3, 3] *= 1000
        assert (part(data)[0].transform(there[:3]) ^ whole).volume() < 0.05
    for lid, frame in zip(lids, frames, strict=True):
        assert (board_box(plan.pocket.board, frame) ^ lid).volume() < 0.05
    if len(lids) > 1:
        assert lids[0].min_gap(lids[1], 5.0) >= 1000 * scene.printing.clearance - 1e-3


def leave_beams_free(sensor: Sensor, lids, frames, rng) -> None:
    meshes = [lid.to_mesh() for lid in lids]
    mesh = trimesh.util.concatenate(
        [trimesh.Trimesh(m.vert_properties[:, :3], m.tri_verts) for m in meshes]
    )
    for frame in frames[:2]:
        starts = rng.uniform(-1, 1, (1000, 3)) * (3.2, 3.2, 0)
        wide = math.tan(sensor.half_angle)
        if sensor.square:
            high = math.tan(sensor.half_angle_up)
            ways = rng.uniform(-1, 1, (1000, 2)) * (wide, high)
        else:
            turn, out = rng.uniform(0, 2 * math.pi, 1000), wide * np.sqrt(rng.uniform(0, 1, 1000))
            ways = np.stack([out * np.cos(turn), out * np.sin(turn)], axis=1)
        ways = np.column_stack([ways, np.ones(1000)])
        starts = starts @ frame[:3, :3].T + frame[:3, 3]
        assert not mesh.ray.intersects_any(starts, ways @ frame[:3, :3].T).any()
        # a ray beside the window does meet the lid
        beside = frame[:3, :3] @ (0.0, 6.4, 0.0) + frame[:3, 3]
        assert mesh.ray.intersects_any([beside], [frame[:3, 2]]).all()


def lie_in_envelope(scene: Scene, ring: Ring, lids) -> None:
    mount, around = scene.robot.mount(ring.link), envelope(scene, ring)
    T_ring_link = np.linalg.inv(mount.T_link_ring(ring.position))
    for lid in lids:
        points = lid.to_mesh().vert_properties[:, :3] / 1000
        inside = points @ T_ring_link[:3, :3].T + T_ring_link[:3, 3]
        assert np.all(around(inside[:, [2, 0, 1]]) <= 1e-6)
    plain = envelope(replace(scene, printing=replace(scene.printing, cover=False)), ring)
    assert plain.low >= around.low - 1e-12
    assert plain.high <= around.high + 1e-12
    assert plain.outer <= around.outer + 1e-12


@pytest.mark.slow
def test_rings_with_lids_that_a_search_draws_overlap_nothing_on_the_robot():
    rng = np.random.default_rng(3)
    draws = (drawn_proposal(rng, "panda", cover=True, most=6) for _ in range(50))
    scene, setup = next(drawn for drawn in draws if drawn and len(drawn[1].rings) > 1)
    _, data = ring_files(setup, scene, lambda *_: {})
    verdict = judge(scene, setup, data, points=1000, near=10.0)
    assert verdict.parts >= 2 * len(setup.rings) + setup.sensors
    assert verdict.beams >= 0.5
    holds(scene, verdict)


@given(
    st.floats(0.03, 0.15),
    st.floats(-1.3, 1.3),
    st.floats(0.012, 0.04),
    st.floats(0.012, 0.04),
    st.floats(0.0005, 0.003),
)
def test_lids_of_the_largest_count_keep_their_clearance(radius, tilt, width, height, clearance):
    board = Board(width, height, 0.0016, holes=((0.0, 0.0),))
    printing = Printing(wall=0.0024, gap=0.0, relief=0.0, clearance=clearance, cover=True)
    most = int(most_boards(board, printing, radius, np.array([tilt]))[0])
    assert most <= most_boards(board, replace(printing, cover=False), radius, np.array([tilt]))[0]
    assume(most > 1)
    lid = best_pocket(board, printing, radius, tilt).lid
    low = 1000 * np.array([lid.outline[0], lid.outline[2], lid.back])
    high = 1000 * np.array([lid.outline[1], lid.outline[3], lid.front])
    c, s = math.cos(abs(tilt)), math.sin(abs(tilt))
    lean = np.array([[0, -s, c, 1000 * radius], [1, 0, 0, 0], [0, c, s, 0]])
    one = Manifold.cube(tuple(high - low)).translate(tuple(low)).transform(lean)
    for board_of in (board, board.turned):
        assert best_pocket(board_of, printing, radius, tilt).lid is not None
    apart = one.min_gap(one.rotate((0, 0, 360 / most)), 50.0)
    assert apart >= 1000 * clearance - 1e-3


@pytest.mark.parametrize("model", BOARDED)
def test_a_screw_passes_lid_and_board_and_bites_in_the_ring(model):
    sensor = sensor_of(model)
    scene = Scene(occlusion="shadow", sensor=sensor, printing=COVERED)
    ring = Ring("forearm", 0.5, 2, 0.5, 0.1, scene.radius_of("forearm"), sensor)
    record, _, plan, made = print_ring(scene, 0, ring)
    size, longest = map(float, re.search(r"M([\d.]+)\D+([\d.]+) mm", record.screws).groups())
    frame, lid = plan.frame(1), plan.pocket.lid
    for x, y in lid.spots:
        at = (1000 * x, 1000 * y, 1000 * lid.front - longest + 0.06)
        pin = Manifold.cylinder(longest, size / 2, -1.0, 16).translate(at).transform(frame)
        bored = Manifold.cylinder(longest, 0.39 * 1000 * lid.board.hole, -1.0, 16)
        assert (pin ^ made.lids[1]).volume() < 0.01
        assert (bored.translate(at).transform(frame) ^ made.parts[0]).volume() < 0.01
        assert (bored.translate(at).transform(frame) ^ made.parts[1]).volume() < 0.01
    number, _ = board_screws(plan_ring(replace(scene, printing=Printing()), ring))
    assert record.screws.startswith(f"{number} × M{size:g}")


def test_a_lid_clears_the_plugs_and_rests_on_its_board():
    sensor = sensor_of("vl53l5cx")
    scene = Scene(occlusion="shadow", sensor=sensor, printing=COVERED)
    plan = plan_ring(scene, Ring("forearm", 0.5, 3, 0.0, 0.0, 0.09, sensor))
    lid, board = lid_solid(plan), plan.pocket.board
    front = -1000 * board.lens_height
    on_board = lid.slice(front + 0.05).area() - lid.slice(front - 0.05).area()
    ring = math.pi * 1000**2 * (plan.pocket.lid.boss**2 - plan.pocket.lid.hole**2)
    assert on_board > 3 * ring  # four bosses, of which a part is also rim
    tallest = front + 1000 * board.plug_height
    under = Manifold.cube((0.5, 0.5, 1.0)).translate((8.0, 3.0, tallest))
    assert (under.translate((0, 0, -0.71)) ^ lid).volume() == 0
    assert (under.translate((0, 0, 0.31)) ^ lid).volume() == pytest.approx(0.25)


def test_lids_add_to_mass_and_filament():
    sensor = sensor_of("vl53l4cd")
    scene = Scene(occlusion="shadow", sensor=sensor, printing=COVERED)
    ring = Ring("forearm", 0.5, 2, -0.4, 0.0, scene.radius_of("forearm"), sensor)
    plan = plan_ring(scene, ring)
    volume = sum(lid.volume() for lid in mounted_lids(plan))  # mm³
    assert volume == pytest.approx(2 * lid_solid(plan).volume())
    whole = sum(one.volume() for one in print_ring(scene, 0, ring)[3].parts) + volume
    assert ring_parts(scene, ring)["plastic"].mass == pytest.approx(1270e-9 * whole, rel=1e-4)
    bought = printed_parts(scene, Setup((ring,)))
    assert bought.grams == pytest.approx(1.27e-3 * whole, rel=1e-4)
    assert (bought.rings, bought.lids) == (1, 2)
    assert any("lid" in text for text in bought.hardware)


def test_cover_in_a_scenes_file(tmp_path):
    path = tmp_path / "scene.toml"
    scene = Scene(sensor=sensor_of("vl53l5cx"), printing=COVERED)
    path.write_text(scene_toml(scene))
    assert read_scene(path).printing == COVERED
    board = "[sensor.board]\nwidth = 0.02\nheight = 0.02\n"
    for text in (
        board,  # no holes for screws: it is glued
        f"{board}holes = [[0.0, 0.008]]\nplugs = [0.0, 0.005]",  # plugs where its screws would be
        f"[sensor]\nfov_deg = 120\n{board}holes = [[0.0, 0.008]]",  # no room for the window
    ):
        path.write_text(f"[printing]\ncover = true\n{text}")
        with refused("scene.toml printing.cover true"):
            read_scene(path)
        path.write_text(text)
        assert not read_scene(path).printing.cover


def test_a_glued_board_has_no_lid_and_its_ring_is_refused_in_one_line():
    sensor = replace(sensor_of("vl53l4cd"), board=replace(VL53L4CD, holes=()))
    scene = Scene(occlusion="shadow", printing=COVERED)
    radius = scene.replace(sensor=sensor, printing=None).radius_of("forearm")
    ring = Ring("forearm", 0.5, 3, 0.2, 0.0, radius, sensor)
    with refused("ring 0 (forearm)"):
        ring_files(Setup((ring,)), scene, lambda *_: {})


def drawn_board(rng: np.random.Generator) -> Board:
    """A board with one to four holes near its edges, its lens anywhere near the middle."""
    (w, h), hole = rng.uniform(0.012, 0.04, 2), float(rng.choice([0.0017, 0.0025, 0.0033]))
    inset = hole / 2 + rng.uniform(0.0002, 0.003)
    x, y = float(w / 2 - inset), float(h / 2 - inset)
    spots = [[(x, y), (-x, y), (x, -y), (-x, -y)], [(x, y), (-x, -y)], [(0.0, -y)], [(x, 0.0)]]
    return Board(
        float(w),
        float(h),
        float(rng.choice([0.001, 0.0016])),
        (float(rng.uniform(-0.1, 0.1) * w), float(rng.uniform(-0.1, 0.1) * h)),
        float(rng.uniform(0, 0.003)),
        tuple(spots[rng.integers(4)]),
        hole,
        plugs=[(0.0, 0.0), (0.007, 0.0), (0.0, 0.0001), (0.006, 0.006)][rng.integers(4)],
        plug_height=float(rng.uniform(0, 0.006)),
    )


@given(drawing.seeds, st.sampled_from([0.0, 0.0003, 0.001]))
@settings(max_examples=6)
def test_the_lid_of_any_board_that_allows_one_keeps_its_walls(seed, clearance):
    rng = np.random.default_rng(seed)
    sensor = replace(sensor_of(str(rng.choice(BOARDED))), board=drawn_board(rng))
    assume(lid_fault(sensor.board, sensor, clearance, 0.0012) is None)
    printing = replace(COVERED, clearance=clearance)
    scene = Scene(occlusion="shadow", sensor=sensor, printing=printing)
    plan = plan_ring(scene, Ring("forearm", 0.5, 2, float(rng.uniform(-1, 1)), 0.0, 0.2, sensor))
    lid = lid_solid(plan)
    assert len(lid.decompose()) == 1
    assert least_wall(lid, seed % 7) >= 1.2
    assert read_stl(stl(flat_lid(plan))).is_watertight
    whole = union([*assemble(plan).boards, *assemble(plan).plugs, *screw_heads(plan)])
    assert (union(mounted_lids(plan)) ^ whole).volume() < 0.01
    assert (union([beam(plan, k) for k in range(2)]) ^ union(screw_heads(plan))).volume() == 0


@given(st.floats(1, 89))
def test_wider_beams_need_wider_windows_until_no_lid_is_left(degrees):
    narrow = Sensor(fov=2 * math.radians(degrees))
    wider = Sensor(fov=2 * math.radians(degrees + 0.5))
    faults = [lid_fault(VL53L5CX, one, 0.0003, 0.0012) for one in (narrow, wider)]
    assert faults[1] is not None or faults[0] is None
    assert (faults[0] is None) == (degrees < 20) or 20 <= degrees <= 75


def test_a_scene_without_lids_is_written_as_before_there_were_any():
    for printing, count in ((Printing(), 0), (COVERED, 1)):
        scene = replace(Scene(), printing=printing)
        text = scene_toml(scene)
        assert text.count("cover = true") == text.count("cover") == count
        assert scene_of_table(tomllib.loads(text)).printing == printing
