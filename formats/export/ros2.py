"""ROS 2: static transforms from links to sensors, which look along their x axis, and a launch file
that publishes them."""

from collections.abc import Iterable

from ..errors import UserError, shown
from ..robots.urdf_matching import ROS_NAME
from ..sensors.sensor_frames import looking_along
from ..sensors.sensor_poses import place, quaternion
from .placed import PlacedSetup

_LAUNCH = """# ros2 launch ./static_transforms.launch.yaml
launch:
- node_container:
    pkg: rclcpp_components
    exec: component_container
    name: place_rings_static_transforms
    namespace: ''
    composable_node:
"""
_NODE = """    - pkg: tf2_ros
      plugin: tf2_ros::StaticTransformBroadcasterNode
      name: {child}_broadcaster
      param:
      - {{name: frame_id, value: '{parent}'}}
      - {{name: child_frame_id, value: '{child}'}}
"""


def ros2(placed: PlacedSetup) -> dict[str, bytes]:
    """Return ``static_transforms.yaml``, and ``static_transforms.launch.yaml``, which publishes the
    same transforms.

    Raises:
        UserError: if the user's URDF lacks the robot's chain, or a link's name is invalid in ROS.
    """
    for link in {placed.carrier(placed.on_link(s)[0]) for s in placed.sensors}:
        if placed.urdf is not None and not ROS_NAME.fullmatch(link):
            allowed = "a name of letters, digits and _ . / - as in ROS"
            raise UserError(f"{placed.urdf.path}: link: found {shown(link)}, allowed: {allowed}")
    data, launch = "transforms:\n", _LAUNCH
    for s in placed.sensors:
        joint, T = placed.on_link(s)
        T = looking_along(T, "x")
        xyz, xyzw = place(T), quaternion(T)
        parent = placed.carrier(joint)
        data += f"- parent: '{parent}'\n  child: {s.name}\n"
        data += f"  xyz: {_listed(xyz)}\n  xyzw: {_listed(xyzw)}\n"
        launch += _NODE.format(parent=parent, child=s.name)
        for key, value in (
            *zip(_keys("translation", "xyz"), xyz, strict=True),
            *zip(_keys("rotation", "xyzw"), xyzw, strict=True),
        ):
            launch += f"      - {{name: {key}, value: {value:.12f}}}\n"
    return {
        "static_transforms.yaml": data.encode(),
        "static_transforms.launch.yaml": launch.encode(),
    }


def _keys(name: str, parts: str) -> list[str]:
    return [f"{name}.{part}" for part in parts]


def _listed(values: Iterable[float]) -> str:
    return "[" + ", ".join(f"{v:.12f}" for v in values) + "]"
