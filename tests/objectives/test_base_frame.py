"""Coordinates read from a UR arm's pendant: the cell that both frames state is one cell, counted
alike (ros-industrial/universal_robot, issue 676)."""

import numpy as np
import place_rings as pr
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.definitions.errors import UserError
from place_rings.coverage.robots.base_frame import base_frame
from place_rings.coverage.robots.built_in import ROBOTS
from place_rings.coverage.robots.kinematics import forward
from place_rings.formats.loader import read_proposal, read_scene, read_target
from place_rings.formats.schema.proposal_models import ProposalFile
from place_rings.formats.writing import to_toml
from place_rings.objectives.verify import Verifier
from place_rings.reporting.lines.occlusion import base_lines

from ..support.refusals import refused
from ..support.scene_tables import scene_of_table, scene_toml

VOXEL, TURNED = 0.06, np.array([-1.0, -1.0, 1.0])
UR = sorted(name for name, robot in ROBOTS.items() if base_frame(robot) == "base_link")
# no coordinate lies on the lattice of the voxels' centres
place = st.tuples(*[st.integers(-8, 8).map(lambda n: 0.1 * n + 0.0137)] * 3).map(list)
angles = st.tuples(*[st.integers(-17, 18).map(lambda n: 10.0 * n + 0.3)] * 3).map(list)


@st.composite
def cells(draw):
    """Tables of a scene in base_link: a box, points, a mesh, a camera, and targets of its own."""
    where, turn = draw(st.lists(place, min_size=8, max_size=8)), draw(angles)
    box = {"kind": "box", "size": [0.5, 0.4, 0.6], "centre": where[0], "rpy_deg": turn}
    half = {"kind": "half_space", "normal": where[1], "point": [0.0, 0.0, 0.4037]}
    rows = [" ".join(str(draw(st.integers(1, 9))) for _ in range(3)) for _ in range(4)]
    weights = {"origin": [-0.9, -0.7, -0.3], "cell": [0.6, 0.4, 0.7], "layers": 2, "rows": rows}
    points = [where[2], *(np.add(where[2], 0.3 * row).tolist() for row in np.eye(3))]
    return {
        "robot": draw(st.sampled_from(UR)),
        "obstacles": [
            {"size": [0.3, 0.5, 0.2], "centre": where[3], "rpy_deg": draw(angles)},
            {"points": points, "centre": where[4], "rpy_deg": draw(angles)},
            {"floor": -0.6},
        ],
        "attached": [{"link": "base", "size": [0.2, 0.3, 0.1], "centre": where[5]}],
        "cell_sensors": [
            {
                "position": where[6],
                "direction": where[7],
                "up": [0.31, -0.8, 0.47],
                "sensor": {"fov_deg": 60, "fov_up_deg": 40, "range_m": 2.0},
            }
        ],
        "targets": [
            {"name": "V_S", "radius": 0.4, "importance": weights, "reachable": True},
            {"name": "own", "volume": {"kind": "difference", "of": [box, half]}},
        ],
    }


def pendant(table):
    """The same tables in the pendant's Base: each place negated, and yaws half a turn on."""
    if isinstance(table, list):
        return [pendant(one) for one in table]
    if not isinstance(table, dict):
        return table
    new = {key: value if key == "rows" else pendant(value) for key, value in table.items()}
    for key in {"centre", "point", "normal", "position", "direction", "up"} & table.keys():
        new[key] = (TURNED * table[key]).tolist()
    if "points" in table or "size" in table:
        roll, pitch, yaw = table.get("rpy_deg", (0.0, 0.0, 0.0))
        new["rpy_deg"] = [roll, pitch, (yaw + 360) % 360 - 180]
        new["centre"] = (TURNED * table.get("centre", np.zeros(3))).tolist()
    if "rows" in table:
        layers, flat = table["layers"], [row.split()[::-1] for row in table["rows"]]
        each = len(flat) // layers
        new["rows"] = [
            " ".join(row) for i in range(layers) for row in flat[i * each : (i + 1) * each][::-1]
        ]
        far = np.multiply(table["cell"], [len(flat[0]), each, layers]) + table["origin"]
        new["origin"] = [-far[0], -far[1], table["origin"][2]]
    return new


def counts(scene):
    setup, each = pr.Setup((scene.ring("forearm", 0.4, 6, tilt=0.4),)), []
    for goal in scene.targets:
        try:
            v = Verifier(scene, VOXEL).verify(setup, goal.target)
            each.append((v.covered_voxels, v.target_voxels, v.zeta))
        except ValueError as error:  # an empty target
            each.append(str(error))
    return each


@settings(max_examples=3)
@given(cells())
def test_both_frames_state_one_cell(tmp_path_factory, cell):
    folder = tmp_path_factory.mktemp("cell")
    here = scene_of_table({**cell, "base": "base_link"})
    there = scene_of_table({**pendant(cell), "base": "pendant"})
    written = folder / "again.toml"
    written.write_text(scene_toml(there), "utf-8")
    assert 'base = "base_link"' in written.read_text("utf-8")
    assert counts(here) == counts(there) == counts(read_scene(written))


@given(st.integers(0, 2**32 - 1))
def test_the_makers_table_begins_at_the_pendants_base(seed):
    q = np.random.default_rng(seed).uniform(-3, 3, 6)
    here, there = (forward(ROBOTS[name].chain, q)[-1][:3, 3] for name in ("ur10", "ur10_dh"))
    assert np.allclose(here * TURNED, there, atol=1e-6)
    assert [base_frame(ROBOTS[name]) for name in ("ur10", "ur10_dh")] == ["base_link", "pendant"]


def test_python_and_target_files_turn_likewise(tmp_path):
    box = pr.Box((0.4, 0.2, 0.3), centre=(0.5037, 0.2, 0.4), name="door")
    wall = pr.Obstacle("wall", size=(0.1, 1.0, 1.0), centre=(0.7, 0.3, 0.2))
    scene = pr.Scene("ur5e", targets=box, obstacles=wall, base="pendant")
    assert scene.targets[0].centre == (-0.5037, -0.2, 0.4)
    again = scene.replace(obstacles=wall, base="pendant").obstacles[0]
    assert again == scene.obstacles[0]
    assert again.centre == (-0.7, -0.3, 0.2)
    assert scene.base == "base_link"
    with refused("base", "pendant", error=pr.InputError):
        pr.Scene("panda", obstacles=wall, base="pendant")
    file = tmp_path / "door.toml"
    file.write_text(
        'base = "pendant"\nname = "door"\n[volume]\nkind = "sphere"\nradius = 0.2\n'
        "centre = [0.5, 0.2, 0.0]\n"
    )
    assert read_target(file, ROBOTS["ur5e"]) == pr.Sphere(0.2, (-0.5, -0.2, 0), name="door")


def test_a_robot_of_another_maker_has_no_pendants_base(tmp_path):
    file = tmp_path / "cell.toml"
    file.write_text('robot = "panda"\nbase = "pendant"\n', "utf-8")
    with refused("cell.toml", "base", "pendant"):
        read_scene(file)
    with pytest.raises(UserError):
        read_scene(file, ROBOTS["iiwa14"])


def test_sensors_of_a_proposal_on_the_base_turn_with_its_scene(tmp_path):
    single = pr.MountedSensor("base", (0.3, 0.2, 0.5), (1.0, 0.5, 0.0))
    file = tmp_path / "proposal.toml"
    written = ProposalFile.of(pr.Setup((), (single,)), pr.Scene("ur5e"))
    text = to_toml(written, "p").replace("[scene]\n", '[scene]\nbase = "pendant"\n')
    file.write_text(text, "utf-8")
    setup, scene, _ = read_proposal(file)
    assert setup.singles[0].position == (-0.3, -0.2, 0.5)
    assert ProposalFile.of(setup, scene).scene.base == "base_link"
    assert written.scene.base is None  # no coordinate of its scene depends on it


def test_a_cell_of_a_ur_arm_without_a_base_gets_a_note():
    wall = pr.Obstacle("wall", size=(0.1, 1.0, 1.0), centre=(0.7, 0.3, 0.2))
    each = [
        pr.Scene("ur5e", obstacles=wall),
        pr.Scene("ur5e", obstacles=wall, base="base_link"),
        pr.Scene("ur5e"),
        pr.Scene("panda", obstacles=wall),
    ]
    assert [len(base_lines(scene)) for scene in each] == [1, 0, 0, 0]
