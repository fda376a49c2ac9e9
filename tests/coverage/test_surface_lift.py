"""Sensors that lie flush in a body of their own link are lifted along their axes to its surface."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.occlusion.occluders import INSIDE
from place_rings.coverage.rings.mounted_sensor import MountedSensor
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.rings.surface_lift import CLEAR, lift_to_surface
from place_rings.coverage.robots.attached import Attached
from place_rings.coverage.robots.built_in import ROBOTS, UR10
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.link_bodies import robot_capsules
from place_rings.coverage.solids.polyhedra import box
from place_rings.formats.schema.proposal_models import ProposalFile
from place_rings.objectives.scene import Pose, Scene
from place_rings.objectives.verify import Verifier

from ..strategies.singles import singles

LIMIT = 0.2  # m
PANDA = ROBOTS["panda"]


def gap_on_link(robot, one, points, q):
    """Signed distance (N,) of points (N, 3) on a sensor's link from the bodies that move with it,
    measured in the base frame at a pose."""
    frames = np.asarray(forward(robot.chain, q))
    at = robot.frame_of(one.link)
    T = np.eye(4) if at < 0 else frames[at]
    there = points @ T[:3, :3].T + T[:3, 3]
    own = [i for i, b in enumerate(robot.bodies) if b.frame == min(at, len(robot.chain) - 1)]
    if not own:
        return np.full(len(points), np.inf)
    return np.asarray(robot_capsules(robot, frames).distance(there[:, None]))[:, own].min(axis=1)


@given(singles((*PANDA.links, *PANDA.chain.joints, "tcp", "base")), st.integers(0, 2**31))
def test_a_sensor_moves_to_the_first_place_outside_of_its_links_bodies(one, seed):
    rng = np.random.default_rng(seed)
    q = rng.uniform(-1.5, 1.5, len(PANDA.chain))
    # near the link, so that many lie inside
    one = replace(one, position=tuple((np.array(one.position) / 8).tolist()))
    new, lifts = lift_to_surface(PANDA, Setup((), (one,)), LIMIT)
    moved, look = new.singles[0], one.T_link_sensor[:3, 2]
    start = float(gap_on_link(PANDA, one, np.array([one.position]), q)[0])
    assert bool(lifts) == (start <= 1e-6)
    if not lifts or not lifts[0].lifted:
        assert moved == one
        if lifts:  # every place up to the limit is inside
            t = np.linspace(0, LIMIT, 400)[:, None]
            assert (gap_on_link(PANDA, one, one.position + t * look, q) < 2 * CLEAR).all()
        return
    assert 0 < moved.lifted == lifts[0].distance <= LIMIT
    np.testing.assert_allclose(moved.position, one.position + moved.lifted * look, atol=1e-12)
    assert replace(moved, position=one.position, lifted=0.0) == one
    end = float(gap_on_link(PANDA, one, np.array([moved.position]), q)[0])
    assert CLEAR - 1e-9 < end < CLEAR + 1e-7
    t = np.linspace(0, moved.lifted - 1e-6, 400)[:, None]
    assert (gap_on_link(PANDA, one, one.position + t * look, q) < CLEAR).all()
    again, none = lift_to_surface(PANDA, new, LIMIT)
    assert (again, none) == (new, ())


def test_a_pad_across_a_capsule_moves_by_what_the_radius_says():
    body = next(b for b in UR10.bodies if b.frame == UR10.frames["elbow"])
    start, end = np.asarray(body.capsule.start), np.asarray(body.capsule.end)
    along = (end - start) / np.linalg.norm(end - start)
    out = np.cross(along, [0.3, 1.0, 0.2])
    out /= np.linalg.norm(out)
    alone = replace(UR10, bodies=(body,), tube_links=None, joint_links=None)
    pad = MountedSensor("elbow", tuple((start + end) / 2 + 0.01 * out), tuple(7 * out), name="pad")
    _, (lift,) = lift_to_surface(alone, Setup((), (pad,)), LIMIT)
    assert lift.distance == pytest.approx(body.capsule.radius - 0.01 + CLEAR, abs=1e-8)
    assert (lift.body, lift.sensor.name) == (body.name, "pad")
    near = body.capsule.radius - 0.01
    assert lift_to_surface(alone, Setup((), (pad,)), near - 1e-3)[0].singles == (pad,)
    assert not lift_to_surface(alone, Setup((), (pad,)), near - 1e-3)[1][0].lifted


def test_a_box_that_the_link_carries_is_left_too():
    plate = Attached("plate", "tcp", box([0, 0, 0.1], [0.2, 0.2, 0.2], np.eye(3)))
    robot = UR10.with_attached((plate,))
    one = MountedSensor("tcp", (0, 0, 0.05), (0, 0, 1))
    _, (lift,) = lift_to_surface(robot, Setup((), (one,)), LIMIT)
    assert lift.body == "plate"
    assert lift.distance == pytest.approx(0.15 + CLEAR, abs=1e-8)


def test_a_ring_of_which_a_sensor_moves_becomes_single_sensors():
    tight, wide = Ring("forearm", 0.5, 6, 0.1, radius=0.02), Ring("forearm", 0.5, 6, radius=0.3)
    new, lifts = lift_to_surface(UR10, Setup((tight, wide)), LIMIT)
    assert new.rings == (wide,)
    assert len(new.singles) == len(lifts) == 6
    q = UR10.rest
    before, after = (sensor_cones(UR10, s, q) for s in (Setup((tight,)), Setup((), new.singles)))
    shift = np.array([one.lifted for one in new.singles])[:, None]
    np.testing.assert_allclose(after.axis, before.axis, atol=1e-12)
    np.testing.assert_allclose(after.apex, before.apex + shift * before.axis, atol=1e-12)


def test_a_lifted_sensor_sees_and_only_its_pose_decides():
    """The count is that of a sensor which was put there; the file states how far it moved."""
    scene = Scene(robot=UR10, poses=(Pose(UR10.rest),), occlusion="shadow")
    flush = Setup((), (MountedSensor("forearm", (0.03, 0, 0.3), (1, 0, 0)),))
    target = scene.targets[0].target
    lifted, _ = lift_to_surface(scene.robot, flush, LIMIT)
    there = Setup((), (replace(lifted.singles[0], lifted=0.0),))
    zeta = [Verifier(scene, 0.03).verify(s, target).zeta for s in (flush, lifted, there)]
    assert zeta[0] == 0 < zeta[1] == zeta[2]
    proof = Verifier(scene, None, "certified", 0.02).verify(lifted, target)
    assert proof.low <= Verifier(scene, 0.01).verify(lifted, target).zeta + 0.005
    file = ProposalFile.of(lifted, scene)
    assert file.sensors[0].lifted == pytest.approx(lifted.singles[0].lifted, abs=1e-9)
    assert file.setup(scene).singles[0].lifted == pytest.approx(lifted.singles[0].lifted, abs=1e-8)
    gap = np.asarray(
        robot_capsules(scene.robot, forward(scene.robot.chain, UR10.rest)).distance(
            sensor_cones(scene.robot, lifted, UR10.rest).apex[:, None]
        )
    )
    assert gap.min() > INSIDE


def flush_csv(path):
    """A list with a sensor inside the forearm of the reference scene, written to a file."""
    scene = Scene()
    one = Setup((), (MountedSensor("forearm", (0.03, 0, 0.3), (1, 0, 0)),))
    from place_rings.formats.sensors.sensor_lists import sensor_list

    path.write_text(sensor_list(one, scene), encoding="utf-8")
    return path


def test_the_command_says_which_sensor_it_lifted(run, tmp_path):
    file = str(flush_csv(tmp_path / "pad.csv"))
    where = ("verify", file, "--target", "V_S:0.5", "--voxel", "0.05")
    code, out, err = run(*where, "--lift-to-surface", "50", "--json")
    record = json.loads(out)
    assert code == 0
    assert record["lifted"][0]["lifted_mm"] > 0 == len(record["unseeing"])
    code, out, err = run(*where, "--lift-to-surface", "1", "--json")
    assert code == 0
    assert "1 mm" in err
    record = json.loads(out)
    assert record["lifted"] == []
    assert len(record["unseeing"]) == 1
    for wrong in ("0", "-3", "nan", "5000"):
        code, out, err = run(*where, f"--lift-to-surface={wrong}")
        assert (code, out) == (2, "")
        assert "--lift-to-surface" in err
        assert err.splitlines()[-1].startswith("place-rings: ")
    assert math.isfinite(record["zeta_percent"])
