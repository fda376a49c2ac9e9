"""Strict reader of URDF files: unsupported content is rejected, never ignored.

Only the standard library's parser is used, and only after a document type is excluded, so that no
entity is expanded. A ``UserError`` names file, element, the value found and the values allowed.
"""

import math
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path
from xml.parsers import expat

import numpy as np
from jaxtyping import Float

from ...coverage.robots.kinematics import transform
from ..errors import UserError, shown

LARGEST = 16 * 2**20  # bytes, largest URDF
MOST_LINKS = 2000
_FAR = 1e3  # largest absolute value of a number in a file
_MOVING = ("revolute", "continuous", "prismatic", "planar", "floating")
JOINT_KINDS = (*_MOVING, "fixed")
_SIZES = {
    "box": ("size", 3),
    "sphere": ("radius", 1),
    "cylinder": ("radius length", 2),
    "capsule": ("radius length", 2),
}


@dataclass(frozen=True)
class UrdfShape:
    """A shape of a link."""

    kind: str
    """One of box, sphere, ellipsoid, cylinder, capsule and mesh."""
    T_link_shape: Float[np.ndarray, "4 4"]
    """Pose of the shape."""
    size: tuple[float, ...]
    """Edges of a box, radii, or radius and length along z, m; scale of a mesh."""
    file: str = ""
    """Name of a mesh file, as written."""


@dataclass(frozen=True)
class UrdfLink:
    """A link."""

    name: str
    """Name of the link."""
    collision: tuple[UrdfShape, ...] = ()
    """Shapes for collision."""
    visual: tuple[UrdfShape, ...] = ()
    """Shapes for display."""


@dataclass(frozen=True)
class Joint:
    """A joint from ``parent`` to ``child``."""

    name: str
    """Name of the joint."""
    kind: str
    """Type of the joint."""
    parent: str
    """Name of the parent link."""
    child: str
    """Name of the child link."""
    T_parent_joint: Float[np.ndarray, "4 4"]
    """Pose at angle 0."""
    axis: Float[np.ndarray, " 3"]
    """Unit vector of the axis."""
    limits: tuple[float, float]
    """Limits, rad (or m)."""
    mimic: str = ""
    """Name of the joint that it mimics, if any."""

    @property
    def moves(self) -> bool:
        """Whether the joint moves."""
        return self.kind != "fixed"


@dataclass(frozen=True)
class Urdf:
    """All links and joints of a file, by name."""

    path: Path
    """The file."""
    name: str
    """Name of the robot."""
    links: dict[str, UrdfLink]
    """Links by name."""
    joints: dict[str, Joint]
    """Joints by name."""
    notes: tuple[str, ...] = ()
    """What the reader dropped or took in another way than written, a sentence each."""


def plain_xml(text: bytes, name: str) -> ET.Element:
    """Return the root of an XML text without a document type, and thus without entities of its own.

    Raises:
        UserError: if the text is not XML or has a document type.
    """
    parser = expat.ParserCreate()

    def refuse(*_: object) -> None:
        raise UserError(
            f"{name}: line {parser.CurrentLineNumber}: found a document type, allowed: XML"
            " without one"
        )

    parser.StartDoctypeDeclHandler = refuse
    parser.EntityDeclHandler = refuse
    try:
        parser.Parse(text, True)
        return ET.fromstring(text)
    except (expat.ExpatError, ET.ParseError, ValueError, LookupError) as error:
        raise UserError(f"{name}: not XML: {error}") from error
    except RecursionError as error:
        raise UserError(f"{name}: not XML: nested too deeply") from error


def bounded_bytes(path: Path, most: int, name: str = "") -> bytes:
    """Return the content of a file of at most ``most`` bytes.

    Raises:
        UserError: if it cannot be read or is larger.
    """
    name = name or str(path)
    try:
        if path.exists() and not path.is_file():
            raise UserError(f"{name}: not a regular file; give a file")
        with path.open("rb") as file:
            data = file.read(most + 1)
    except (OSError, ValueError) as error:
        raise UserError(
            f"{name}: cannot be read: {getattr(error, 'strerror', None) or error}"
        ) from error
    if len(data) > most:
        limit = most // 2**20
        raise UserError(f"{name}: found more than {limit} MB, allowed: at most {limit} MB")
    return data


class _Reader:
    def __init__(self, path: Path) -> None:
        self.path = path

    def fail(self, where: str, found: object, allowed: str) -> UserError:
        return UserError(f"{self.path}: {where}: found {shown(found)}, allowed: {allowed}")

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

    def shape(self, element: ET.Element, where: str) -> UrdfShape:
        T, geometry = self.origin(element, where), element.find("geometry")
        kinds = [] if geometry is None else list(geometry)
        if len(kinds) != 1 or kinds[0].tag not in (*_SIZES, "mesh"):
            tag = kinds[0].tag if kinds else None
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
        if min(size) <= 0:
            raise self.fail(
                f"{where}: {one.tag}", " ".join(f"{v:g}" for v in size), "sizes above 0"
            )
        return UrdfShape(one.tag, T, size)

    def link(self, element: ET.Element) -> UrdfLink:
        name = self.text(element, "name", "link")
        each = {
            tag: tuple(self.shape(e, f"link {shown(name)}: {tag}") for e in element.findall(tag))
            for tag in ("collision", "visual")
        }
        return UrdfLink(name, **each)

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
            part = element.find("limit")
            if part is None:
                raise self.fail(f"{where}: limit", None, "lower and upper")
            low, high = (
                self.numbers(part.get(key, "0"), 1, f"{where}: limit {key}")[0]
                for key in ("lower", "upper")
            )
            if low >= high:
                raise self.fail(f"{where}: limit", f"{low:g} to {high:g}", "the lower value first")
            limits = (low, high)
        target = "" if mimic is None else self.text(mimic, "joint", f"{where}: mimic")
        return Joint(
            name, kind, ends[0], ends[1], self.origin(element, where), axis, limits, target
        )


def read_urdf(path: Path) -> Urdf:
    """Return the URDF in a file.

    Raises:
        UserError: if it cannot be read or is not supported.
    """
    root = plain_xml(bounded_bytes(path, LARGEST), str(path))
    reader = _Reader(path)
    if root.tag != "robot":
        raise reader.fail("root", root.tag[:100], "robot, the root of a URDF")
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
        elif "xacro" in element.tag:
            raise reader.fail("root", element.tag[:100], "a URDF; expand xacro first")
    if not links or len(links) > MOST_LINKS:
        raise reader.fail("link", len(links), f"1 to {MOST_LINKS} links")
    for joint in joints.values():
        for key, end in (("parent", joint.parent), ("child", joint.child)):
            if end not in links:
                raise reader.fail(f"joint {shown(joint.name)}: {key}", end, "a link of the file")
        if joint.mimic and joint.mimic not in joints:
            raise reader.fail(
                f"joint {shown(joint.name)}: mimic", joint.mimic, "a joint of the file"
            )
    return Urdf(path, (root.get("name") or path.stem)[:100], links, joints)
