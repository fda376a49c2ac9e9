"""A URDF as it is written, read strictly: what is not understood is refused, never left out.

Only the standard library's parser is used, and only after a document type is ruled out: so no
entity can be expanded. One line of a ``UserError`` names file, element, what was found and what is
allowed.
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

LARGEST = 16 * 2**20  # bytes of a URDF
MOST_LINKS = 2000
_FAR = 1e3  # m, beyond which no place is believed
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
    """A shape of a link. kind: box, sphere, cylinder, capsule or mesh. T_link_shape (4, 4). size:
    m; edges of a box, radius, or radius and length along z. A mesh has the file's name as it is
    written, and its scale as size."""

    kind: str
    T_link_shape: Float[np.ndarray, "4 4"]
    size: tuple[float, ...]
    file: str = ""


@dataclass(frozen=True)
class UrdfLink:
    """A link with its shapes to collide and to be seen."""

    name: str
    collision: tuple[UrdfShape, ...] = ()
    visual: tuple[UrdfShape, ...] = ()


@dataclass(frozen=True)
class Joint:
    """A joint from ``parent`` to ``child``: its kind, T_parent_joint (4, 4) at 0, unit axis (3,),
    limits rad (or m), and the joint it mimics, if any."""

    name: str
    kind: str
    parent: str
    child: str
    T_parent_joint: Float[np.ndarray, "4 4"]
    axis: Float[np.ndarray, " 3"]
    limits: tuple[float, float]
    mimic: str = ""

    @property
    def moves(self) -> bool:
        return self.kind != "fixed"


@dataclass(frozen=True)
class Urdf:
    """All links and joints of a file, by name, as they are written."""

    path: Path
    name: str
    links: dict[str, UrdfLink]
    joints: dict[str, Joint]


def plain_xml(text: bytes, name: str) -> ET.Element:
    """The root of an XML text without a document type, and so without entities of its own;
    UserError names the file.
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
    """What is in a file of at most so many bytes; UserError otherwise."""
    name = name or str(path)
    try:
        if not path.is_file():
            raise UserError(
                f"{name}: found {'no file' if path.exists() else 'nothing'}, allowed: a file"
            )
        with path.open("rb") as file:
            data = file.read(most + 1)
    except (OSError, ValueError) as error:
        raise UserError(
            f"{name}: cannot be read: {getattr(error, 'strerror', None) or error}"
        ) from error
    if len(data) > most:
        raise UserError(f"{name}: found more than {most // 2**20} MB, allowed: less")
    return data


class _Reader:
    def __init__(self, path: Path) -> None:
        self.path = path

    def fail(self, where: str, found: object, allowed: str) -> UserError:
        return UserError(f"{self.path}: {where}: found {shown(found)}, allowed: {allowed}")

    def text(self, element: ET.Element, key: str, where: str) -> str:
        value = element.get(key)
        if not value:
            raise self.fail(f"{where}: {key}", value, "a text")
        if len(value) > 1000:
            raise self.fail(f"{where}: {key}", value, "no longer than 1000")
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
        found = element.find("origin")
        if found is None:
            return np.eye(4)
        xyz, rpy = (
            self.numbers(found.get(key, "0 0 0"), 3, f"{where}: origin {key}")
            for key in ("xyz", "rpy")
        )
        return transform(xyz, rpy)

    def shape(self, element: ET.Element, where: str) -> UrdfShape:
        T, geometry = self.origin(element, where), element.find("geometry")
        kinds = [] if geometry is None else list(geometry)
        if len(kinds) != 1 or kinds[0].tag not in (*_SIZES, "mesh"):
            found = kinds[0].tag if kinds else None
            raise self.fail(f"{where}: geometry", found, f"one of {', '.join(_SIZES)}, mesh")
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
            found = element.find(key)
            if found is None:
                raise self.fail(f"{where}: {key}", None, "a link")
            ends.append(self.text(found, "link", f"{where}: {key}"))
        axis, limits, mimic = (
            np.array([1.0, 0.0, 0.0]),
            (-math.inf, math.inf),
            element.find("mimic"),
        )
        if kind in ("revolute", "continuous", "prismatic", "planar"):
            found = element.find("axis")
            text = "1 0 0" if found is None else found.get("xyz")
            axis = np.array(self.numbers(text, 3, f"{where}: axis"))
            if np.linalg.norm(axis) < 1e-6:
                raise self.fail(f"{where}: axis", text, "three numbers, not all 0")
            axis = axis / np.linalg.norm(axis)
        if kind in ("revolute", "prismatic"):
            found = element.find("limit")
            if found is None:
                raise self.fail(f"{where}: limit", None, "lower and upper")
            low, high = (
                self.numbers(found.get(key, "0"), 1, f"{where}: limit {key}")[0]
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
    """The URDF in a file; UserError in one line if it cannot be read or is not understood."""
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
                raise reader.fail("link", link.name, "each name once")
            links[link.name] = link
        elif element.tag == "joint":
            joint = reader.joint(element)
            if joint.name in joints:
                raise reader.fail("joint", joint.name, "each name once")
            joints[joint.name] = joint
        elif "xacro" in element.tag:
            raise reader.fail("root", element.tag[:100], "a URDF: expand xacro first")
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
