"""URDF: the robot with a link and a fixed joint for each sensor, which looks along its x axis."""

import copy
import os
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...coverage.definitions.errors import unusable
from ...coverage.definitions.field_types import FARTHEST
from ...coverage.robots.robot import BASE, Robot
from ...coverage.solids.capsules import Capsules
from ...coverage.solids.polyhedra import Polyhedron, box_of
from ..robots.urdf import LARGEST
from ..robots.urdf_matching import ROS_NAME
from ..robots.urdf_model import Urdf
from ..robots.xml_text import bounded_bytes, plain_xml
from ..sensors.sensor_frames import looking_along
from .markup import add_inertial, capsule_shape, document, origin, words
from .placed import BASE_LINK, TCP_LINK, PlacedSetup
from .ring_bodies import RingBody, hull_mesh, ring_bodies

_Shape = tuple[str, float, dict[str, str]]  # element, place along the axis in m, other sizes


def urdf(placed: PlacedSetup) -> dict[str, bytes]:
    """Return ``robot.urdf``: the user's file with the sensors and what is attached to the robot, or
    one generated from the robot's chain and bodies; with the rings' bodies, and the meshes of these
    and of what is attached.

    Raises:
        UserError: if the user's file lacks the robot's chain, or has links with the sensors' names.
    """
    rings = ring_bodies(placed)
    if placed.urdf is None:
        root = _robot(placed)
    else:
        root = _own(placed.urdf, placed.folder)
        for added in [s.name for s in placed.sensors] + [ring.name for ring in rings]:
            for kind, name, there in (
                ("link", added, placed.urdf.links),
                ("joint", f"{added}_joint", placed.urdf.joints),
            ):
                if name in there:
                    raise unusable(
                        f"{placed.urdf.path}: {kind}",
                        name,
                        "a URDF without these sensors and rings",
                    )
        _attach(root, placed, placed.urdf)
    for s in placed.sensors:
        joint, T = placed.on_link(s)
        add_sensor(root, s.name, placed.carrier(joint), T)
    if (base := placed.pendant_base) is not None:
        carrier, name, T = base
        add_inertial(ET.SubElement(root, "link", name=name))
        _fixed(root, f"{name}_joint", carrier, name, T)
    for ring in rings:
        _ring(root, ring, placed.carrier(ring.joint))
    meshes = {ring.file: ring.stl() for ring in rings}
    return {"robot.urdf": document(root), **_meshes(placed.scene.robot), **meshes}


def _ring(root: ET.Element, ring: RingBody, carrier: str) -> None:
    """Add a ring as a link with inertia and a mesh, fixed to the link that carries it."""
    link = ET.SubElement(root, "link", name=ring.name)
    if ring.mass is None:
        add_inertial(link)
    else:
        add_inertial(link, ring.mass.mass, ring.mass.centre, ring.mass.inertia)
    for use in ("visual", "collision"):
        part = ET.SubElement(ET.SubElement(link, use), "geometry")
        ET.SubElement(part, "mesh", filename=ring.file)
    _fixed(root, f"{ring.name}_joint", carrier, ring.name, ring.T_link_ring)


def _meshes(robot: Robot) -> dict[str, bytes]:
    """Return the STL files of the polyhedra that the robot carries, other than boxes."""
    return {
        mesh_name(i): stl_of(carried.body)
        for i, carried in enumerate(robot.carried)
        if box_of(carried.body) is None
    }


def mesh_name(i: int) -> str:
    """Return the name of the file of a polyhedron that the robot carries."""
    return f"attached_{i}.stl"


def stl_of(body: Polyhedron) -> bytes:
    """Return the convex hull of a polyhedron as an STL file, m."""
    return bytes(hull_mesh(body).export(file_type="stl"))


def _attach(root: ET.Element, placed: PlacedSetup, urdf: Urdf) -> None:
    """Add what is attached to the robot to the user's file: a link, fixed to the link that carries
    it, for each joint's link or base that carries something."""
    robot = placed.scene.robot
    if robot.unladen is None:
        return
    attached = replace(robot, bodies=robot.bodies[len(robot.unladen.bodies) :])
    frames = {b.frame for b in attached.bodies} | {c.frame for c in attached.carried}
    for frame in sorted(frames):
        name = attached_name(frame)
        if name in urdf.links or f"{name}_joint" in urdf.joints:
            raise unusable(f"{urdf.path}: link", name, "a URDF without this name")
        add_inertial(_link(root, name, attached, frame))
        T = np.linalg.inv(placed.T_base_root) if frame == BASE else np.eye(4)
        _fixed(root, f"{name}_joint", placed.carrier(frame), name, T)


def attached_name(frame: int) -> str:
    """Return the name of the link that holds what is attached to a frame, beside a user's URDF."""
    return "attached_base" if frame == BASE else f"attached_{frame}"


def add_sensor(root: ET.Element, name: str, parent: str, T: Float[np.ndarray, "4 4"]) -> None:
    """Add a sensor that looks along z at T (4, 4) on its link, as a frame that looks along x."""
    add_inertial(ET.SubElement(root, "link", name=name))
    _fixed(root, f"{name}_joint", parent, name, looking_along(T, "x"))


def _fixed(
    root: ET.Element, name: str, parent: str, child: str, T: Float[np.ndarray, "4 4"]
) -> ET.Element:
    joint = ET.SubElement(root, "joint", name=name, type="fixed")
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=child)
    ET.SubElement(joint, "origin", origin(T))
    return joint


def _own(urdf: Urdf, folder: Path) -> ET.Element:
    """Return the user's file, or what it expands to, with relative mesh names adapted to
    ``folder``.

    Raises:
        UserError: if it is an MJCF.
    """
    root = copy.deepcopy(urdf.expanded)
    if root is None:
        root = plain_xml(bounded_bytes(urdf.path, LARGEST), str(urdf.path), comments=True)
    if root.tag != "robot":
        raise unusable(f"{urdf.path}: root", root.tag, "robot, the root of a URDF or xacro file")
    for element in root.iter():
        name = element.get("filename")
        if (
            element.tag in ("mesh", "texture")
            and name
            and "://" not in name
            and not Path(name).is_absolute()
        ):
            element.set(
                "filename",
                Path(
                    os.path.relpath(urdf.path.resolve().parent / name, folder.resolve())
                ).as_posix(),
            )
    return root


def _robot(placed: PlacedSetup) -> ET.Element:
    """Return the robot of the scene: a link for the base, each joint and the TCP, with their
    bodies."""
    robot, joints, links = placed.scene.robot, placed.joint_names, placed.link_names
    root = ET.Element("robot", name=placed.robot_name)
    _link(root, BASE_LINK, robot, BASE)
    for j, (name, parent, child) in enumerate(
        zip(joints, (BASE_LINK, *links), links, strict=False)
    ):
        _link(root, child, robot, j)
        joint = _fixed(root, name, parent, child, robot.chain.origin[j])
        ET.SubElement(joint, "axis", xyz=words(robot.chain.axis[j]))
        limits = None if robot.limits is None else robot.limits[j]
        limited = limits is not None and np.isfinite(limits).all()
        joint.set("type", "revolute" if limited else "continuous")
        if robot.chain.slides[j]:
            joint.set("type", "prismatic")
            limits, limited = (limits if limited else np.array([-FARTHEST, FARTHEST])), True
        # effort and velocity are required but unknown
        if limits is not None and limited:
            ET.SubElement(
                joint,
                "limit",
                lower=words([limits[0]]),
                upper=words([limits[1]]),
                effort="0",
                velocity="0",
            )
        for m in robot.chain.mimics:
            if m.joint == j:
                law = {"multiplier": words([m.multiplier]), "offset": words([m.offset])}
                ET.SubElement(joint, "mimic", {"joint": joints[m.leader], **law})
    add_inertial(ET.SubElement(root, "link", name=TCP_LINK))
    _fixed(root, f"{TCP_LINK}_joint", links[-1], TCP_LINK, robot.chain.origin[-1])
    return root


def _link(root: ET.Element, name: str, robot: Robot, frame: int) -> ET.Element:
    """Add a link with the bodies of a frame; return it."""
    link = ET.SubElement(root, "link", name=name)
    for body in robot.bodies:
        if body.frame == frame:
            for use in ("visual", "collision"):
                _capsule(link, use, body.capsule)
    for i, carried in enumerate(robot.carried):
        if carried.frame == frame:
            for use in ("visual", "collision"):
                _polyhedron(link, use, carried.body, mesh_name(i))
    return link


def _polyhedron(link: ET.Element, use: str, body: Polyhedron, file: str) -> None:
    """Add a box as such, and any other polyhedron as the mesh ``file``."""
    part = ET.SubElement(link, use)
    if (box := box_of(body)) is not None:
        T, size = box
        ET.SubElement(part, "origin", origin(T))
        ET.SubElement(ET.SubElement(part, "geometry"), "box", size=words(size))
    else:
        ET.SubElement(ET.SubElement(part, "geometry"), "mesh", filename=file)


def _capsule(link: ET.Element, use: str, capsule: Capsules) -> None:
    """Add a capsule as URDF shapes: a cylinder and two spheres."""
    T, length, radius = capsule_shape(capsule)
    shapes: list[_Shape] = [("sphere", side * length / 2, {}) for side in (-1.0, 1.0)]
    shapes.append(("cylinder", 0.0, {"length": words([length])}))
    for kind, along, size in shapes if length else [("sphere", 0.0, {})]:
        part, at = ET.SubElement(link, use), T.copy()
        at[:3, 3] += along * T[:3, 2]
        ET.SubElement(part, "origin", origin(at))
        ET.SubElement(ET.SubElement(part, "geometry"), kind, {"radius": words([radius]), **size})


_NAMESPACE = "http://www.ros.org/wiki/xacro"
_MACRO = "place_rings_sensors"
ET.register_namespace("xacro", _NAMESPACE)


def xacro(placed: PlacedSetup) -> dict[str, bytes]:
    """Return ``sensors.xacro``. The parameter ``link_of_J`` names the link that joint J moves;
    links have the frames of their joints.

    Raises:
        UserError: if the user's URDF lacks the robot's chain.
    """
    carrying = sorted({placed.on_link(s)[0] for s in placed.sensors})
    joints = {BASE: "base", **dict(enumerate(placed.joint_names))}
    names = {j: f"link_of_{joints[j]}" for j in carrying}
    links = {name: placed.carrier(j) for j, name in names.items()}
    params = [
        f"{name}:={link}" if ROS_NAME.fullmatch(link) else name for name, link in links.items()
    ]
    root = ET.Element("robot")
    macro = ET.SubElement(
        root, f"{{{_NAMESPACE}}}macro", name=_MACRO, params=" ".join(["prefix:=''", *params])
    )
    for s in placed.sensors:
        j, T = placed.on_link(s)
        add_sensor(macro, f"${{prefix}}{s.name}", f"${{{names[j]}}}", T)
    return {"sensors.xacro": document(root)}
