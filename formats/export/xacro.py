"""Xacro: a macro that adds the sensor frames to any robot; parameters name the links that carry
rings."""

import xml.etree.ElementTree as ET

from ...coverage.robots.robot import BASE
from ..robots.urdf_matching import ROS_NAME
from .markup import document
from .placed import PlacedSetup
from .urdf import add_sensor

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
