"""Mass, centre of mass and inertia of printed rings: closed forms, laws of rigid bodies, and the
exported STL files weighed by trimesh.
"""

import io

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.robots.built_in import ROBOTS, T_flange_tcp
from place_rings.coverage.robots.kinematics import transform
from place_rings.coverage.sensors.effective_range import Use
from place_rings.coverage.sensors.sensor import effective
from place_rings.formats.printing.payload import (
    BOARD,
    PARTS,
    PLASTIC,
    MassProperties,
    joined,
    of_mesh,
    payload,
    ring_parts,
)
from place_rings.formats.printing.print_files import ring_files
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene

SENSOR = effective(Use("vl53l4cd")).sensor
lengths = st.floats(0.01, 0.5)
angles = st.floats(-3, 3)


def scene_of(name):
    return Scene(robot=ROBOTS[name], poses=(Pose(ROBOTS[name].rest),), sensor=SENSOR)


def mounted(scene, *links):
    return Setup(tuple(Ring(k, 0.5, 4, 0.2, 0.3, scene.radius_of(k), SENSOR) for k in links))


def same(one, other, within=1e-9):
    assert one.mass == pytest.approx(other.mass, rel=within)
    assert np.allclose(one.centre, other.centre, rtol=0, atol=within)
    assert np.allclose(one.inertia, other.inertia, rtol=within, atol=within * one.mass * 0.01)


@given(lengths, lengths, lengths, angles, angles, angles)
def test_a_box_has_the_inertia_of_its_formula_wherever_it_lies(a, b, c, x, roll, yaw):
    T = transform((x, 0.3, -x), (roll, 0.4, yaw))
    box = trimesh.creation.box((a, b, c))
    one = of_mesh(box.vertices, box.faces, 700.0).moved(T)
    mass = 700 * a * b * c
    inertia = mass / 12 * np.diag([b * b + c * c, a * a + c * c, a * a + b * b])
    wanted = MassProperties(mass, T[:3, 3], T[:3, :3] @ inertia @ T[:3, :3].T)
    same(one, wanted)
    again = of_mesh(box.vertices @ T[:3, :3].T + T[:3, 3], box.faces, 700.0)
    same(again, wanted, 1e-8)


@given(lengths, lengths)
def test_two_halves_of_a_box_are_the_box(a, b):
    half = trimesh.creation.box((a, b, 0.1))
    one = of_mesh(half.vertices, half.faces, 1000.0)
    two = one.moved(transform((a, 0, 0)))
    whole = trimesh.creation.box((2 * a, b, 0.1))
    both = of_mesh(whole.vertices, whole.faces, 1000.0).moved(transform((a / 2, 0, 0)))
    same(joined([one, two]), both)


def test_the_plastic_is_that_of_the_exported_files_by_trimesh():
    scene = scene_of("ur5e")
    setup = mounted(scene, "forearm")
    records, files = ring_files(setup, scene, lambda *_: {})
    meshes = []
    (record,) = records.rings
    for file, T in record.T_link_print.items():
        mesh = trimesh.load_mesh(io.BytesIO(files[file]), file_type="stl")
        mesh.apply_scale(0.001)
        mesh.apply_transform(np.array(T))
        mesh.density = PLASTIC
        meshes.append(mesh.mass_properties)
    weighed = joined([MassProperties(m.mass, m.center_mass, m.inertia) for m in meshes])
    # files are rounded to single precision
    same(ring_parts(scene, setup.rings[0])["plastic"], weighed, 1e-5)


def test_boards_weigh_their_outline_and_their_parts():
    scene = scene_of("ur10")
    (ring,) = mounted(scene, "tool").rings
    board = SENSOR.board
    volume = board.width * board.height * board.thickness
    holes = len(board.holes) * np.pi * board.hole**2 / 4 * board.thickness
    boards = ring_parts(scene, ring)["boards"]
    each = boards.mass / ring.count - PARTS
    # with the sensor's package
    assert BOARD * (volume - holes) * 0.98 < each < BOARD * volume * 1.2


@pytest.mark.parametrize("name", ["ur10", "ur10_dh", "ur3e", "ur16e"])
def test_the_controllers_flange_looks_along_its_z(name):
    """A ring around the flange, stated from the flange inwards, has its mass on the axis."""
    scene = scene_of(name)
    load = payload(scene, mounted(scene, "forearm", "tool"))
    assert load.frame == "flange"
    assert [one.at_flange for one in load.rings] == [False, True]
    assert load.flange.mass == pytest.approx(load.rings[1].mass)
    assert np.abs(load.flange.centre[:2]).max() < 2e-3  # four sensors, two bolts: nearly even
    outward = T_flange_tcp(ROBOTS[name])[:3, :3] @ scene.robot.mount("tool").axis
    assert np.allclose(outward, [0, 0, 1])
    values = np.linalg.eigvalsh(load.flange.inertia)
    assert values[0] > 0
    assert values[2] < values[0] + values[1]  # of every rigid body


def test_a_ring_that_cannot_be_printed_has_no_known_mass():
    load = payload(Scene(), Setup((Ring("tool", 0.0, 4, 0.0, 0.0, 0.1),)))
    assert load.rings[0].mass is None
    assert load.rings[0].reason
    assert load.flange.mass == 0
    assert payload(scene_of("panda"), Setup(())).frame == "tcp"
