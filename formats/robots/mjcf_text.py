"""Text of an MJCF file for MuJoCo: included files in place, and only the elements that make links,
joints and shapes.

Only files in the folder of the file that the user named, or below, are included. What MuJoCo gets
names no file that it would open but meshes, which ``mjcf`` takes out before it compiles.
"""

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...coverage.definitions.errors import UserError, shown
from .urdf import LARGEST
from .xml_text import bounded_bytes, plain_xml

_MOST_FILES = 100  # included
_MOST_DEEP = 100  # elements in each other
_MOST_PARTS = 20_000  # elements that MuJoCo gets
_FAR = 1e3  # largest absolute value of a number in a file
_POSE = ("name", "class", "childclass", "pos", "quat", "axisangle", "xyaxes", "zaxis", "euler")
# elements that MuJoCo gets, with their attributes: nothing that names another file
_READ: dict[str, tuple[str, ...]] = {
    "compiler": ("angle", "coordinate", "eulerseq", "autolimits"),
    "default": ("class",),
    "asset": (),
    "mesh": ("name", "class", "file", "scale", "refpos", "refquat"),
    "worldbody": ("childclass",),
    "body": _POSE,
    "frame": _POSE,
    "freejoint": ("name",),
    "joint": ("name", "class", "type", "pos", "axis", "range", "limited", "ref"),
    "geom": (*_POSE, "type", "size", "fromto", "mesh", "group", "contype", "conaffinity"),
    "site": (*_POSE, "type", "size", "fromto"),
}
_REFUSED = ("replicate", "attach", "composite", "flexcomp")  # they make bodies of their own
# how many numbers a key has; 0: any
_NUMBERS = {"pos": 3, "quat": 4, "axisangle": 4, "xyaxes": 6, "zaxis": 3, "euler": 3, "axis": 3}
_NUMBERS |= {"range": 2, "ref": 1, "size": 0, "fromto": 6, "scale": 3, "refpos": 3, "refquat": 4}
_DIRECTIONS = ("quat", "xyaxes", "zaxis", "axis", "refquat")
_WORDS = {
    ("joint", "type"): ("hinge", "slide", "ball", "free"),
    ("geom", "type"): (
        *("sphere", "capsule", "cylinder", "ellipsoid", "box", "mesh"),
        *("plane", "hfield", "sdf"),
    ),
    ("compiler", "angle"): ("degree", "radian"),
    ("compiler", "coordinate"): ("local",),
}
_MASSES = {"boundmass": "1", "boundinertia": "1"}  # MuJoCo refuses a moving body without any
_PERCENT = "\ue025"  # stands for a sign that MuJoCo takes for a format's in its messages, and ends


@dataclass(frozen=True)
class MjcfText:
    """The elements of an MJCF file, with included files in place."""

    path: Path
    """The file."""
    root: ET.Element
    """Its root."""

    def fail(self, where: str, found: object, allowed: str) -> UserError:
        """Return an error that names the file, the element, the value found and those allowed."""
        return UserError(f"{self.path}: {where}: found {shown(found)}, allowed: {allowed}")

    def plain(self) -> str:
        """Return the text that MuJoCo compiles.

        Raises:
            UserError: for an element that is not supported, or a number that is too large.
        """
        root = ET.Element("mujoco")
        ET.SubElement(root, "compiler", _MASSES)
        count = self._copy(self.root, root)
        if count > _MOST_PARTS:
            raise self.fail("root", count, f"at most {_MOST_PARTS} elements")
        return ET.tostring(root, encoding="unicode").replace("%", _PERCENT)

    def _copy(self, source: ET.Element, target: ET.Element) -> int:
        """Copy what is read of an element's children; return how many there are."""
        count = 0
        for child in source:
            if child.tag in _REFUSED:
                allowed = "body, joint, geom; save the model from MuJoCo first"
                raise self.fail(_named(source), child.tag, allowed)
            if child.tag not in _READ:
                continue
            keys = {key: child.get(key, "") for key in _READ[child.tag] if key in child.attrib}
            self._check(child, keys)
            count += 1 + self._copy(child, ET.SubElement(target, child.tag, keys))
        return count

    def _check(self, element: ET.Element, keys: dict[str, str]) -> None:
        """Raise ``UserError`` for a word or numbers that a key cannot have."""
        for key, text in keys.items():
            where = f"{_named(element)}: {key}"
            words = _WORDS.get((element.tag, key))
            if words is not None and text not in words:
                raise self.fail(where, text, ", ".join(words))
            if key not in _NUMBERS:
                continue
            try:
                values = np.array([float(word) for word in text.split()])
            except ValueError:
                values = np.zeros(0)
            count = _NUMBERS[key] or len(values)
            if len(values) != count or not count or not (np.abs(values) <= _FAR).all():
                raise self.fail(where, text, f"{count or 1} numbers of at most {_FAR:g}")
            if key in _DIRECTIONS and not values[:3].any() and not values[3:].any():
                raise self.fail(where, text, "numbers that are not all 0")
            if key == "scale" and not values.all():
                raise self.fail(where, text, "three numbers other than 0")

    @property
    def meshes(self) -> tuple[str, bool]:
        """The folder of meshes, and whether folders in their names are ignored."""
        folder, bare = "", "false"
        for element in self.root.findall("compiler"):
            folder = element.get("meshdir", element.get("assetdir", folder))
            bare = element.get("strippath", bare)
        return folder, bare == "true"


def written(text: str) -> str:
    """Return a text of MuJoCo's as the file has it."""
    return text.replace(_PERCENT, "%")


def _named(element: ET.Element) -> str:
    """Return an element for messages: its tag and its name, if any."""
    name = element.get("name")
    return f"{element.tag} {shown(name)}" if name else element.tag


def read_text(path: Path, root: ET.Element) -> MjcfText:
    """Return the text of the MJCF file at ``path``, whose root is ``root``.

    Raises:
        UserError: if an included file cannot be read.
    """
    text = MjcfText(path, root)
    _include(text, root, [path.resolve()], 0)
    return text


def _include(text: MjcfText, element: ET.Element, files: list[Path], deep: int) -> None:
    """Replace the elements ``include`` below ``element`` by those of their files."""
    if deep > _MOST_DEEP:
        raise text.fail("root", "elements nested too deeply", f"at most {_MOST_DEEP} levels")
    children: list[ET.Element] = []
    for child in element:
        if child.tag != "include":
            _include(text, child, files, deep + 1)
            children.append(child)
            continue
        other = _included(text, child.get("file"), files)
        _include(text, other, files, deep + 1)
        children += other
    element[:] = children


def _included(text: MjcfText, name: str | None, files: list[Path]) -> ET.Element:
    folder = text.path.resolve().parent
    if not name:
        raise text.fail("include: file", name, "the name of a file")
    try:
        target = (folder / name).resolve()
    except (OSError, ValueError, RuntimeError) as error:
        raise text.fail("include: file", name, "the name of a file") from error
    if not target.is_relative_to(folder):
        allowed = f"a file in the folder of {text.path.name} or below"
        raise text.fail("include: file", name, allowed)
    if target in files:
        raise text.fail("include: file", name, "a file that is not included already")
    if len(files) >= _MOST_FILES:
        raise text.fail("include", f"more than {_MOST_FILES} files", "fewer")
    files.append(target)
    root = plain_xml(bounded_bytes(target, LARGEST), str(target))
    if root.tag not in ("mujoco", "mujocoinclude"):
        raise text.fail(f"include: {name}: root", root.tag[:100], "mujoco, mujocoinclude")
    return root
