"""SDFormat: a world for Gazebo with the robot, its rings and cell, and a lidar for each sensor,
which looks along its x axis and has a ray for each zone."""

import math
import xml.etree.ElementTree as ET
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from ...coverage.robots.kinematics import rpy_of
from ...coverage.sensors.effective_range import model_of
from ...coverage.sensors.sensor import Sensor
from ...coverage.solids.polyhedra import Polyhedron, box_of
from ..robots.urdf_matching import plain_names
from ..sensors.sensor_frames import SensorFrame, looking_along
from .markup import capsule_shape, document, words
from .placed import BASE_LINK, TCP_LINK, PlacedSetup
from .ring_bodies import RingBody, ring_bodies
from .urdf import mesh_name, stl_of

_VERSION = "1.11"  # of the format; Gazebo Harmonic and later read it
_SYSTEMS = {
    "physics": "Physics",
    "user-commands": "UserCommands",
    "scene-broadcaster": "SceneBroadcaster",
    "sensors": "Sensors",
}
_LEAST = 0.001, np.zeros(3), 1e-6 * np.eye(3)  # kg, m, kg m², of a link whose mass is unknown
_FREE = 1e16  # rad or m, the format's limit of a joint without limits
_FLOOR = "10 10"  # m, displayed size of the floor, which has no end
_FAN = 5  # rays across a beam of one zone, and from its top to its bottom
_FINE = math.radians(1.0)  # rad, between two rays of a fan-shaped beam, at most
_NEAR = 0.01  # m, from which on a lidar sees if nothing else is known
_RATE = 15.0  # Hz, of a sensor that states none
_CELL, _SUN, _FIXED = "cell", "sun", "fixed_base"  # names of the model, light and joint
_RINGS = 2  # visibility flag of rings, which their own sensors do not see


def sdf(placed: PlacedSetup) -> dict[str, bytes]:
    """Return ``scene.sdf``, without gravity, because masses are unknown, and the meshes of rings,
    obstacles and what is attached to the robot. Joints start at the pose."""
    root = ET.Element("sdf", version=_VERSION)
    world = ET.SubElement(root, "world", name="place_rings")
    ET.SubElement(world, "gravity").text = "0 0 0"
    for file, system in _SYSTEMS.items():
        _plugin(world, file, system)
    sun = ET.SubElement(world, "light", name=_SUN, type="directional")
    ET.SubElement(sun, "direction").text = "-0.5 0.2 -0.9"
    files = _cell(placed, world)
    files |= _robot(placed, world)
    return {"scene.sdf": document(root), **files}


def _plugin(holder: ET.Element, file: str, system: str, **parameters: str) -> None:
    keys = {"filename": f"gz-sim-{file}-system", "name": f"gz::sim::systems::{system}"}
    made = ET.SubElement(holder, "plugin", keys)
    for name, value in parameters.items():
        ET.SubElement(made, name).text = value


def _pose(holder: ET.Element, T: Float[np.ndarray, "4 4"], **of: str) -> None:
    numbers = words([*T[:3, 3], *rpy_of(T[:3, :3])])
    ET.SubElement(holder, "pose", of).text = numbers


def _cell(placed: PlacedSetup, world: ET.Element) -> dict[str, bytes]:
    """Add the obstacles as a model that does not move; return their meshes."""
    files = dict[str, bytes]()
    if not placed.scene.obstacles:
        return files
    model = ET.SubElement(world, "model", name=_CELL)
    ET.SubElement(model, "static").text = "true"
    _pose(model, placed.T_world_base)
    link = ET.SubElement(model, "link", name=_CELL)
    for i, obstacle in enumerate(placed.scene.obstacles):
        name = f"obstacle_{i}"
        if np.size(obstacle.body.edges):
            _polyhedron(link, name, obstacle.body, f"{name}.stl", files)
        else:
            T = np.eye(4)
            T[2, 3] = float(np.asarray(obstacle.body.offset)[0])
            for use in ("collision", "visual"):
                plane = _geometry(link, use, name, T, "plane")
                ET.SubElement(plane, "normal").text = "0 0 1"
                ET.SubElement(plane, "size").text = _FLOOR
    return files


def _geometry(
    link: ET.Element, use: str, name: str, T: Float[np.ndarray, "4 4"], kind: str
) -> ET.Element:
    """Add a shape of a ``kind`` at a pose (4, 4) m on a link; return its element."""
    part = ET.SubElement(link, use, name=f"{name}_{use}")
    _pose(part, T)
    return ET.SubElement(ET.SubElement(part, "geometry"), kind)


def _polyhedron(
    link: ET.Element, name: str, body: Polyhedron, file: str, files: dict[str, bytes]
) -> None:
    """Add a box as such, and any other polyhedron as the mesh ``file`` of ``files``."""
    box = box_of(body)
    for use in ("collision", "visual"):
        if box is not None:
            shape = _geometry(link, use, name, box[0], "box")
            ET.SubElement(shape, "size").text = words(box[1])
        else:
            files[file] = stl_of(body)
            ET.SubElement(_geometry(link, use, name, np.eye(4), "mesh"), "uri").text = file


def _robot(placed: PlacedSetup, world: ET.Element) -> dict[str, bytes]:
    """Add the robot: its links and joints, its bodies, rings and sensors; return its meshes."""
    robot, files = placed.scene.robot, dict[str, bytes]()
    name = plain_names([placed.robot_name], [_CELL, _SUN])[0]
    model = ET.SubElement(world, "model", name=name)
    _pose(model, placed.T_world_base)
    links, rings = (BASE_LINK, *placed.link_names), ring_bodies(placed)
    taken = [_FIXED, TCP_LINK, *links, *(n for r in rings for n in (r.name, f"{r.name}_joint"))]
    joints = plain_names(placed.joint_names, taken)  # no two parts of a model have one name
    bodies = [ET.SubElement(model, "link", name=BASE_LINK)]
    _joint(model, _FIXED, "fixed", "world", BASE_LINK)
    for j, name in enumerate(joints):
        link = ET.SubElement(model, "link", name=links[j + 1])
        _pose(link, np.eye(4), relative_to=name)
        bodies.append(link)
        _moving_joint(placed, model, j, joints, (links[j], links[j + 1]))
    names = plain_names(body.name for body in robot.bodies)
    for body, name in zip(robot.bodies, names, strict=True):
        T, length, radius = capsule_shape(body.capsule)
        for use in ("collision", "visual"):
            kind = "capsule" if length else "sphere"
            shape = _geometry(bodies[body.frame + 1], use, name, T, kind)
            ET.SubElement(shape, "radius").text = words([radius])
            if length:
                ET.SubElement(shape, "length").text = words([length])
    for i, carried in enumerate(robot.carried):
        holder = bodies[carried.frame + 1]
        _polyhedron(holder, f"attached_{i}", carried.body, mesh_name(i), files)
    for link in bodies:
        if link.find("collision") is None:
            _inertial(link, *_LEAST)
        else:
            ET.SubElement(link, "inertial", auto="true")
    for ring in rings:
        _ring(model, ring, links[ring.joint + 1])
        files[ring.file] = ring.stl()
    tcp = ET.SubElement(model, "frame", name=TCP_LINK, attached_to=links[-1])
    _pose(tcp, robot.chain.origin[-1])
    for sensor in placed.sensors:
        joint, T = placed.in_chain(sensor.frame, sensor.T_frame_sensor)
        _sensor(bodies[joint + 1], sensor, T)
    _plugin(model, "joint-state-publisher", "JointStatePublisher")
    return files


def _joint(model: ET.Element, name: str, kind: str, parent: str, child: str) -> ET.Element:
    joint = ET.SubElement(model, "joint", name=name, type=kind)
    ET.SubElement(joint, "parent").text = parent
    ET.SubElement(joint, "child").text = child
    return joint


def _moving_joint(
    placed: PlacedSetup, model: ET.Element, j: int, names: Sequence[str], links: tuple[str, str]
) -> None:
    """Add a joint of the chain between two links, and what moves it to a position that it is told
    on a topic."""
    robot, name = placed.scene.robot, names[j]
    joint = _joint(model, name, "prismatic" if robot.chain.slides[j] else "revolute", *links)
    _pose(joint, robot.chain.origin[j], relative_to=links[0])
    axis = ET.SubElement(joint, "axis")
    ET.SubElement(axis, "xyz").text = words(robot.chain.axis[j])
    limit = ET.SubElement(axis, "limit")
    limits = (-_FREE, _FREE) if robot.limits is None else np.clip(robot.limits[j], -_FREE, _FREE)
    for key, value in zip(("lower", "upper"), limits, strict=True):
        ET.SubElement(limit, key).text = words([value])
    for m in robot.chain.mimics:
        if m.joint == j:
            law = ET.SubElement(axis, "mimic", joint=names[m.leader])
            for key, value in (("multiplier", m.multiplier), ("offset", m.offset)):
                ET.SubElement(law, key).text = words([value])
            ET.SubElement(law, "reference").text = "0"
            return
    start = words([placed.scene.poses[placed.pose].q[j]])
    keys = {"joint_name": name, "initial_position": start, "use_velocity_commands": "true"}
    _plugin(model, "joint-position-controller", "JointPositionController", **keys)


def _inertial(
    link: ET.Element,
    mass: float,
    centre: Float[np.ndarray, " 3"],
    inertia: Float[np.ndarray, "3 3"],
) -> None:
    part, T = ET.SubElement(link, "inertial"), np.eye(4)
    T[:3, 3] = centre
    _pose(part, T)
    ET.SubElement(part, "mass").text = words([mass])
    moments = ET.SubElement(part, "inertia")
    for i in range(3):
        for j in range(i, 3):
            ET.SubElement(moments, f"i{'xyz'[i]}{'xyz'[j]}").text = words([inertia[i, j]])


def _ring(model: ET.Element, ring: RingBody, carrier: str) -> None:
    """Add a ring as a link with its mesh, fixed to the link that carries it."""
    link = ET.SubElement(model, "link", name=ring.name)
    _pose(link, ring.T_link_ring, relative_to=carrier)
    mass = ring.mass
    _inertial(link, *(_LEAST if mass is None else (mass.mass, mass.centre, mass.inertia)))
    for use in ("collision", "visual"):
        mesh = _geometry(link, use, ring.name, np.eye(4), "mesh")
        ET.SubElement(mesh, "uri").text = ring.file
    shown = link.find("visual")
    if shown is not None:
        ET.SubElement(shown, "visibility_flags").text = f"{_RINGS}"
    _joint(model, f"{ring.name}_joint", "fixed", carrier, ring.name)


def _sensor(link: ET.Element, sensor: SensorFrame, T: Float[np.ndarray, "4 4"]) -> None:
    """Add a lidar that looks along x; none for a beam that is no part of a cone or a plane."""
    if (grid := lidar_grid(sensor.unit)) is None:
        link.append(ET.Comment(f" {sensor.name}: a {sensor.unit.shape} has no lidar "))
        return
    unit = sensor.unit
    model = None if unit.use is None else model_of(unit.use)
    made = ET.SubElement(link, "sensor", name=sensor.name, type="gpu_lidar")
    _pose(made, looking_along(T, "x"))
    ET.SubElement(made, "topic").text = sensor.name
    ET.SubElement(made, "update_rate").text = words([(model and model.rate_hz) or _RATE])
    ET.SubElement(made, "always_on").text = "true"
    lidar = ET.SubElement(made, "lidar")
    scan = ET.SubElement(lidar, "scan")
    for way, (count, half) in zip(("horizontal", "vertical"), grid, strict=True):
        axis = ET.SubElement(scan, way)
        for key, value in (("samples", count), ("resolution", 1), ("min_angle", -half)):
            ET.SubElement(axis, key).text = words([value])
        ET.SubElement(axis, "max_angle").text = words([half])
    reach = ET.SubElement(lidar, "range")
    near = unit.near_m or (model and model.least_m) or _NEAR
    for key, value in (("min", near), ("max", unit.farthest)):
        ET.SubElement(reach, key).text = words([value])
    ET.SubElement(lidar, "visibility_mask").text = f"{2**32 - 1 - _RINGS}"


def lidar_grid(unit: Sensor) -> tuple[tuple[int, float], tuple[int, float]] | None:
    """Return the rays of a lidar across and along ``up``: how many, and the angle of the outermost
    from the axis, rad; None for a beam without a direction, as of a capacitive sensor.

    A zone has one ray, at its middle. A beam of one zone has 5 by 5, the outermost within its
    border: its reading is the nearest of them. A planar scanner has one row.
    """
    if unit.shape == "fan":
        count = math.ceil(unit.fov / _FINE) + 1
        return (count, unit.fov / 2), (1, 0.0)
    if not unit.form.ends_flat:
        return None
    halves = unit.half_angle, unit.half_angle_up
    if not unit.square:
        halves = (math.atan(math.tan(unit.half_angle) / math.sqrt(2)),) * 2
    counts = unit.zones, unit.rows
    if counts == (1, 1):
        return (_FAN, halves[0]), (_FAN, halves[1])
    across, up = (
        (n, math.atan(math.tan(half) * (1 - 1 / n))) for n, half in zip(counts, halves, strict=True)
    )
    return across, up
