"""Exports of rings and single sensors, alone and together: each file is read by its own reader, and
the poses of single sensors are those composed here from what the setup states.
"""

import io
import json
import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest
import trimesh
import yaml
import yourdfpy
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.rings.mounted_sensor import MountedSensor
from place_rings.coverage.rings.ring import Setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.robots.built_in import ROBOTS
from place_rings.formats.loader import resolve
from place_rings.formats.sensors.sensor_frames import sensor_frames
from place_rings.objectives.scene import Pose, Scene
from scipy.spatial.transform import Rotation

from ..strategies.singles import CELL_SENSORS, mixed, mixed_setups, singles
from ..support import drawing
from .test_exports import CLOSE, in_base, turned, written
from .test_exports import same as same_beams

few = settings(max_examples=5)
NO_RING = Setup()
setups = mixed_setups() | st.builds(
    mixed, st.just(NO_RING), st.lists(singles(), min_size=1, max_size=4)
)
seeds = st.integers(0, 2**16)


def drawn(seed, cell=()):
    robot, rng = ROBOTS["ur10"], np.random.default_rng(seed)
    poses = (Pose(robot.rest), Pose(drawing.pose(rng, len(robot.chain))))
    return Scene.paper(robot=robot, poses=poses, cell_sensors=cell)


def own_frame(one: MountedSensor) -> np.ndarray:
    """Position, beam (z) and ``up`` (y) of a sensor on its link; y is free for a round beam."""
    z = np.array(one.direction) / np.linalg.norm(one.direction)
    up = np.array(one.up) if one.up is not None else np.cross(z, [0.3, 0.5, 0.7])
    y = up - (up @ z) * z
    y /= np.linalg.norm(y)
    T = np.eye(4)
    T[:3] = np.column_stack([np.cross(y, z), y, z, one.position])
    return T


def link_frame(robot, link, q) -> np.ndarray:
    """The frame of a link by its own chain of products."""
    T = np.eye(4)
    for j in range(robot.frames[link] + 1 if link != "base" else 0):
        T = T @ robot.chain.origin[j]
        if j < len(q):
            turn = np.eye(4)
            turn[:3, :3] = Rotation.from_rotvec(q[j] * robot.chain.axis[j]).as_matrix()
            T = T @ turn
    return T


def expected(scene, setup, q) -> dict[str, tuple[MountedSensor, np.ndarray]]:
    """Each single sensor, and each of the cell, by its name in the files, with its pose."""
    each = enumerate((*setup.singles, *scene.cell_sensors), start=len(setup.rings))
    return {
        f"tof_{i}_0": (one, link_frame(scene.robot, one.link, q) @ own_frame(one))
        for i, one in each
    }


def same(T, there, one, beam="z", up="y") -> None:
    """Apex and beam agree and, where the beam is not round, ``up`` too."""
    look, above = ("xyz".index(axis) for axis in (beam, up))
    np.testing.assert_allclose(T[:3, 3], there[:3, 3], atol=CLOSE)
    np.testing.assert_allclose(T[:3, look], there[:3, 2], atol=CLOSE)
    if one.up is not None:
        np.testing.assert_allclose(T[:3, above], there[:3, 1], atol=CLOSE)


@few
@given(seed=seeds, setup=setups, cell=CELL_SENSORS)
def test_urdf_and_mjcf_have_all_sensors_where_they_are(tmp_path_factory, seed, setup, cell):
    scene, folder = drawn(seed, cell), tmp_path_factory.mktemp("robot")
    q = scene.poses[-1].q
    written(folder, scene, setup, "urdf", "mjcf")
    peer = yourdfpy.URDF.load(str(folder / "robot.urdf"), load_meshes=False)
    peer.update_cfg(dict(zip(scene.robot.chain.joints, q, strict=True)))
    model = mujoco.MjModel.from_xml_path(str(folder / "scene.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_kinematics(model, data)
    np.testing.assert_allclose(data.qpos, q, atol=1e-11)
    beams = sensor_cones(scene.robot, Setup(setup.rings), q) if setup.rings else None
    for k, s in enumerate(sensor_frames(scene.robot, Setup(setup.rings))):
        site = data.site(s.name)
        np.testing.assert_allclose(site.xpos, beams.apex[k], atol=CLOSE)
        np.testing.assert_allclose(site.xmat.reshape(3, 3)[:, 2], beams.axis[k], atol=CLOSE)
        assert model.sensor(s.name).cutoff[0] == pytest.approx(s.unit.range_m)
    for name, (one, there) in expected(scene, setup, q).items():
        same(peer.get_transform(name, "base_link"), there, one, "x", "z")
        site = np.eye(4)
        site[:3, :3] = data.site(name).xmat.reshape(3, 3)
        site[:3, 3] = data.site(name).xpos
        same(site, there, one)
        assert model.sensor(name).cutoff[0] == pytest.approx(one.sensor.range_m)


@few
@given(seed=seeds, setup=setups, cell=CELL_SENSORS)
def test_ros_xacro_and_glb_have_them_too(tmp_path_factory, seed, setup, cell):
    scene, folder = drawn(seed, cell), tmp_path_factory.mktemp("ros")
    q, robot = scene.poses[-1].q, scene.robot
    written(folder, scene, setup, "ros2", "urdf", "glb")
    listed = yaml.safe_load((folder / "static_transforms.yaml").read_text())["transforms"]
    published = {one["child"]: one for one in listed}
    macro = (folder / "sensors.xacro").read_text()
    made = trimesh.load(io.BytesIO((folder / "scene.glb").read_bytes()), file_type="glb")
    down = np.linalg.inv(made.graph["base_link"][0])
    parents = {f"{joint}_link": joint for joint in robot.chain.joints} | {"base_link": "base"}
    for name, (one, there) in expected(scene, setup, q).items():
        said = published[name]
        T = np.eye(4)
        T[:3, :3] = np.stack([turned(said["xyzw"], e) for e in np.eye(3)], axis=1)
        T[:3, 3] = said["xyz"]
        same(link_frame(robot, parents[said["parent"]], q) @ T, there, one, "x", "z")
        assert f'name="${{prefix}}{name}_joint"' in macro
        same(down @ made.graph[name][0], there, one)
        number = name.split("_")[1]
        beam = made.geometry[f"sensor_{number}_sees"]
        assert np.isfinite(beam.vertices).all()
        far = np.linalg.norm(beam.vertices - (down @ made.graph[name][0])[:3, 3], axis=1).max()
        assert far <= 10 * one.sensor.range_m


@few
@given(seed=seeds, setup=setups)
def test_tables_come_back(tmp_path_factory, seed, setup):
    scene, folder = drawn(seed), tmp_path_factory.mktemp("tables")
    written(folder, scene, setup, "csv", "json")
    q = scene.poses[-1].q
    stated = json.loads((folder / "sensors.json").read_text())["sensors"]
    for one, (name, (_, there)) in zip(stated, expected(scene, setup, q).items(), strict=True):
        assert one["name"] == name
        np.testing.assert_allclose(one["base_xyz"], there[:3, 3], atol=CLOSE)
        np.testing.assert_allclose(turned(one["base_xyzw"], [0, 0, 1]), there[:3, 2], atol=CLOSE)
    for file in ("sensors.csv", "sensors.json"):
        back = resolve(str(folder / file), scene)[0]
        if setup.rings:
            same_beams(scene, Setup(setup.rings), Setup(back.rings))
            assert [r.link for r in back.rings] == [r.link for r in setup.rings]
        assert len(back.singles) == len(setup.singles)
        for one, again in zip(setup.singles, back.singles, strict=True):
            wanted = link_frame(scene.robot, one.link, q) @ own_frame(one)
            read = link_frame(scene.robot, again.link, q) @ own_frame(again)
            same(read, wanted, one if one.sensor.oriented else replace(one, up=None))
            assert again.sensor.shape == one.sensor.shape
            assert again.sensor.range_m == pytest.approx(one.sensor.range_m)
            assert again.sensor.fov == pytest.approx(one.sensor.fov)


@few
@given(seed=seeds, setup=setups, cell=CELL_SENSORS)
def test_a_glb_shows_beams_of_every_shape_by_their_extent(tmp_path_factory, seed, setup, cell):
    """A dome has its cap, a fan its sector, and no beam more than its field."""
    scene, folder = drawn(seed, cell), tmp_path_factory.mktemp("beams")
    written(folder, scene, setup, "glb")
    made = trimesh.load(io.BytesIO((folder / "scene.glb").read_bytes()), file_type="glb")
    for name, (one, there) in expected(scene, setup, scene.poses[-1].q).items():
        vertices = in_base(made, f"sensor_{name.split('_')[1]}_sees").vertices
        local = (np.linalg.inv(there) @ np.c_[vertices, np.ones(len(vertices))].T).T[:, :3]
        far, range_m, half = np.linalg.norm(local, axis=1), one.sensor.range_m, one.sensor.fov / 2
        flat = np.hypot(local[:, 0], local[:, 2])
        if one.sensor.shape == "dome":
            assert far.max() == pytest.approx(range_m, abs=CLOSE)
            assert local[:, 2].max() == pytest.approx(range_m, abs=CLOSE)
            wide = range_m * math.sin(half)
            assert np.hypot(*local[:, :2].T).max() == pytest.approx(wide, rel=0.01, abs=CLOSE)
        elif one.sensor.shape == "fan":
            assert flat.max() == pytest.approx(range_m, abs=CLOSE)
            assert np.ptp(local[:, 1]) == pytest.approx(one.sensor.thickness, abs=CLOSE)
            outer = local[flat > 0.5 * range_m]
            angles = np.arctan2(outer[:, 0], outer[:, 2])
            assert np.abs(angles).max() == pytest.approx(min(half, math.pi), abs=1e-4)
        else:
            assert local[:, 2].max() == pytest.approx(range_m, abs=CLOSE)
