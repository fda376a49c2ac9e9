"""Reader of MJCF, MuJoCo's robot files, as the links and joints of a URDF.

A body becomes a link, and each of its joints a joint; a body with several joints, or whose joint
turns about another point than its origin, becomes several links. Shapes of the world belong to
the cell and are left out, as is everything that is no body, joint or shape.
"""

import math
import re
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from ...coverage.robots.kinematics import transform
from ..errors import shown
from .mjcf_shapes import MeshAsset, meshes_of, shape_of
from .mjcf_text import MAIN, MjcfText, read_text
from .urdf_model import MOST_LINKS, Joint, Urdf, UrdfLink, UrdfShape

WORLD = "world"
_TOOL = re.compile(r"(^|[_.\-])(attachment|tool\d*|tcp|flange|ee|eef|end[_-]?effector|grasp|pinch)")
_REFUSED = ("replicate", "attach", "composite", "flexcomp")  # they make bodies of their own
_IGNORED = ("equality", "tendon", "deformable")
_MOVING = {"hinge": "revolute", "slide": "prismatic", "ball": "floating", "free": "floating"}


@dataclass
class _Links:
    """Links and joints while they are read."""

    links: dict[str, UrdfLink] = field(default_factory=dict)
    joints: dict[str, Joint] = field(default_factory=dict)

    def link(self, name: str, **shapes: tuple[UrdfShape, ...]) -> str:
        """Add a link with a unique name like ``name``, and return that."""
        unique, n = name, 2
        while unique in self.links:
            unique, n = f"{name}_{n}", n + 1
        self.links[unique] = UrdfLink(unique, **shapes)
        return unique

    def join(
        self,
        name: str,
        parent: str,
        child: str,
        T: Float[np.ndarray, "4 4"],
        kind: str = "fixed",
        axis: Float[np.ndarray, " 3"] | None = None,
        limits: tuple[float, float] = (-math.inf, math.inf),
    ) -> None:
        """Add a joint with a unique name like ``name``."""
        unique, n = name, 2
        while unique in self.joints:
            unique, n = f"{name}_{n}", n + 1
        unit = np.array([1.0, 0.0, 0.0]) if axis is None else axis
        self.joints[unique] = Joint(unique, kind, parent, child, T, unit, limits)

    def drop_idle(self) -> set[str]:
        """Remove the trees in which nothing moves, unless there is only one: things to grasp, or a
        world with shapes alone; return what they are."""
        above = {joint.child: joint for joint in self.joints.values()}
        trees: dict[str, list[str]] = {}
        for name in self.links:
            root = name
            while root in above:
                root = above[root].parent
            trees.setdefault(root, []).append(name)
        moved = {root: any(above[n].moves for n in of if n in above) for root, of in trees.items()}
        if not any(moved.values()):
            return set()
        dropped = {root for root, moves in moved.items() if not moves}
        for name in [name for root in dropped for name in trees[root]]:
            del self.links[name]
            if name in above:
                del self.joints[above[name].name]
        return {f"body {shown(root)}, which no joint moves" for root in dropped - {WORLD}}


class _Reader:
    def __init__(self, text: MjcfText) -> None:
        self.text, self.made = text, _Links()
        self.meshes: dict[str, MeshAsset] = meshes_of(text)
        self.ignored: set[str] = set()

    def body(
        self, element: ET.Element, parent: str, T: Float[np.ndarray, "4 4"], inherited: str
    ) -> None:
        """Add a body that stands at T in its parent's frame."""
        name = element.get("name") or f"body_{len(self.made.links)}"
        where, inherited = f"body {shown(name)}", element.get("childclass", inherited)
        T = T @ self.text.pose(dict(element.attrib), where)
        each = list(self._parts(element, np.eye(4), inherited, where))
        if any(part.tag == "freejoint" or keys.get("type") == "free" for part, keys, _ in each):
            link = self.made.link(name, **self._shapes(each, where))  # a root of its own
        else:
            link = self._jointed(name, each, parent, T, where)
        for part, keys, M in each:
            if part.tag == "site" and _TOOL.search(keys.get("name", "").lower()):
                tip = self.made.link(keys["name"])
                place = M @ self.text.pose(keys, f"site {shown(tip)}")
                self.made.join(f"{tip}_site", link, tip, place)
        for child, M, of in self._bodies(element, np.eye(4), inherited, where):
            self.body(child, link, M, of)

    def _jointed(
        self,
        name: str,
        each: list[tuple[ET.Element, dict[str, str], Float[np.ndarray, "4 4"]]],
        parent: str,
        T: Float[np.ndarray, "4 4"],
        where: str,
    ) -> str:
        """Add the joints of a body between ``parent`` and its link; return the link's name."""
        joints = [(part, keys) for part, keys, _ in each if part.tag == "joint"]
        back, at = np.eye(4), parent
        for i, (_, keys) in enumerate(joints):
            joint = keys.get("name") or f"{name}_joint" + (f"_{i}" if len(joints) > 1 else "")
            kind, axis, limits, anchor, start = self._joint(keys, f"joint {shown(joint)}")
            last = i == len(joints) - 1 and not anchor.any()
            shapes = self._shapes(each, where) if last else {}
            child = self.made.link(name if last else f"{name}_at_{joint}", **shapes)
            self.made.join(
                joint, at, child, T @ back @ transform(anchor) @ start, kind, axis, limits
            )
            T, back, at = np.eye(4), transform(-anchor), child
        if joints and not back[:3, 3].any():
            return at
        link = self.made.link(name, **self._shapes(each, where))
        self.made.join(f"{name}_fixed", at, link, T @ back)
        return link

    def _joint(
        self, keys: dict[str, str], where: str
    ) -> tuple[
        str,
        Float[np.ndarray, " 3"],
        tuple[float, float],
        Float[np.ndarray, " 3"],
        Float[np.ndarray, "4 4"],
    ]:
        """Return kind, axis, limits, anchor, and the motion from the value ``ref`` to 0."""
        text, kind = self.text, keys.get("type", "hinge")
        if kind not in _MOVING:
            raise text.fail(f"{where}: type", kind, ", ".join(_MOVING))
        axis = text.numbers(keys.get("axis", "0 0 1"), [3], f"{where}: axis")
        if np.linalg.norm(axis) < 1e-9:
            raise text.fail(f"{where}: axis", keys["axis"], "three numbers, not all 0")
        axis = axis / np.linalg.norm(axis)
        anchor = text.numbers(keys.get("pos", "0 0 0"), [3], f"{where}: pos")
        low, high = text.numbers(keys.get("range", "0 0"), [2], f"{where}: range")
        ref = float(text.numbers(keys.get("ref", "0"), [1], f"{where}: ref")[0])
        if kind == "hinge":
            low, high, ref = (text.angle(float(v)) for v in (low, high, ref))
        start = np.eye(4)
        if kind == "hinge":
            start[:3, :3] = Rotation.from_rotvec(-ref * axis).as_matrix()
        elif kind == "slide":
            start[:3, 3] = -ref * axis
        limited = low < high and keys.get("limited") != "false" and kind in ("hinge", "slide")
        limits = (float(low), float(high)) if limited else (-math.inf, math.inf)
        named = "continuous" if kind == "hinge" and not limited else _MOVING[kind]
        return named, axis, limits, anchor, start

    def _parts(
        self, element: ET.Element, T: Float[np.ndarray, "4 4"], inherited: str, where: str
    ) -> "list[tuple[ET.Element, dict[str, str], Float[np.ndarray, '4 4']]]":
        """Return the joints, shapes and sites of a body, those in its frames included, with their
        attributes and the poses of their frames."""
        parts = []
        for child in element:
            if child.tag in ("joint", "freejoint", "geom", "site"):
                parts.append((child, self.text.attributes(child, inherited, where), T))
            elif child.tag == "frame":
                M = T @ self.text.pose(dict(child.attrib), f"{where}: frame")
                of = child.get("childclass", inherited)
                parts += self._parts(child, M, of, where)
            elif child.tag in _REFUSED:
                raise self.text.fail(
                    where, child.tag, "body, joint, geom; save the model from MuJoCo first"
                )
        return parts

    def _bodies(
        self, element: ET.Element, T: Float[np.ndarray, "4 4"], inherited: str, where: str
    ) -> "list[tuple[ET.Element, Float[np.ndarray, '4 4'], str]]":
        """Return the bodies in a body, those in its frames included, with the poses of their
        frames and their default classes."""
        found = []
        for child in element:
            if child.tag == "body":
                found.append((child, T, inherited))
            elif child.tag == "frame":
                M = T @ self.text.pose(dict(child.attrib), f"{where}: frame")
                found += self._bodies(child, M, child.get("childclass", inherited), where)
            elif child.tag in _REFUSED:
                raise self.text.fail(
                    where, child.tag, "body, joint, geom; save the model from MuJoCo first"
                )
        return found

    def _shapes(
        self,
        each: list[tuple[ET.Element, dict[str, str], Float[np.ndarray, "4 4"]]],
        where: str,
    ) -> dict[str, tuple[UrdfShape, ...]]:
        """Return the shapes of a body: visual where they are displayed, of collision where they
        touch others."""
        visual, collision = [], []
        for part, keys, T in each:
            if part.tag != "geom":
                continue
            shape = shape_of(self.text, keys, T, self.meshes, f"{where}: geom")
            if shape is None:
                self.ignored.add(f"geom {keys.get('type', 'sphere')} of {where}")
                continue
            touches = "0" not in (keys.get("contype", "1"), keys.get("conaffinity", "1"))
            touches |= keys.get("contype", "1") != keys.get("conaffinity", "1")
            displayed = keys.get("group", "0") in ("0", "1", "2")
            if displayed:
                visual.append(shape)
            if touches or not displayed:
                collision.append(shape)
        return {"visual": tuple(visual), "collision": tuple(collision)}


def read_mjcf(path: Path, root: ET.Element) -> Urdf:
    """Return the robot in an MJCF file, whose root is ``root``.

    Raises:
        UserError: if it cannot be read or is not supported.
    """
    text = read_text(path, root)
    reader = _Reader(text)
    made = reader.made
    made.link(WORLD)
    for world in root.findall("worldbody"):
        inherited = world.get("childclass", MAIN)
        if world.find("geom") is not None:
            reader.ignored.add("shapes of the world, which belong to the cell")
        for body, T, of in reader._bodies(world, np.eye(4), inherited, "worldbody"):
            reader.body(body, WORLD, T, of)
    reader.ignored |= made.drop_idle()
    if not made.links or len(made.links) > MOST_LINKS:
        raise text.fail("body", len(made.links), f"1 to {MOST_LINKS} bodies")
    reader.ignored |= {
        tag for tag in _IGNORED if (part := root.find(tag)) is not None and len(part)
    }
    notes = (f"Ignored: {', '.join(sorted(reader.ignored))}.",) if reader.ignored else ()
    name = root.get("model") or PurePosixPath(path.name).stem
    return Urdf(path, name[:100], made.links, made.joints, notes)
