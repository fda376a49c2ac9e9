"""A reader of SDFormat by its specification alone: poses of links at joint values, and the elements
that the format knows."""

import xml.etree.ElementTree as ET

import numpy as np

# required and further children of the elements that exports write, of version 1.11
KNOWN = {
    "sdf": ("", "world model light"),
    "world": ("gravity", "plugin light model joint"),
    "gravity": ("", ""),
    "light": ("", "direction pose"),
    "model": ("", "static pose link joint frame plugin"),
    "link": ("", "pose inertial collision visual sensor"),
    "frame": ("", "pose"),
    "joint": ("parent child", "pose axis"),
    "axis": ("xyz limit", "mimic"),
    "limit": ("lower upper", "effort velocity"),
    "mimic": ("multiplier offset reference", ""),
    "inertial": ("", "pose mass inertia"),
    "inertia": ("ixx ixy ixz iyy iyz izz", ""),
    "collision": ("geometry", "pose"),
    "visual": ("geometry", "pose visibility_flags"),
    "geometry": ("", "box sphere capsule plane mesh"),
    "box": ("size", ""),
    "sphere": ("radius", ""),
    "capsule": ("radius length", ""),
    "plane": ("normal size", ""),
    "mesh": ("uri", ""),
    "sensor": ("", "pose topic update_rate always_on lidar"),
    "lidar": ("scan range", "visibility_mask"),
    "scan": ("horizontal", "vertical"),
    "horizontal": ("samples resolution min_angle max_angle", ""),
    "vertical": ("samples min_angle max_angle", "resolution"),
    "range": ("min max", ""),
}
NUMBERS = {"pose": 6, "xyz": 3, "size": None, "radius": 1, "length": 1, "lower": 1, "upper": 1}
NUMBERS |= {"mass": 1, "normal": 3, "gravity": 3, "min": 1, "max": 1, "samples": 1}
MANY = {"plugin", "light", "model", "joint", "link", "frame", "collision", "visual", "sensor"}


def structure_faults(element: ET.Element) -> list[str]:
    """What the format would refuse in an element and in what it holds."""
    faults, tags = [], [child.tag for child in element if isinstance(child.tag, str)]
    if element.tag in KNOWN:
        required, further = (part.split() for part in KNOWN[element.tag])
        faults += [f"{element.tag} lacks {tag}" for tag in required if tag not in tags]
        unknown = set(tags) - {*required, *further}
        faults += [f"{element.tag} has {tag}" for tag in unknown]
        faults += [f"{t} twice" for t in set(tags) - MANY if tags.count(t) > 1]
    if element.tag in NUMBERS:
        count = len([float(v) for v in element.text.split()])
        if NUMBERS[element.tag] not in (None, count):
            faults.append(f"{element.tag}: {element.text}")
    for child in element if element.tag != "plugin" else ():
        faults += structure_faults(child) if isinstance(child.tag, str) else []
    return faults


def pose_of(element: ET.Element | None) -> np.ndarray:
    """The pose (4, 4) m of six numbers, by the formula of roll, pitch and yaw alone."""
    T = np.eye(4)
    if element is None:
        return T
    x, y, z, *angles = map(float, element.text.split())
    (cr, sr), (cp, sp), (cy, sy) = ((np.cos(a), np.sin(a)) for a in angles)
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    T[:3, :3], T[:3, 3] = about_z @ about_y @ about_x, (x, y, z)
    return T


class SdfModel:
    """A model of a world."""

    def __init__(self, path, name):
        self.root = ET.parse(path).getroot()
        (self.model,) = (m for m in self.root.iter("model") if m.get("name") == name)
        self.links = {link.get("name"): link for link in self.model.iter("link")}
        self.joints = {joint.get("name"): joint for joint in self.model.iter("joint")}

    def at(self, values) -> dict[str, np.ndarray]:
        """The poses (4, 4) m in the world of links, their sensors and frames at joint values, rad
        or m. A joint moves the link whose pose is relative to it."""
        poses = {}

        def frame(name) -> np.ndarray:
            if name in poses:
                return poses[name]
            if name in self.joints:
                joint = self.joints[name]
                pose = joint.find("pose")
                T = frame(pose.get("relative_to")) @ pose_of(pose)
                axis = np.array(joint.findtext("axis/xyz").split(), float)
                return T @ _moved(joint.get("type"), axis, values[name])
            pose = self.links[name].find("pose")
            up = pose_of(self.model.find("pose"))
            relative = None if pose is None else pose.get("relative_to")
            poses[name] = (up if relative is None else frame(relative)) @ pose_of(pose)
            return poses[name]

        made = {name: frame(name) for name in self.links}
        for name, link in self.links.items():
            for sensor in link.iter("sensor"):
                made[sensor.get("name")] = made[name] @ pose_of(sensor.find("pose"))
        for other in self.model.iter("frame"):
            made[other.get("name")] = made[other.get("attached_to")] @ pose_of(other.find("pose"))
        return made


def _moved(kind, axis, value) -> np.ndarray:
    T = np.eye(4)
    if kind == "prismatic":
        T[:3, 3] = value * axis
    else:  # Rodrigues
        x, y, z = axis
        K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        T[:3, :3] += np.sin(value) * K + (1 - np.cos(value)) * K @ K
    return T
