"""Xacro: a macro that adds the sensor frames to any robot; parameters name the links that carry
rings."""

import xml.etree.ElementTree as ET

from ...coverage.robots.robot import BASE
from ..robots.urdf_matching import ROS_NAME
from ..sensors.sensor_frames import looking_along
from .markup import add_inertial, document, origin
from .placed import PlacedSetup

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
        add_inertial(ET.SubElement(macro, "link", name=f"${{prefix}}{s.name}"))
        joint = ET.SubElement(macro, "joint", name=f"${{prefix}}{s.name}_joint", type="fixed")
        ET.SubElement(joint, "parent", link=f"${{{names[j]}}}")
        ET.SubElement(joint, "child", link=f"${{prefix}}{s.name}")
        ET.SubElement(joint, "origin", origin(looking_along(T, "x")))
    return {"sensors.xacro": document(root)}
