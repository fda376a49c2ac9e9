"""ROS 2: static transforms from links to sensors, which look along their x axis, one node that
publishes them, and its launch file."""

from collections.abc import Iterable

from ...coverage.definitions.errors import unusable
from ..robots.urdf_matching import ROS_NAME
from ..sensors.sensor_frames import looking_along
from ..sensors.sensor_poses import place, quaternion
from .placed import PlacedSetup

_LAUNCH = """# ros2 launch ./static_transforms.launch.yaml
launch:
- executable:
    cmd: python3 $(dirname)/static_transforms.py
    name: place_rings_static_transforms
    output: screen
"""
_NODE = '''"""One ROS 2 node that publishes all transforms of static_transforms.yaml beside it."""

from pathlib import Path

import rclpy
import yaml
from geometry_msgs.msg import TransformStamped
from tf2_ros import StaticTransformBroadcaster


def transforms(stamp):
    """Return the messages of the file."""
    text = Path(__file__).with_name("static_transforms.yaml").read_text(encoding="utf-8")
    for one in yaml.safe_load(text)["transforms"]:
        message = TransformStamped()
        message.header.stamp = stamp
        message.header.frame_id, message.child_frame_id = one["parent"], one["child"]
        place, turn = message.transform.translation, message.transform.rotation
        place.x, place.y, place.z = one["xyz"]
        turn.x, turn.y, turn.z, turn.w = one["xyzw"]
        yield message


def main():
    """Publish once; the message is kept for later subscribers for as long as the node runs."""
    rclpy.init()
    node = rclpy.create_node("place_rings_static_transforms")
    broadcaster = StaticTransformBroadcaster(node)
    broadcaster.sendTransform(list(transforms(node.get_clock().now().to_msg())))
    rclpy.spin(node)


if __name__ == "__main__":
    main()
'''


def ros2(placed: PlacedSetup) -> dict[str, bytes]:
    """Return ``static_transforms.yaml``, one node that publishes all of it,
    ``static_transforms.py``, and a launch file of that node.

    Raises:
        UserError: if the user's URDF lacks the robot's chain, or a link's name is invalid in ROS.
    """
    for link in {placed.carrier(placed.on_link(s)[0]) for s in placed.sensors}:
        if placed.urdf is not None and not ROS_NAME.fullmatch(link):
            allowed = "a name of letters, digits and _ . / - as in ROS"
            raise unusable(f"{placed.urdf.path}: link", link, allowed)
    data = "transforms:\n"
    fixed = [] if placed.pendant_base is None else [placed.pendant_base]
    for s in placed.sensors:
        joint, T = placed.on_link(s)
        fixed.append((placed.carrier(joint), s.name, looking_along(T, "x")))
    for parent, child, T in fixed:
        xyz, xyzw = place(T), quaternion(T)
        data += f"- parent: '{parent}'\n  child: {child}\n"
        data += f"  xyz: {_listed(xyz)}\n  xyzw: {_listed(xyzw)}\n"
    return {
        "static_transforms.yaml": data.encode(),
        "static_transforms.py": _NODE.encode(),
        "static_transforms.launch.yaml": _LAUNCH.encode(),
    }


def _listed(values: Iterable[float]) -> str:
    return "[" + ", ".join(f"{v:.12f}" for v in values) + "]"
