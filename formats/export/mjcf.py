"""MJCF: the robot's capsules, the cell's obstacles, and a rangefinder for each sensor, which looks
along its site's z axis.

A MuJoCo rangefinder ignores the body that carries its site. Each sensor is therefore a body of its
own, welded to its link, so that it detects the link like any other body.
"""

import xml.etree.ElementTree as ET
from collections.abc import Iterator

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from ...coverage.arrays import Array
from ...coverage.robots.robot import BASE
from ..robots.urdf_matching import plain_names
from ..sensors.sensor_frames import SensorFrame, zone_ways
from .markup import ball_of, document, turn_to, words
from .placed import BASE_LINK, TCP_LINK, PlacedSetup
from .ring_bodies import ring_bodies

MOST_ZONES = 512  # of all sensors; with more, each sensor has one rangefinder
_SIZE = "0.004"  # m, displayed size of a site
# MuJoCo refuses a moving body of no mass; a thin capsule has almost none
_LEAST = {"boundmass": "1e-6", "boundinertia": "1e-9"}  # kg, kg m²
_SMALL = 1e-9  # m³, volume of a mesh below which MuJoCo may refuse to integrate over it
# inertia of a link without a body
_MASS = {"pos": "0 0 0", "mass": "0.001", "diaginertia": "1e-6 1e-6 1e-6"}


def mjcf(placed: PlacedSetup) -> dict[str, bytes]:
    """Return ``scene.xml``, without gravity and contacts, because masses are unknown; its keyframe
    is the pose."""
    robot, q = placed.scene.robot, placed.scene.poses[placed.pose].q
    root = ET.Element("mujoco", model=placed.robot_name)
    ET.SubElement(root, "compiler", _LEAST, angle="radian", autolimits="true")
    ET.SubElement(root, "option", gravity="0 0 0")
    ET.SubElement(ET.SubElement(root, "default"), "geom", contype="0", conaffinity="0")
    asset, world, sensor = (ET.SubElement(root, tag) for tag in ("asset", "worldbody", "sensor"))
    if not np.array_equal(placed.T_world_base, np.eye(4)):
        world = ET.SubElement(world, "frame", _place(placed.T_world_base))
    _obstacles(placed, asset, world)
    at = ET.SubElement(world, "body", name=BASE_LINK)
    bodies = [at]
    for j, (joint, link) in enumerate(zip(placed.joint_names, placed.link_names, strict=True)):
        at = ET.SubElement(at, "body", _place(robot.chain.origin[j]), name=link)
        limits = None if robot.limits is None else robot.limits[j]
        known = {} if limits is None or not np.isfinite(limits).all() else {"range": words(limits)}
        kind = "slide" if robot.chain.slides[j] else "hinge"
        ET.SubElement(at, "joint", known, name=joint, type=kind, axis=words(robot.chain.axis[j]))
        bodies.append(at)
        if not any(b.frame == j for b in robot.bodies):
            ET.SubElement(at, "inertial", _MASS)
    ET.SubElement(at, "site", _place(robot.chain.origin[-1]), name=TCP_LINK, size=_SIZE)
    names = list(plain_names((b.name for b in robot.bodies), _obstacle_names(placed)))
    for body, name in zip(robot.bodies, names, strict=True):
        geom = ET.SubElement(bodies[0 if body.frame == BASE else body.frame + 1], "geom", name=name)
        start, end, radius = body.capsule.arrays()
        shape = {"type": "capsule", "fromto": words([*start, *end])}
        if (ball := ball_of(body.capsule)) is not None:
            centre, radius = ball
            shape = {"type": "sphere", "pos": words(centre)}
        geom.attrib.update({**shape, "size": words([radius])})
    taken = [*names, *_obstacle_names(placed)]
    names = list(
        plain_names((f"attached_{i}_{c.name}" for i, c in enumerate(robot.carried)), taken)
    )
    for carried, name in zip(robot.carried, names, strict=True):
        _mesh(asset, name, carried.body.edges)
        holder = bodies[0 if carried.frame == BASE else carried.frame + 1]
        ET.SubElement(holder, "geom", name=name, type="mesh", mesh=name)
    few = zone_count(placed) <= MOST_ZONES
    for s in placed.sensors:
        joint_of, T = placed.in_chain(s.frame, s.T_frame_sensor)
        held = ET.SubElement(bodies[joint_of + 1], "body", _place(T), name=s.name)
        ET.SubElement(held, "site", name=s.name, size=_SIZE)
        for name, turn in _rays(s, few):
            if name != s.name:
                ET.SubElement(held, "site", _place(turn), name=name, size=_SIZE)
            finder = ET.SubElement(sensor, "rangefinder", name=name, site=name)
            finder.set("cutoff", words([s.unit.range_m / turn[2, 2]]))
    for ring in ring_bodies(placed):
        if ring.mass is not None:
            held = ET.SubElement(bodies[ring.joint + 1], "body", _place(ring.T_link_ring))
            held.set("name", ring.name)
            six = words(ring.mass.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])
            mass = {"pos": words(ring.mass.centre), "mass": words([ring.mass.mass])}
            ET.SubElement(held, "inertial", mass, fullinertia=six)
    equality = ET.SubElement(root, "equality") if robot.chain.mimics else root
    for m in robot.chain.mimics:
        follows, leads = placed.joint_names[m.joint], placed.joint_names[m.leader]
        law = words([m.offset, m.multiplier, 0.0, 0.0, 0.0])
        ET.SubElement(equality, "joint", joint1=follows, joint2=leads, polycoef=law)
    ET.SubElement(ET.SubElement(root, "keyframe"), "key", name="pose", qpos=words(q))
    return {"scene.xml": document(root)}


def zone_count(placed: PlacedSetup) -> int:
    """Return how many zones all sensors have together."""
    return sum(s.unit.rows * s.unit.zones for s in placed.sensors)


def _rays(s: SensorFrame, zones: bool) -> Iterator[tuple[str, Float[np.ndarray, "4 4"]]]:
    """Yield the rangefinders of a sensor: names, and frames (4, 4) in its own that look along z.

    A zone is named by row and column, counted from the upper left of the sensor's picture: its
    frame looks along the middle of the zone. Without ``zones`` the axis stands for all.
    """
    rows, columns = s.unit.rows, s.unit.zones
    if not zones or rows * columns == 1:
        yield s.name, np.eye(4)
        return
    ways = zone_ways(s.unit, rows, columns)
    for row, column in np.ndindex(rows, columns):
        T = np.eye(4)
        T[:3, :3] = turn_to(ways[row, column])
        yield f"{s.name}_{row}_{column}", T


def _place(T: Float[np.ndarray, "4 4"]) -> dict[str, str]:
    x, y, z, w = Rotation.from_matrix(T[:3, :3]).as_quat(canonical=True)
    return {"pos": words(T[:3, 3]), "quat": words((w, x, y, z))}


def _obstacle_names(placed: PlacedSetup) -> tuple[str, ...]:
    return plain_names(f"obstacle_{i}_{o.name}" for i, o in enumerate(placed.scene.obstacles))


def _mesh(asset: ET.Element, name: str, edges: Float[Array, "E 2 3"]) -> None:
    """Add the convex hull of a polyhedron's corners; a tiny one as a shell."""
    corners = np.unique(np.asarray(edges).reshape(-1, 3), axis=0)
    mesh = ET.SubElement(asset, "mesh", name=name, vertex=words(corners.ravel()))
    if np.prod(np.ptp(corners, axis=0)) < _SMALL:
        mesh.set("inertia", "shell")


def _obstacles(placed: PlacedSetup, asset: ET.Element, world: ET.Element) -> None:
    """Add convex obstacles as hulls of their corners, and the floor as a plane."""
    for obstacle, name in zip(placed.scene.obstacles, _obstacle_names(placed), strict=True):
        if np.size(obstacle.body.edges):
            _mesh(asset, name, obstacle.body.edges)
            ET.SubElement(world, "geom", name=name, type="mesh", mesh=name)
        else:
            height = np.asarray(obstacle.body.offset)[0]
            ET.SubElement(
                world, "geom", name=name, type="plane", size="0 0 1", pos=words((0, 0, height))
            )
