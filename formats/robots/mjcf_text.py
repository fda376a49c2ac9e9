"""Text of an MJCF file: included files, default classes, and the compiler's settings.

Only files in the folder of the file that the user named, or below, are included.
"""

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from ..errors import UserError, shown
from .urdf import LARGEST
from .xml_text import bounded_bytes, plain_xml

MAIN = "main"  # name of the outermost default class
ORIENTATIONS = ("quat", "axisangle", "xyaxes", "zaxis", "euler")
_MOST_FILES = 100  # included
_MOST_DEEP = 100  # elements in each other
_FAR = 1e3  # largest absolute value of a number in a file


@dataclass
class Compiler:
    """Settings of the element ``compiler``."""

    degrees: bool = True
    """Whether angles are in degrees."""
    sequence: str = "xyz"
    """Axes of Euler angles; lower case: of the turning frame."""
    meshdir: str = ""
    """Folder of meshes."""
    bare: bool = False
    """Whether folders in the names of meshes are ignored."""


@dataclass
class MjcfText:
    """The elements of an MJCF file, with included files in place."""

    path: Path
    """The file."""
    root: ET.Element
    """Its root."""
    compiler: Compiler = field(default_factory=Compiler)
    """Its settings."""
    classes: dict[str, dict[str, dict[str, str]]] = field(default_factory=dict)
    """Attributes by default class and element, those of outer classes included."""

    def fail(self, where: str, found: object, allowed: str) -> UserError:
        """Return an error that names the file, the element, the value found and those allowed."""
        return UserError(f"{self.path}: {where}: found {shown(found)}, allowed: {allowed}")

    def attributes(self, element: ET.Element, inherited: str, where: str) -> dict[str, str]:
        """Return an element's attributes, completed by its class or the ``inherited`` one."""
        name = element.get("class", inherited)
        if name not in self.classes:
            raise self.fail(f"{where}: class", name, "a class of the file's defaults")
        known = dict(self.classes[name].get(element.tag, {}))
        if any(key in element.attrib for key in ORIENTATIONS):
            known = {key: value for key, value in known.items() if key not in ORIENTATIONS}
        return known | element.attrib

    def numbers(self, text: str, counts: Iterable[int], where: str) -> Float[np.ndarray, " N"]:
        """Return the numbers in a text, as many as one of ``counts``."""
        try:
            values = np.array([float(word) for word in text.split()])
        except ValueError:
            values = np.zeros(0)
        counts = tuple(counts)
        if len(values) not in counts or not (np.abs(values) <= _FAR).all():
            many = " or ".join(str(count) for count in counts)
            raise self.fail(where, text, f"{many} numbers of at most {_FAR:g}")
        return values

    def angle(self, value: float) -> float:
        """Return an angle of the file in rad."""
        return math.radians(value) if self.compiler.degrees else value

    def pose(self, keys: dict[str, str], where: str) -> Float[np.ndarray, "4 4"]:
        """Return the pose that ``pos`` and an orientation state, T_parent_element."""
        T = np.eye(4)
        T[:3, 3] = self.numbers(keys.get("pos", "0 0 0"), [3], f"{where}: pos")
        stated = [key for key in ORIENTATIONS if key in keys]
        if len(stated) > 1:
            raise self.fail(where, ", ".join(stated), "one orientation")
        if stated:
            T[:3, :3] = self._rotation(stated[0], keys[stated[0]], f"{where}: {stated[0]}")
        return T

    def _rotation(self, key: str, text: str, where: str) -> Float[np.ndarray, "3 3"]:
        counts = {"quat": 4, "axisangle": 4, "xyaxes": 6, "zaxis": 3, "euler": 3}
        v = self.numbers(text, [counts[key]], where)
        if key == "euler":
            return self._euler(v)
        parts = {"axisangle": [v[:3]], "xyaxes": [v[:3], v[3:]]}.get(key, [v])
        if any(np.linalg.norm(part) < 1e-9 for part in parts):
            raise self.fail(where, text, "a direction other than 0")
        if key == "quat":
            w, *xyz = v
            return np.asarray(Rotation.from_quat([*xyz, w]).as_matrix())
        if key == "axisangle":
            unit = v[:3] / np.linalg.norm(v[:3])
            return np.asarray(Rotation.from_rotvec(self.angle(v[3]) * unit).as_matrix())
        if key == "zaxis":
            return turn_to(v)
        x = v[:3] / np.linalg.norm(v[:3])
        y = v[3:] - (v[3:] @ x) * x
        if np.linalg.norm(y) < 1e-9:
            raise self.fail(where, text, "two directions that differ")
        y /= np.linalg.norm(y)
        return np.stack([x, y, np.cross(x, y)], axis=1)

    def _euler(self, angles: Float[np.ndarray, " 3"]) -> Float[np.ndarray, "3 3"]:
        R = np.eye(3)
        for axis, angle in zip(self.compiler.sequence, angles, strict=True):
            turn = Rotation.from_euler(axis.lower(), self.angle(angle)).as_matrix()
            R = R @ turn if axis.islower() else turn @ R
        return R


def turn_to(axis: Float[np.ndarray, " 3"]) -> Float[np.ndarray, "3 3"]:
    """Return the smallest rotation that turns +z to the direction ``axis``."""
    unit = axis / np.linalg.norm(axis)
    across = np.array([-unit[1], unit[0], 0.0])
    sine = float(np.linalg.norm(across))
    if sine < 1e-10:
        return np.eye(3) if unit[2] > 0 else np.diag([1.0, -1.0, -1.0])
    turn = Rotation.from_rotvec(math.atan2(sine, unit[2]) * across / sine)
    return np.asarray(turn.as_matrix())


def read_text(path: Path, root: ET.Element) -> MjcfText:
    """Return the text of the MJCF file at ``path``, whose root is ``root``.

    Raises:
        UserError: if an included file cannot be read, or the settings are not supported.
    """
    text = MjcfText(path, root)
    _include(text, root, [path.resolve()], 0)
    for element in root.findall("compiler"):
        _compile(text, element)
    text.classes[MAIN] = {}
    for element in root.findall("default"):
        _collect(text, element, MAIN)
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


def _compile(text: MjcfText, element: ET.Element) -> None:
    compiler = text.compiler
    for key, allowed in (("angle", ("degree", "radian")), ("coordinate", ("local",))):
        if element.get(key, allowed[0]) not in allowed:
            raise text.fail(f"compiler: {key}", element.get(key), ", ".join(allowed))
    compiler.degrees = element.get("angle", "degree" if compiler.degrees else "radian") == "degree"
    compiler.sequence = element.get("eulerseq", compiler.sequence)
    if len(compiler.sequence) != 3 or set(compiler.sequence.lower()) - set("xyz"):
        raise text.fail("compiler: eulerseq", compiler.sequence, "three of the axes x, y, z")
    compiler.meshdir = element.get("meshdir", element.get("assetdir", compiler.meshdir))
    compiler.bare = element.get("strippath", "true" if compiler.bare else "false") == "true"


def _collect(text: MjcfText, element: ET.Element, outer: str, deep: int = 0) -> None:
    """Add the default class of an element ``default``, and those in it."""
    name = element.get("class", MAIN if deep == 0 else "")
    if not name or (name in text.classes and name != MAIN):
        raise text.fail("default: class", name, "a unique name for each class")
    if deep == 0 and name != MAIN:  # the outermost class may have any name
        text.classes.setdefault(name, text.classes[MAIN])
    known = {tag: dict(keys) for tag, keys in text.classes[outer].items()}
    for child in element:
        if child.tag != "default":
            kept = known.get(child.tag, {})
            if any(key in child.attrib for key in ORIENTATIONS):
                kept = {key: value for key, value in kept.items() if key not in ORIENTATIONS}
            known[child.tag] = kept | child.attrib
    text.classes[name] = known
    if deep == 0:
        text.classes[MAIN] = known
    for child in element:
        if child.tag == "default":
            _collect(text, child, name, deep + 1)
