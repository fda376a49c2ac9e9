"""Strict reader of URDF files: unsupported content is rejected, never ignored.

A shape of size 0 and limits that do not limit are taken as a user of the arm means them, with one
note of each kind a file. A ``UserError`` names file, element, the value found and what is allowed.
"""

import math
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...coverage.definitions.errors import UserError, shown, unusable
from ...coverage.robots.kinematics import transform
from .descriptions import XACRO
from .left_over_xacro import unused_definitions
from .urdf_model import JOINT_KINDS, MOST_LINKS, Joint, Urdf, UrdfLink, UrdfShape
from .xml_text import bounded_bytes, plain_xml, some

LARGEST = 16 * 2**20  # bytes, largest URDF
_FAR = 1e3  # largest absolute value of a number in a file
_TURN = 2 * math.pi + 1e-3  # rad, largest limit of a joint that does not turn without end
_NAMED = 5  # most names in a note
_SIZES = {
    "box": ("size", 3),
    "sphere": ("radius", 1),
    "cylinder": ("radius length", 2),
    "capsule": ("radius length", 2),
}


class _Reader:
    def __init__(self, path: Path) -> None:
        self.path = path
        self.empty: list[str] = []  # links with shapes of no size
        self.absent: list[str] = []  # parents of joints, without an element
        self.unlimited: list[str] = []  # joints whose limits do not limit
        self.left_over: list[str] = []  # definitions of xacro

    def notes(self) -> tuple[str, ...]:
        """Return the notes, at most one of a kind."""
        lines = (
            (self.empty, "Dropped shapes of size 0 of"),
            (self.absent, "The file has no element of these links, taken as links without shape:"),
            (
                self.unlimited,
                "No limits, or limits beyond a turn, or in the wrong order: taken as"
                " without limits:",
            ),
            (self.left_over, "Ignored definitions of xacro, which nothing uses:"),
        )
        return tuple(f"{text} {some(list(dict.fromkeys(of)), _NAMED)}." for of, text in lines if of)

    def fail(self, where: str, found: object, allowed: str) -> UserError:
        return unusable(f"{self.path}: {where}", found, allowed)

    def text(self, element: ET.Element, key: str, where: str) -> str:
        value = element.get(key)
        if not value:
            raise self.fail(f"{where}: {key}", value, "text")
        if len(value) > 1000:
            raise self.fail(f"{where}: {key}", value, "at most 1000 characters")
        return value

    def numbers(self, text: str | None, count: int, where: str) -> tuple[float, ...]:
        words = {1: "a number", 2: "two numbers", 3: "three numbers"}[count]
        try:
            values = tuple(float(word) for word in (text or "").split())
        except ValueError:
            values = ()
        if len(values) != count or not all(math.isfinite(v) and abs(v) <= _FAR for v in values):
            raise self.fail(where, text, f"{words} of at most {_FAR:g}")
        return values

    def origin(self, element: ET.Element, where: str) -> Float[np.ndarray, "4 4"]:
        origin = element.find("origin")
        if origin is None:
            return np.eye(4)
        xyz, rpy = (
            self.numbers(origin.get(key, "0 0 0"), 3, f"{where}: origin {key}")
            for key in ("xyz", "rpy")
        )
        return transform(xyz, rpy)

    def shape(self, element: ET.Element, where: str) -> UrdfShape | None:
        T, geometry = self.origin(element, where), element.find("geometry")
        kinds = [] if geometry is None else list(geometry)
        if len(kinds) != 1 or kinds[0].tag not in (*_SIZES, "mesh"):
            tag = ", ".join(kind.tag for kind in kinds) or None
            raise self.fail(f"{where}: geometry", tag, f"one of {', '.join(_SIZES)}, mesh")
        one = kinds[0]
        if one.tag == "mesh":
            scale = self.numbers(one.get("scale", "1 1 1"), 3, f"{where}: mesh scale")
            if 0 in scale:
                raise self.fail(
                    f"{where}: mesh scale", one.get("scale"), "three numbers other than 0"
                )
            return UrdfShape("mesh", T, scale, self.text(one, "filename", f"{where}: mesh"))
        keys, count = _SIZES[one.tag]
        if one.tag == "box":
            size = self.numbers(one.get(keys), count, f"{where}: box size")
        else:
            size = tuple(
                self.numbers(one.get(key), 1, f"{where}: {one.tag} {key}")[0]
                for key in keys.split()
            )
        if min(size) < 0:
            raise self.fail(
                f"{where}: {one.tag}", " ".join(f"{v:g}" for v in size), "sizes of at least 0"
            )
        return UrdfShape(one.tag, T, size) if min(size) > 0 else None

    def link(self, element: ET.Element) -> UrdfLink:
        name = self.text(element, "name", "link")
        each = {
            tag: [self.shape(e, f"link {shown(name)}: {tag}") for e in element.findall(tag)]
            for tag in ("collision", "visual")
        }
        self.empty += [name] * any(None in shapes for shapes in each.values())
        kept = {tag: tuple(s for s in shapes if s is not None) for tag, shapes in each.items()}
        return UrdfLink(name, **kept)

    def joint(self, element: ET.Element) -> Joint:
        name = self.text(element, "name", "joint")
        where, kind = f"joint {shown(name)}", element.get("type")
        if kind not in JOINT_KINDS:
            raise self.fail(f"{where}: type", kind, ", ".join(JOINT_KINDS))
        ends = []
        for key in ("parent", "child"):
            part = element.find(key)
            if part is None:
                raise self.fail(f"{where}: {key}", None, "a link")
            ends.append(self.text(part, "link", f"{where}: {key}"))
        axis, limits, mimic = (
            np.array([1.0, 0.0, 0.0]),
            (-math.inf, math.inf),
            element.find("mimic"),
        )
        if kind in ("revolute", "continuous", "prismatic", "planar"):
            part = element.find("axis")
            text = "1 0 0" if part is None else part.get("xyz")
            axis = np.array(self.numbers(text, 3, f"{where}: axis"))
            if np.linalg.norm(axis) < 1e-6:
                raise self.fail(f"{where}: axis", text, "three numbers, not all 0")
            axis = axis / np.linalg.norm(axis)
        if kind in ("revolute", "prismatic"):
            limits = self.limits(element.find("limit"), name, kind)
        target, factors = "", (1.0, 0.0)
        if mimic is not None:
            target = self.text(mimic, "joint", f"{where}: mimic")
            factors = (
                self.numbers(mimic.get("multiplier", "1"), 1, f"{where}: mimic multiplier")[0],
                self.numbers(mimic.get("offset", "0"), 1, f"{where}: mimic offset")[0],
            )
        T = self.origin(element, where)
        return Joint(name, kind, ends[0], ends[1], T, axis, limits, target, *factors)

    def limits(self, part: ET.Element | None, name: str, kind: str) -> tuple[float, float]:
        """Return the limits of a joint; infinite ones where the file's are missing, beyond a turn,
        or not in order."""
        each = [0.0, 0.0]
        for i, key in enumerate(("lower", "upper")):
            text = "0" if part is None else part.get(key, "0")
            try:
                each[i] = float(text)
            except ValueError:
                each[i] = math.nan
            if math.isnan(each[i]):
                raise self.fail(f"joint {shown(name)}: limit {key}", text, "a number")
        most = _TURN if kind == "revolute" else _FAR
        if each[0] < each[1] and -most <= each[0] and each[1] <= most:
            return each[0], each[1]
        self.unlimited.append(name)
        return -math.inf, math.inf


def read_urdf(path: Path, root: ET.Element | None = None) -> Urdf:
    """Return the URDF in a file, or that which the file makes, whose root is given.

    Raises:
        UserError: if it cannot be read or is not supported.
    """
    if root is None:
        if path.suffix.lower() == XACRO:
            raise UserError(f"{path}: a xacro file, wanted: the URDF that it makes")
        root = plain_xml(bounded_bytes(path, LARGEST), str(path))
    reader = _Reader(path)
    if root.tag != "robot":
        raise reader.fail("root", root.tag[:100], "robot, the root of a URDF")
    reader.left_over = unused_definitions(root, str(path))
    links: dict[str, UrdfLink] = {}
    joints: dict[str, Joint] = {}
    for element in root:
        if element.tag == "link":
            link = reader.link(element)
            if link.name in links:
                raise reader.fail("link", link.name, "unique names")
            links[link.name] = link
        elif element.tag == "joint":
            joint = reader.joint(element)
            if joint.name in joints:
                raise reader.fail("joint", joint.name, "unique names")
            joints[joint.name] = joint
    if not links:
        raise reader.fail(
            "link",
            0,
            f"1 to {MOST_LINKS} links; expand the top-level xacro file, which calls the macro",
        )
    if len(links) > MOST_LINKS:
        raise reader.fail("link", len(links), f"1 to {MOST_LINKS} links")
    for joint in joints.values():
        if joint.child not in links:
            allowed = "a link of the file"
            raise reader.fail(f"joint {shown(joint.name)}: child", joint.child, allowed)
        if joint.parent not in links:
            reader.absent.append(joint.parent)
        if joint.mimic and joint.mimic not in joints:
            raise reader.fail(
                f"joint {shown(joint.name)}: mimic", joint.mimic, "a joint of the file"
            )
    links |= {name: UrdfLink(name) for name in reader.absent}
    return Urdf(path, (root.get("name") or path.stem)[:100], links, joints, reader.notes())
