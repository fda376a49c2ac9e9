"""The calibration of one arm: against an independent product of Denavit-Hartenberg matrices,
without effect where nothing differs, and refused where it belongs to another robot.
"""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.robots.built_in import (
    ROBOTS,
    built_in,
    calibrated_chain,
    controller_table,
)
from place_rings.coverage.robots.calibration import DhTable, dh_table
from place_rings.coverage.robots.kinematics import forward, rpy_of
from place_rings.formats.loader import read_proposal, read_scene
from place_rings.formats.robots.calibration_files import calibrated_from
from place_rings.formats.schema.proposal_models import ProposalFile
from place_rings.formats.writing import to_toml
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import Verifier
from place_rings.objectives.verify_breakdown import calibration_effect, largest_move

from ..strategies.rings import poses
from ..support.refusals import refused

ARMS = [name for name in ROBOTS if name.startswith("ur")]
LINKS = ("shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")
# of a real UR3: nearly parallel axes have their common normal tens of metres away
REAL = DhTable(
    np.array([9.14e-08, 0.178461025123001604, 6.68283349819805572, -0.578116982609792496, 0, 0]),
    np.array([-0.000243789, 0.00381165418642351317, 0.034503078453104935, 0.000107695, -2e-4, 0]),
    np.array(
        [9.2e-05, 12.0620003757611567, 17.6719025641737275, -29.7339960369544869, -3e-5, 2e-4]
    ),
    np.array([0.001156, 0.0035851898103369975, 0.00392132336586574568, 0.00040667, -0.0020117, 0]),
)
NONE = DhTable(*np.zeros((4, 6)))


def conf(delta):
    values = (delta.theta, delta.a, delta.d, delta.alpha)
    rows = zip(("theta", "a", "d", "alpha"), values, strict=True)
    lines = [f"delta_{key} = [ {', '.join(map(repr, map(float, v)))} ]" for key, v in rows]
    return "\n".join(["[mounting]", *lines, "calibration_status = 2   # Linearised"])


def yaml(origin):
    """Return a description's kinematics of frames; the flange joins the last joint's frame."""
    frames = [*origin[:5], origin[5] @ origin[6]]
    text = "kinematics:\n"
    for link, T in zip(LINKS, frames, strict=True):
        values = dict(zip(("x", "y", "z"), T[:3, 3], strict=True))
        values |= dict(zip(("roll", "pitch", "yaw"), rpy_of(T[:3, :3]), strict=True))
        text += f"  {link}:\n" + "".join(f"    {k}: {float(v)!r}\n" for k, v in values.items())
    return text + "  hash: calib_1\n"


def dh_product(table, q):
    """The flange in the controller's base by textbook matrices."""
    T = np.eye(4)
    for theta, a, d, alpha, angle in zip(
        table.theta, table.a, table.d, table.alpha, q, strict=True
    ):
        c, s, ca, sa = (f(x) for x in (theta + angle, alpha) for f in (math.cos, math.sin))
        T = T @ np.array(
            [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
        )
    return T


small = st.lists(st.integers(-100, 100), min_size=24, max_size=24).map(
    lambda v: np.array(v, float).reshape(4, 6) * 1e-5 * np.array([[1], [2], [2], [1]])
)


@settings(max_examples=20, deadline=None)
@given(small, poses(), st.sampled_from(ARMS))
def test_calibrated_kinematics_are_the_tables_product(deltas, q, name):
    chain = ROBOTS[name].chain
    model, own = dh_table(chain), dh_table(chain) + DhTable(*deltas)
    calibrated = calibrated_chain(chain, own.origin)
    zero = np.zeros(6)
    # what lies between the model's flange and TCP, and between both bases, stays
    base = np.diag([-1.0, -1, 1, 1]) if name != "ur10_dh" else np.eye(4)
    tool = np.linalg.inv(base @ dh_product(model, zero)) @ forward(chain, zero)[-1]
    wanted = base @ dh_product(own, q) @ tool
    assert np.allclose(forward(calibrated, q)[-1], wanted, rtol=0, atol=1e-10)


@settings(max_examples=10, deadline=None)
@given(poses())
def test_a_real_calibration_with_far_common_normals(q):
    chain = ROBOTS["ur3"].chain
    own = dh_table(chain) + REAL
    calibrated = calibrated_chain(chain, own.origin)
    base, zero = np.diag([-1.0, -1, 1, 1]), np.zeros(6)
    tool = np.linalg.inv(base @ dh_product(dh_table(chain), zero)) @ forward(chain, zero)[-1]
    wanted = base @ dh_product(own, q) @ tool
    assert np.allclose(forward(calibrated, q)[-1], wanted, rtol=0, atol=1e-9)
    # the links stay where they are, though parameters differ by 30 m and 6.7 rad
    moved = forward(calibrated, q)[:, :3, 3] - forward(chain, q)[:, :3, 3]
    assert 1e-4 < np.linalg.norm(moved, axis=-1).max() < 5e-3


@pytest.mark.parametrize("name", ARMS)
def test_zero_deltas_change_nothing(name):
    robot = ROBOTS[name]
    assert calibrated_from(robot, "calibration.conf", conf(NONE)) is robot
    text = yaml(dh_table(robot.chain).origin)
    assert calibrated_from(robot, "kinematics.yaml", text) is robot


@pytest.mark.parametrize("name", ARMS)
def test_both_files_state_the_same_calibration(name):
    robot = ROBOTS[name]
    deltas = 1e-4 * np.random.default_rng(1).uniform(-1, 1, (4, 6))
    deltas[[1, 3], 5] = 0  # the description has no place for them; controllers state 0
    delta = DhTable(*deltas)
    one = calibrated_from(robot, "calibration.conf", conf(delta))
    text = yaml((dh_table(robot.chain) + delta).origin)
    other = calibrated_from(robot, "robot_calibration.yml", text)
    assert np.allclose(one.chain.origin, other.chain.origin, rtol=0, atol=1e-12)
    assert not np.allclose(one.chain.origin, robot.chain.origin, rtol=0, atol=1e-6)
    assert one.calibration.source == "calibration.conf"
    assert one.nominal.chain is robot.chain
    assert built_in(one.nominal)
    assert not built_in(one)


@pytest.mark.parametrize("links", [True, False])
def test_a_calibration_survives_other_links_and_tools(links):
    robot = calibrated_from(ROBOTS["ur10"], "c.conf", conf(DhTable(*np.full((4, 6), 1e-4))))
    again = robot.with_links(links)
    assert again.chain is robot.chain
    assert again.nominal.chain is ROBOTS["ur10"].chain
    assert again.nominal.mounts is again.mounts


UR3, UR5 = (yaml(dh_table(ROBOTS[name].chain).origin) for name in ("ur3", "ur5"))


@pytest.mark.parametrize(
    ("file", "text", "parts"),
    [
        ("c.conf", "", "0"),
        ("c.conf", "\0", ""),
        ("c.conf", conf(NONE).replace("delta_a", "delta_b"), "delta_a"),
        ("c.conf", conf(NONE).replace("delta_d = [ 0.0,", "delta_d = ["), "delta_d 5"),
        ("c.conf", conf(NONE).replace("[ 0.0,", "[ nan,"), 'delta_theta[0] "nan"'),
        ("c.conf", conf(NONE).replace("[ 0.0,", "[ one,"), 'delta_theta[0] "one"'),
        ("c.conf", conf(NONE) + "\n[mounting]\n", "mounting"),
        ("c.yaml", "a: [", "YAML"),
        ("c.yaml", "[" * 400, "YAML"),
        ("c.yaml", "- 1", "1"),
        ("c.yaml", "kinematics:\n  shoulder: 3", "kinematics.shoulder 3"),
        ("c.yaml", "kinematics:\n  shoulder: {x: 0}", "kinematics.shoulder.y"),
        ("c.yaml", "kinematics: !!int ''", "not YAML"),
        ("c.yaml", "kinematics: !!bool x", "not YAML"),
        ("c.yaml", "kinematics: !!timestamp x", "not YAML"),
        ("c.yaml", UR3.replace("x: 0.0", "x: true", 1), "kinematics.shoulder.x true"),
        ("c.yaml", UR5, "another robot"),
    ],
)
def test_wrong_files_give_one_line(file, text, parts):
    with refused(f"{file} {parts}"):
        calibrated_from(ROBOTS["ur3"], file, text)


def test_a_calibration_of_another_robot_is_refused():
    assert calibrated_from(ROBOTS["ur3"], "c.conf", conf(REAL)) is not ROBOTS["ur3"]
    with refused("c.conf ur10 another robot"):
        calibrated_from(ROBOTS["ur10"], "c.conf", conf(REAL))
    with refused("panda"):
        calibrated_from(ROBOTS["panda"], "c.conf", conf(NONE))


SETUP = Setup((Ring("forearm", 0.5, 6, 0.2, 0.0, 0.1), Ring("tool", 0.0, 6, 0.0, 0.0, 0.1)))


def test_scenes_and_proposals_keep_the_calibration(tmp_path):
    (tmp_path / "calibration.conf").write_text(conf(REAL))
    (tmp_path / "scene.toml").write_text('robot = "ur3"\ncalibration = "calibration.conf"\n')
    scene = read_scene(tmp_path / "scene.toml")
    assert scene.robot.calibration.source == "calibration.conf"
    text = to_toml(ProposalFile.of(SETUP, scene))
    assert 'robot = "ur3"' in text
    (tmp_path / "proposal.toml").write_text(text)
    _, again, _ = read_proposal(tmp_path / "proposal.toml")
    assert np.allclose(again.robot.chain.origin, scene.robot.chain.origin, rtol=0, atol=1e-12)
    assert again.robot.nominal.chain is ROBOTS["ur3"].chain
    assert read_scene(tmp_path / "scene.toml", ROBOTS["ur5"]).robot.calibration is None
    (tmp_path / "wrong.toml").write_text('calibration = "calibration.conf"\n')
    with refused("calibration.conf ur10"):
        read_scene(tmp_path / "wrong.toml")
    (tmp_path / "proposal.toml").write_text(text.replace('"ur3"', '"ur10"'))
    with refused("proposal.toml scene.calibration"):
        read_proposal(tmp_path / "proposal.toml")


def test_the_effect_is_that_of_the_two_robots():
    robot = calibrated_from(ROBOTS["ur3"], "c.conf", conf(REAL))
    scene = replace(Scene(), robot=robot)
    (effect,) = calibration_effect(Verifier(scene, 0.05), SETUP)
    model = replace(scene, robot=ROBOTS["ur3"])
    (goal,) = scene.targets
    assert effect.nominal == Verifier(model, 0.05).verify(SETUP, goal.target).zeta
    assert 5e-4 < effect.largest_move == largest_move(scene, SETUP) < 5e-3
    assert calibration_effect(Verifier(model, 0.05), SETUP) == []


def test_verify_states_what_a_calibration_changes(run, tmp_path):
    file = tmp_path / "calibration.conf"
    file.write_text(conf(REAL))
    words = ["verify", "n1_8_10", "--robot", "ur3", "--voxel", "0.1"]
    result = json.loads(run(*words, "--json", "--calibration", file)[1])
    model = json.loads(run(*words, "--json")[1])
    assert result["calibration"]["nominal_percent"] == model["zeta_percent"]
    assert 0.5 < result["calibration"]["largest_move_mm"] < 5
    assert model["calibration"] is None
    assert "calibration.conf" in run(*words, "--calibration", file)[1]


@settings(max_examples=10, deadline=None)
@given(small, poses(), st.sampled_from(ARMS))
def test_a_controllers_table_has_the_kinematics_of_its_robot(deltas, q, name):
    """Whatever the table is: nearly parallel axes have any normal, so the rows may differ."""
    deltas[[1, 3], 5] = 0
    model = ROBOTS[name]
    own = model.calibrated(
        calibrated_chain(model.chain, (dh_table(model.chain) + DhTable(*deltas)).origin), ""
    )
    table = controller_table(own)
    wanted = dh_product(dh_table(model.chain) + DhTable(*deltas), q)
    assert np.allclose(dh_product(table, q), wanted, rtol=0, atol=1e-7)
    again = calibrated_chain(model.chain, table.origin)
    assert np.allclose(again.origin, own.chain.origin, rtol=0, atol=1e-7)


@pytest.mark.parametrize("name", ARMS)
def test_a_controllers_table_without_calibration_is_the_makers(name):
    robot = ROBOTS[name]
    tables = controller_table(robot).origin, dh_table(robot.chain).origin
    assert np.allclose(*tables, rtol=0, atol=1e-12)


@pytest.mark.parametrize("one", ARMS)
def test_a_controllers_table_of_another_model_is_refused(one):
    twins = {"ur10": "ur10_dh", "ur10_dh": "ur10"}
    chain = ROBOTS[one].chain
    for other in ARMS:
        if other in (one, twins.get(one)):
            assert calibrated_chain(chain, dh_table(ROBOTS[other].chain).origin) is not None
        else:
            with pytest.raises(ValueError, match="another robot"):
                calibrated_chain(chain, dh_table(ROBOTS[other].chain).origin)
