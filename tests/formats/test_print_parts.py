"""Parts of printed rings: joints, bed, fastening, lettering, bridges for ties, ribs, plates."""

import io
import itertools
import json
import math
import re
import zipfile
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.rings.clamp import INSERTS
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.robots.built_in import ROBOTS
from place_rings.coverage.sensors.board_packing import Printing
from place_rings.formats.printing.blocks import thread
from place_rings.formats.printing.bolts import fasteners
from place_rings.formats.printing.lettering import DEPTH, part_label
from place_rings.formats.printing.primitives import box, tube, union
from place_rings.formats.printing.print_bed import bed_yaw, build_ring
from place_rings.formats.printing.print_checks import open_edges, read_stl, stl
from place_rings.formats.printing.print_files import board_screws, print_ring, ring_files
from place_rings.formats.printing.print_plan import UnbuildableError, plan_ring
from place_rings.formats.printing.print_plates import print_plates
from place_rings.formats.printing.ring_solids import assemble
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene

from ..support.assembly import wall
from ..support.refusals import refused
from .test_printing import L4CD, sensor_of

SCENE = Scene(occlusion="shadow", sensor=L4CD)
SOLD = (3, 4, 5, 6, 8, 10, 12, 16, 20, 25, 30, 35, 40, 45, 50)  # mm, as in a shop's list
CORE = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
_NUMBER = re.compile(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?", re.IGNORECASE)


def ring_of(count: int = 8, tilt: float = 0.5, link: str = "upper_arm", more: float = 0.0) -> Ring:
    return Ring(link, 0.3, count, tilt, 0.2, SCENE.radius_of(link) + more, L4CD)


@given(st.integers(1, 12), st.integers(3, 8))
def test_joints_divide_a_ring_between_its_sensors(count, parts):
    try:
        plan = plan_ring(SCENE, ring_of(count), None, parts)
    except UnbuildableError:
        assert parts > count  # several joints between two sensors, too near to their blocks
        return
    widths = np.diff([*plan.joints, plan.joints[0] + 2 * math.pi])
    assert len(widths) == parts
    assert np.all(widths > 0)
    assert np.all(widths <= math.pi + 1e-9)  # laid on the link from its side
    apart = np.abs(np.angle(np.exp(1j * (plan.joints[:, None] - plan.angles))))
    assert np.all(plan.collar * np.sin(np.minimum(apart, math.pi / 2)) > 0)
    # a joint midway between sensors, or beyond their blocks
    midway = np.isclose(apart.min(axis=1), math.pi / count)
    beyond = plan.collar * np.sin(np.minimum(apart.min(axis=1), math.pi / 2)) > plan.half
    assert np.all(midway | beyond)


@pytest.mark.parametrize(("count", "more", "side"), [(8, 0.0, 0.15), (3, 0.05, 0.13)])
def test_a_small_bed_divides_a_ring_into_parts_that_fit_and_close_it(count, more, side):
    ring, bed = ring_of(count, more=more), (side, side, 0.2)
    record, files, plan, made = print_ring(SCENE, 0, ring, Printing(bed=bed, fastening="insert"))
    assert len(files) == len(made.parts) == len(record.T_link_print) > 2 - (side > 0.14)
    for data in files:
        mesh = read_stl(data)
        assert mesh.is_watertight
        assert np.all(mesh.extents <= 1000 * np.array(bed) + 1e-3)
    band = tube(plan.collar, plan.lug[0], plan.lug[1])
    whole = (union(made.parts) ^ band).volume()
    wanted = (plan.collar**2 - plan.bore**2) * math.pi * (plan.lug[1] - plan.lug[0])
    gaps = len(files) * plan.wall * (plan.lug[1] - plan.lug[0]) * 1000 * plan.printing.gap
    letters = (made.letters ^ band).volume()
    assert whole == pytest.approx(wanted - gaps - letters, rel=0.02)


@pytest.mark.parametrize("bed", [(0.2, 0.2, 0.03), (0.03, 0.03, 0.2)])
def test_a_ring_that_no_bed_holds_is_refused_in_one_line(bed):
    scene = replace(SCENE, printing=Printing(bed=bed))
    with refused("ring 0 (upper_arm) printing.bed_mm 30"):
        ring_files(Setup((ring_of(4),)), scene, lambda *_: {})


@given(st.floats(1, 60), st.floats(1, 60), st.floats(0, 180))
@settings(max_examples=15)
def test_a_box_fits_a_bed_turned_by_what_is_stated(x, y, degrees):
    solid = box((0, 0, 0), (x, y, 5)).rotate((0, 0, degrees))
    yaw = bed_yaw(solid, (0.05, 0.05, 0.01))
    if max(x, y) <= 49:  # with the step of a few degrees
        assert yaw is not None
    if yaw is not None:
        low, high = np.reshape(solid.rotate((0, 0, yaw)).bounding_box(), (2, 3))
        assert np.all(high - low <= np.array([50, 50, 10]) + 1e-6)
    assert bed_yaw(solid, None) == 0
    assert bed_yaw(solid, (0.2, 0.2, 0.004)) is None


@pytest.mark.parametrize("bolt", ["M3", "M4", "M5"])
def test_heat_set_inserts_have_their_holes_and_bolts_their_length(bolt):
    printing = Printing(bolt=bolt, fastening="insert", lettering=False, ties=False)
    record, _, plan, made = print_ring(SCENE, 0, ring_of(3), printing)
    insert, size = INSERTS[int(bolt[1:])], int(bolt[1:])
    assert f"{bolt} × {1000 * insert.length:.1f} mm" in record.bolts
    z, length = sum(plan.lug) / 2, 1000 * insert.length
    for wider, fits in ((-0.02, True), (0.1, False)):
        pin = tube(500 * insert.hole + wider, 0, length, 16).rotate((-90, 0, 0))
        pin = pin.translate((plan.across, -plan.reach, z))
        assert ((pin ^ made.parts[1]).volume() < 0.01) == fits
    assert -plan.reach + length + 0.5 <= -500 * printing.gap + 1e-9  # ends within its ear
    bolt_of_it = tube(size / 2, -plan.reach, plan.reach, 16).rotate((-90, 0, 0))
    assert (bolt_of_it.translate((plan.across, 0, z)) ^ union(made.parts)).volume() < 0.01


def test_labels_name_part_ring_and_link_in_plain_letters():
    assert part_label("2 upper_arm", 0) == "2A UPPER ARM"
    assert part_label("10 panda_link3", 1) == "10B PANDA LINK3"
    assert part_label(r"0 $\frac$ ü", 2) == "0C FRAC"


@pytest.mark.parametrize("tilt", [0.4, -0.4])
def test_lettering_is_engraved_in_the_band_and_its_arrow_points_to_the_wrist(tilt):
    plan, made = build_ring(SCENE, ring_of(4, tilt), 7)
    plain = assemble(replace(plan, label=""))
    cut = union(plain.parts) - union(made.parts)
    assert cut.volume() > 30
    low, high = plan.collar - DEPTH - 0.3, plan.collar + 0.01
    ring = tube(high, plan.lug[0], plan.lug[1]) - tube(low, plan.lug[0] - 1, plan.lug[1] + 1)
    assert (cut - ring).volume() < 0.01
    # the arrow is the last of each part: its tip is where it is narrow
    last = max(
        made.letters.decompose(), key=lambda one: _azimuth(one) if _azimuth(one) < math.pi else -1
    )
    z0, z1 = last.bounding_box()[2], last.bounding_box()[5]
    ends = [last.slice(z).area() for z in (z0 + 0.3 * (z1 - z0), z0 + 0.7 * (z1 - z0))]
    assert (ends[1] > ends[0]) == (tilt > 0)  # the head is wider than the shaft
    if tilt > 0:
        record, *_ = print_ring(SCENE, 7, ring_of(2, tilt), Printing(lettering=False))
        assert record.lettering == []


def _azimuth(solid) -> float:
    low, high = np.reshape(solid.bounding_box(), (2, 3))
    x, y, _ = (low + high) / 2
    return float(math.atan2(y, x) % (2 * math.pi))


def test_a_cable_tie_passes_under_its_bridge():
    plan, made = build_ring(SCENE, ring_of(4))
    plain = assemble(replace(plan, printing=replace(plan.printing, ties=False)))
    added = (union(made.parts) - union(plain.parts)).decompose()
    added = [piece for piece in added if piece.volume() > 20]
    assert made.ties == len(added) == 2
    for bridge in added:
        at = _azimuth(bridge)
        # 2.5 × 1.1 mm, straight across the bridge beside the band
        high = plan.lug[1] - 1.8
        tie = box((plan.collar + 0.2, -4.5, high - 2.5), (plan.collar + 1.3, 4.5, high))
        tie = tie.rotate((0, 0, math.degrees(at)))
        assert (tie ^ union(made.parts)).volume() < 0.01
        assert (tie ^ bridge.hull()).volume() > 1  # it is held


def test_long_blocks_are_ribs_and_far_lighter_than_full_ones():
    near, far = (build_ring(SCENE, ring_of(4, more=more))[1] for more in (0.0, 0.05))
    plan = build_ring(SCENE, ring_of(4, more=0.05))[0]
    grown = sum(p.volume() for p in far.parts) - sum(p.volume() for p in near.parts)
    full = 4 * 50 * 2 * plan.half * (plan.top - plan.low)
    assert grown < 0.3 * full


def test_no_film_remains_between_the_openings_of_neighbours():
    """Openings that ended midway between two blocks left a film of 2 micrometres."""
    printing = Printing(bolt="M4")
    sensor = sensor_of("vl53l5cx")
    ring = Ring("forearm", 0.165361, 10, -0.3474723647917951, 0.2854538351514286, 0.08, sensor)
    scene = Scene(robot=ROBOTS["ur5e"], poses=(Pose(ROBOTS["ur5e"].rest),), sensor=sensor)
    _, files, *_ = print_ring(scene, 0, ring, printing)
    assert min(wall(data) for data in files) >= 1.2


@pytest.mark.parametrize("tilt", [0.0, -0.0002])
def test_halves_whose_split_leans_have_no_thin_edge(tilt):
    """A slot between them left wedges beside the blocks, which only many rays find: 11 of
    40,000."""
    ring = Ring("forearm", 0.4, 13, tilt, 0.0, SCENE.radius_of("forearm"), L4CD)
    for part in build_ring(SCENE, ring)[1].parts:
        assert wall(stl(part), rays=40_000) >= 1.2


def test_a_flap_without_thickness_leaves_no_open_edges_in_a_file():
    """The Booleans of this ring left two vertices at one place on a long edge, and between them two
    faces of no area that covered each other."""
    robot, sensor = ROBOTS["ur5e"], sensor_of("vl53l5cx")
    ring = Ring("upper_arm", 0.105355, 3, 1.1561270404720678, 1.021520267241257, 0.08, sensor)
    scene = Scene(robot=robot, poses=(Pose(robot.rest),), sensor=sensor)
    scene = replace(scene, printing=Printing(bolt="M5", fastening="insert"))
    for part in build_ring(scene, ring)[1].parts:
        mesh = read_stl(stl(part))
        assert open_edges(mesh) == 0
        assert mesh.volume == pytest.approx(part.volume(), rel=1e-6)


@pytest.mark.parametrize("bed", [None, (0.16, 0.16, 0.2)])
def test_plates_hold_all_parts_and_a_lid_for_each_board_with_names_and_millimetres(bed):
    setup = Setup((ring_of(3), ring_of(2, -0.3, "forearm")))
    scene = replace(SCENE, printing=Printing(bed=bed, cover=True))
    result, data = ring_files(setup, scene, lambda *_: {})
    assert result.plates == [f"plate{i}.3mf" for i in range(len(result.plates))]
    assert result.plates
    wide = np.array([0.25, 0.21, 0.2] if bed is None else bed)
    count = dict[str, int]()
    for plate in result.plates:
        boxes, built = [], plate_parts(data[plate])
        for name, mesh in built:
            count[f"{name}.stl"] = count.get(f"{name}.stl", 0) + 1
            same = read_stl(data[f"{name}.stl"])
            assert mesh.is_watertight
            assert mesh.volume == pytest.approx(same.volume, rel=1e-6)
            np.testing.assert_allclose(mesh.extents, same.extents, atol=1e-3)
            boxes.append(mesh.bounds)
            assert mesh.bounds[0].min() >= -1e-3
            assert np.all(mesh.bounds[1] <= 1000 * wide + 1e-3)
        for (a, b), (c, d) in itertools.combinations(boxes, 2):
            assert np.maximum(a - d, c - b)[:2].max() >= 5 - 1e-3
        # trimesh's own reader
        read = trimesh.load_scene(io.BytesIO(data[plate]), file_type="3mf")
        assert read.units == "millimeter"
        assert len(read.graph.nodes_geometry) == len(built)
        assert set(read.geometry) == {name for name, _ in built}
    wanted = {file: 1 for ring in result.rings for file in ring.T_link_print}
    wanted |= {ring.lids.file: ring.lids.copies for ring in result.rings}
    assert count == wanted
    written = json.loads(data["printing.json"])["rings"]
    for ring, record in zip(setup.rings, written, strict=True):
        assert record["lids"]["copies"] == len(record["lids"]["T_link_print"]) == ring.count


def plate_parts(data: bytes) -> list[tuple[str, trimesh.Trimesh]]:
    """The built objects of a 3MF file with their names, placed by its build items, read as the core
    specification says: every attribute and reference is checked."""
    with zipfile.ZipFile(io.BytesIO(data)) as package:
        assert package.testzip() is None
        assert package.namelist()[0] == "[Content_Types].xml"
        relations = ElementTree.fromstring(package.read("_rels/.rels"))
        (target,) = (r.get("Target") for r in relations)
        model = ElementTree.fromstring(package.read(target.lstrip("/")))
    assert model.tag == f"{CORE}model"
    assert model.get("unit") == "millimeter"
    assert [child.tag.removeprefix(CORE) for child in model] == ["metadata", "resources", "build"]
    objects = {}
    for one in model.find(f"{CORE}resources"):
        assert (one.tag, one.get("type")) == (f"{CORE}object", "model")
        (mesh,) = one
        vertices, triangles = mesh
        numbers = [[v.get(key) for key in "xyz"] for v in vertices]
        assert all(_NUMBER.fullmatch(text) for row in numbers for text in row)
        faces = np.array([[int(t.get(key)) for key in ("v1", "v2", "v3")] for t in triangles])
        assert faces.min() == 0
        assert faces.max() == len(numbers) - 1
        assert np.all((faces != np.roll(faces, 1, axis=1)).all(axis=1))
        assert one.get("id") not in objects
        objects[one.get("id")] = (one.get("name"), np.array(numbers, float), faces)
    parts, built = [], set()
    for item in model.find(f"{CORE}build"):
        numbers = [float(text) for text in item.get("transform").split(" ")]
        M = np.reshape(numbers, (4, 3))  # rows: images of x, y, z, and the translation
        np.testing.assert_array_equal(M[:3], np.eye(3))
        name, vertices, faces = objects[item.get("objectid")]
        built.add(item.get("objectid"))
        parts.append((name, trimesh.Trimesh(vertices @ M[:3] + M[3], faces, process=False)))
    assert built == set(objects)
    assert len({name for name, *_ in objects.values()}) == len(objects)
    return parts


def test_equal_parts_give_equal_plates():
    data = {"a.stl": trimesh.creation.box((10, 20, 5)).export(file_type="stl")}
    assert print_plates(data, None) == print_plates(data, None)


@settings(max_examples=8)
@given(
    st.sampled_from(["vl53l1x", "vl53l5cx"]),
    st.floats(-1.0, 1.0),
    st.sampled_from(["nut", "insert"]),
    st.sampled_from(["M3", "M4", "M5"]),
    st.booleans(),
)
def test_screws_and_bolts_are_sold_and_hold(model, tilt, fastening, bolt, cover):
    """A screw ends in the post of its board, and its thread holds by a diameter; a bolt passes both
    ears and ends in or behind its nut or insert."""
    sensor = sensor_of(model)
    printing = Printing(fastening=fastening, bolt=bolt, cover=cover)
    scene = replace(SCENE, sensor=sensor, printing=printing)
    radius = scene.radius_of("upper_arm")
    plan = plan_ring(scene, Ring("upper_arm", 0.3, 3, tilt, 0.2, radius, sensor))
    board, lid = plan.pocket.board, plan.pocket.lid
    grip = 1000 * (board.thickness if lid is None else lid.grip)
    deep = min(thread(plan, 1000 * (y - board.lens[1])) for _, y in board.holes)
    count, text = board_screws(plan)
    size, length = map(float, re.match(r"M([\d.]+)\D+([\d.]+) mm", text).groups())
    assert count == 3 * len(board.holes)
    assert size <= 1000 * board.hole
    assert length <= grip + deep + 1e-6
    assert "cut" in text or (length in SOLD and length - grip >= size)
    text, held = fasteners(plan)
    size, length = map(float, re.match(r"M([\d.]+) × ([\d.]+) mm", text).groups())
    assert size == int(bolt[1:])
    assert length in SOLD
    insert = fastening == "insert"
    thick = 1000 * INSERTS[round(size)].length if insert else plan.bolt.nut_height
    end = 2 * plan.reach - (0 if insert else 0.3)  # a nut is covered by 0.3 mm
    inside = min(length, end) - (end - thick)
    assert inside >= (size if insert else thick) - 1e-6
    assert "insert" in held or "nut" in held
