"""ROS 2: static transforms from links to sensors, which look along their x, and a launch file that publishes them."""

from collections.abc import Iterable

from ..mounted_poses import place, quaternion
from ..sensor_frames import looking_along
from ..urdf_robot import find_robot, moved_links, plain_names
from .placed import Placed

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
      - {{name: frame_id, value: {parent}}}
      - {{name: child_frame_id, value: {child}}}
"""


def ros2(placed: Placed) -> dict[str, bytes]:
    """``static_transforms.yaml``, and ``static_transforms.launch.yaml``, which says the same to ROS.

    Raises:
        UserError: if the user's URDF has not the robot's chain.
    """
    links = placed.link_names
    if placed.urdf is not None:
        links = plain_names(moved_links(find_robot(placed.urdf, placed.scene.robot))[1:])
    data, launch = "transforms:\n", _LAUNCH
    for s in placed.sensors:
        joint, T = placed.on_link(s)
        T = looking_along(T, "x")
        xyz, xyzw = place(T), quaternion(T)
        data += f"- parent: {links[joint]}\n  child: {s.name}\n  xyz: {_listed(xyz)}\n  xyzw: {_listed(xyzw)}\n"
        launch += _NODE.format(parent=links[joint], child=s.name)
        for key, value in (
            *zip(_keys("translation", "xyz"), xyz, strict=True),
            *zip(_keys("rotation", "xyzw"), xyzw, strict=True),
        ):
            launch += f"      - {{name: {key}, value: {value:.12f}}}\n"
    return {"static_transforms.yaml": data.encode(), "static_transforms.launch.yaml": launch.encode()}


def _keys(name: str, parts: str) -> list[str]:
    return [f"{name}.{part}" for part in parts]


def _listed(values: Iterable[float]) -> str:
    return "[" + ", ".join(f"{v:.12f}" for v in values) + "]"
