"""The twin in MuJoCo: against the rig's simulated rings, closed forms, and in a model of one's
own."""

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import place_rings as pr
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.sensors.effective_range import Use
from place_rings.coverage.sensors.sensor import PAPER_SENSOR, effective
from place_rings.formats.export.mjcf import mjcf
from place_rings.formats.export.placed import PlacedSetup
from place_rings.formats.ring_status import Status
from place_rings.rig.simulated_cell.world import World

from ..rig.cell import SCENE, SETUP, SQUARE
from ..strategies.rings import poses
from ..support.refusals import refused

few = settings(max_examples=4, deadline=None)
L5CX = effective(Use("vl53l5cx")).sensor
EMPTY = pr.Scene(robot="ur10")


def with_sensors(sensor, **keys):
    """The rig's rings with another sensor."""
    return replace(SETUP, rings=tuple(replace(r, sensor=sensor, **keys) for r in SETUP.rings))


def one_ahead(sensor=PAPER_SENSOR, **options):
    """A twin of one sensor that looks along the tool, and the pose of its beam."""
    setup = pr.Setup((pr.Ring("tool", 0.0, 1, radius=0.08, sensor=sensor),))
    twin = pr.twin(setup, EMPTY, mask="scene", **options)
    return twin, twin.world.apex[0].copy(), twin.world.frame[0].copy()


TURNED = {"zone_turn_deg": 90, "zone_mirrored": True}


@few
@given(poses(), st.sampled_from([{}, TURNED]))
def test_zones_read_what_the_rings_of_the_simulated_rig_do(q, keys):
    """Both cast the same rays; a ray that grazes an edge may hit for one of them only."""
    setup = with_sensors(L5CX, **keys)
    twin = pr.twin(setup, SCENE, noise=None)
    frame = twin.reset(q)
    rings = [World(SCENE, setup).zones(r, q[None])[0] for r in range(len(setup.rings))]
    rig = 1000 * np.concatenate([ring.reshape(len(ring), 64, 2) for ring in rings])
    free = rig.min(axis=(1, 2)) > 0  # inside a body the rig reads 0, and MuJoCo sees out of it
    mine = np.nan_to_num(frame.targets_mm[free, :, :2], nan=np.inf)
    same = np.isclose(mine, rig[free], rtol=0, atol=1e-2)
    assert same.mean() > 0.998


@settings(max_examples=4, deadline=None)
@given(poses(), st.sampled_from([PAPER_SENSOR, SQUARE]))
def test_a_sensor_of_one_zone_reads_no_less_than_the_nearest_point_in_its_beam(q, sensor):
    """The rig finds that point; the twin has rays, and sees it as far as one meets it."""
    setup = with_sensors(sensor)
    rig = 1000 * World(SCENE, setup).distances(q[None])[0]
    twin = pr.twin(setup, SCENE, noise=None).reset(q).distance_mm[:, 0]
    free = rig > 0
    twin, rig = np.nan_to_num(twin[free], nan=np.inf), rig[free]
    assert (rig <= twin + 1e-2).all()
    assert np.isclose(twin, rig, rtol=0.02).mean() > 0.7


@few
@given(st.floats(0.2, 1.3), st.integers(0, 80))
def test_a_wall_is_read_at_its_distance_and_by_its_slant(depth, turn_deg):
    """The nearest ray to a wall across the beam is its middle one; a slanted one is nearest at the
    edge."""
    twin, apex, frame = one_ahead(SQUARE, noise=None, bodies=[pr.Box((9, 9, 0.002))])
    half = SQUARE.half_angle
    slant = np.radians(min(turn_deg, 90 - np.degrees(half) - 5))
    turn = np.array(
        [[np.cos(slant), 0, np.sin(slant)], [0, 1, 0], [-np.sin(slant), 0, np.cos(slant)]]
    )
    twin.put(0, apex + depth * frame[:, 2], frame @ turn)
    edge = min(slant, half)
    wanted = (depth * np.cos(slant) - 0.001) / np.cos(slant - edge)
    distance = twin.step(twin.q), twin.step(twin.q)
    assert distance[1].distance_mm[0, 0] == pytest.approx(1000 * wanted, rel=2e-3)


@few
@given(st.lists(st.floats(0.001, 0.2), min_size=5, max_size=30), st.booleans())
def test_a_reading_is_one_to_two_periods_old_and_of_a_moment_of_its_sensor(steps, scheduled):
    twin = pr.twin("n1_8_0", EMPTY, scheduled=scheduled)
    period, first = twin.clock
    gap = 0.0
    for seconds in steps:
        frame = twin.step(twin.q, seconds)
        gap, age = max(gap, seconds), twin.data.time - frame.time
        assert (age >= period - 1e-6).all()
        assert (age <= 2 * period + gap + 1e-6).all()
        measured = frame.time > 0
        turns = ((frame.time - first) / period)[measured]
        np.testing.assert_allclose(turns, np.round(turns), atol=1e-6)


def test_a_body_that_comes_is_read_when_the_frame_of_that_time_arrives():
    twin, apex, frame = one_ahead(noise=None, bodies=[pr.Sphere(0.05, centre=(0, 0, 9))])
    period, seen = twin.dt, []
    for i in range(6):
        if i == 2:
            twin.put(0, apex + 0.5 * frame[:, 2])
        reading = twin.step(twin.q)
        seen.append((round(float(reading.time[0]) / period), reading.distance_mm[0, 0]))
    assert [number for number, _ in seen] == [0, 1, 2, 3, 4, 5]
    assert np.isnan([mm for number, mm in seen if number < 3]).all()
    assert [mm for number, mm in seen if number >= 3] == pytest.approx([450] * 3)


@few
@given(st.floats(0.3, 0.8), st.floats(0.0, 0.4), st.floats(0.02, 0.1))
def test_a_capsule_is_read_at_its_nearer_end(depth, length, radius):
    _, apex, frame = one_ahead()
    ends = (tuple((apex + d * frame[:, 2]).tolist()) for d in (depth, depth + length))
    twin, _, _ = one_ahead(noise=None, bodies=[pr.Capsule(*ends, radius)])
    assert twin.read().distance_mm[0, 0] == pytest.approx(1000 * (depth - radius), abs=0.1)


def test_noise_is_that_of_the_rig_and_the_same_for_the_same_seed():
    noise = pr.Noise(lost=0.1)
    twin, apex, frame = one_ahead(noise=noise, bodies=[pr.Box((9, 9, 0.002))], seed=3)

    def run():
        twin.put(0, apex + 1.001 * frame[:, 2], frame)
        frames = [twin.step(twin.q) for _ in range(602)][2:]
        return np.array([f.distance_mm[0, 0] for f in frames]), frames

    mm, frames = run()
    lost = np.isnan(mm)
    assert [f.status[0, 0] for f in frames] == np.where(lost, Status.NO_TARGET, 0).tolist()
    assert lost.mean() == pytest.approx(0.1, abs=0.04)
    assert mm[~lost].std() == pytest.approx(1000 * float(noise.at(np.array([1.0]))[0]), rel=0.1)
    np.testing.assert_allclose(mm[~lost], np.round(mm[~lost]), atol=1e-6)
    twin.reset(seed=3)
    np.testing.assert_array_equal(run()[0], mm)


@few
@given(poses())
def test_masked_links_are_not_read_but_hide_what_is_behind_them(q):
    setup = with_sensors(L5CX)
    mine = {
        mask: np.nan_to_num(
            pr.twin(setup, SCENE, noise=None, mask=mask).reset(q).distance_mm, nan=np.inf
        )
        for mask in ("nothing", "robot", "scene")
    }
    assert (mine["nothing"] <= mine["robot"]).all()
    assert np.isinf(mine["scene"]).all()
    bare = replace(SCENE, robot=replace(SCENE.robot, bodies=(), carried=()))
    through = np.nan_to_num(pr.twin(setup, bare, noise=None).reset(q).distance_mm, nan=np.inf)
    assert (through <= mine["robot"] + 1e-6).all()


def own_model(tmp_path, robot="ur10", turn=(1.0, 0.0, 0.0, 0.0), pos=(0.0, 0.0, 0.0)):
    """An MJCF file with an arm, under other names, that stands somewhere."""
    scene = pr.Scene(robot=robot)
    arm = mujoco.MjSpec.from_string(
        mjcf(PlacedSetup(scene, pr.Setup.named("n1_4_0"), 0, Path()))["scene.xml"].decode()
    )
    for key in list(arm.keys):
        arm.delete(key)
    spec = mujoco.MjSpec()
    spec.option.gravity = arm.option.gravity
    spec.worldbody.add_frame(pos=pos, quat=turn).attach_body(arm.body("base_link"), "left_", "")
    path = tmp_path / f"{robot}.xml"
    spec.compile()
    path.write_text(spec.to_xml())
    return path, [f"left_{name}" for name in scene.robot.chain.joints]


@few
@given(poses(), poses(), st.tuples(*[st.floats(-1, 1)] * 3))
def test_an_arm_of_ones_own_reads_the_same_wherever_it_stands(tmp_path_factory, q, turn, pos):
    w, x, y, z = np.array([*turn[:4]]) / max(np.linalg.norm(turn[:4]), 1e-9)
    quat = (w, x, y, z) if np.any(turn[:4]) else (1.0, 0.0, 0.0, 0.0)
    path, joints = own_model(tmp_path_factory.mktemp("own"), turn=quat, pos=pos)
    setup = with_sensors(L5CX)
    own = pr.twin(setup, EMPTY, model=path, joints=joints, noise=None)
    mine = pr.twin(setup, EMPTY, noise=None)
    frames = [np.nan_to_num(t.reset(q).distance_mm, nan=np.inf) for t in (own, mine)]
    assert np.isclose(*frames, rtol=0, atol=0.05).mean() > 0.998


@few
@given(poses(), st.sampled_from(["ur5e", "ur10", "ur10_dh"]), st.tuples(*[st.floats(-1, 1)] * 3))
def test_both_base_frames_of_a_ur_arm_give_equal_readings(q, robot, place):
    """A ball that is turned with the cell, a wall, and a camera of the cell; without noise."""
    camera = pr.MountedSensor("base", (1.2, 0.3, 0.9), (-8, -2, -5), L5CX, (0, 0, 1))
    wall = pr.Obstacle("wall", centre=(0.9, 0.4, 0.5), size=(0.1, 1.0, 0.7), rpy_deg=(0, 10, 20))
    scene = pr.Scene(robot=robot, sensor=L5CX, obstacles=[wall], cell_sensors=[camera])
    setup = pr.Setup((pr.Ring("forearm", 0.5, 3, sensor=L5CX),))
    frames = []
    for base, half in (("base_link", robot == "ur10_dh"), ("pendant", robot != "ur10_dh")):
        turned = -1 if half else 1
        ball = pr.Sphere(0.2, centre=(turned * place[0], turned * place[1], place[2]))
        twin = pr.twin(setup, scene, bodies=[ball], base_frame=base, noise=None)
        frames.append((twin.reset(q), twin.world.apex * (turned, turned, 1)))
    (one, apex), (other, same) = frames
    np.testing.assert_allclose(apex, same, atol=1e-9)
    equal = np.isclose(one.targets_mm, other.targets_mm, atol=1e-5, equal_nan=True)
    assert equal.mean() > 0.9999  # but for rays that graze an edge
    assert np.isfinite(one.distance_mm[-1]).any()


def test_a_base_frame_that_a_robot_or_a_model_does_not_have_is_refused(tmp_path):
    with refused("base_frame pendant", error=pr.InputError):
        pr.twin("n1_8_0", pr.Scene(robot="panda"), base_frame="pendant")
    with refused("base_frame model", error=pr.InputError):
        pr.twin("n1_8_0", model="cell.xml", base_frame="pendant")


def test_physics_of_a_model_of_ones_own_drive_its_readings(tmp_path):
    path, joints = own_model(tmp_path)
    twin = pr.twin(with_sensors(L5CX), EMPTY, model=path, joints=joints)
    number = 0
    while twin.data.time < 0.5:
        mujoco.mj_step(twin.model, twin.data)
        frame, number = twin.read(), number + 1
    assert number > 100
    assert (frame.time > 0.5 - 2 * twin.clock.period - 0.01).all()
    mujoco.mj_resetData(twin.model, twin.data)
    assert (twin.read().time <= 0).all()


def test_a_model_with_another_arm_or_other_joints_is_refused(tmp_path):
    path, joints = own_model(tmp_path, "ur5e")
    for model, names, argument in (
        (path, joints, "model"),  # the scene's arm is a UR10
        (path, None, "model"),  # there is no such joint
        (path, joints[:3], "joints"),
        (tmp_path / "none.xml", None, "model"),
        (3, None, "model"),
    ):
        with pytest.raises(pr.InputError) as error:
            pr.twin("n1_4_0", EMPTY, model=model, joints=names)
        assert error.value.argument == argument
    for wrong in ("abcdef", [1, 2, 3, 4, 5, 6], 6):
        with pytest.raises(pr.InputError, match="joints"):
            pr.twin("n1_4_0", EMPTY, model=path, joints=wrong)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("pose", 3),
        ("bodies", [pr.Cone(1, 0, 1)]),
        ("bodies", pr.Sphere(0.1)),
        ("joints", ["a"] * 6),  # without a model
        ("noise", 3),
        ("mask", "all"),
    ],
)
def test_an_option_out_of_range_is_named(key, value):
    with pytest.raises(pr.InputError) as error:
        pr.twin("n1_4_0", EMPTY, **{key: value})
    assert error.value.argument == key


def test_a_twin_refuses_what_it_cannot_do_and_stays_as_it_is():
    twin = pr.twin("n1_4_0", EMPTY, bodies=[pr.Sphere(0.1)])
    before = twin.data.time, *twin.data.qpos, *twin.data.mocap_pos.ravel()
    still = [0.0] * 6
    for wrong in ([0.0] * 5, [[0.0] * 6], [np.nan] * 6, ["a"] * 6):
        with pytest.raises(pr.InputError):
            twin.step(wrong)
    for seconds in (-0.1, np.nan, np.inf):
        with pytest.raises(pr.InputError):
            twin.step(still, seconds)
    for put in (
        (1, (0, 0, 1)),
        (-1, (0, 0, 1)),
        (0, (0, 0)),
        (0, (0, 0, np.inf)),
        (0, (0, 0, 1), np.eye(2)),
        (0, (0, 0, 1), -np.eye(3)),
    ):
        with pytest.raises(pr.InputError):
            twin.put(*put)
    with pytest.raises(pr.InputError):
        twin.reset(seed=-1)
    assert before == (twin.data.time, *twin.data.qpos, *twin.data.mocap_pos.ravel())
    with pytest.raises(pr.InputError):
        pr.twin("n1_4_0", EMPTY).put(0, (0, 0, 1))
