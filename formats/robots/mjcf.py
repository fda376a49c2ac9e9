"""Reader of MJCF, MuJoCo's robot files, as the links and joints of a URDF, by MuJoCo itself.

A body becomes a link, and each of its joints a joint; a body with several joints, or whose joint
turns about another point than its origin, becomes several links. Shapes of the world belong to
the cell and are left out, as is everything that is no body, joint or shape.
"""

import math
import re
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from ...coverage.definitions.errors import UserError, shown
from ...coverage.robots.kinematics import transform
from ..optional_dependencies import require
from .mjcf_text import MjcfText, read_text, written
from .urdf_model import MOST_LINKS, Joint, Urdf, UrdfLink, UrdfShape, rotation

WORLD = "world"
_TOOL = re.compile(r"(^|[_.\-])(attachment|tool\d*|tcp|flange|ee|eef|end[_-]?effector|grasp|pinch)")
_IGNORED = ("equality", "tendon", "deformable")
_FREE, _SLIDE, _HINGE = 0, 2, 3  # MuJoCo's types of joints; 1 is a ball
_KINDS = ("floating", "floating", "prismatic", "revolute")
_UNBOUNDED = {0: "plane", 1: "hfield", 8: "sdf"}  # MuJoCo's types of geoms
_SHAPES = {2: ("sphere", (1,)), 3: ("capsule", (1, 2)), 4: ("ellipsoid", (1, 1, 1))}
_SHAPES |= {5: ("cylinder", (1, 2)), 6: ("box", (2, 2, 2))}
Transform = Float[np.ndarray, "4 4"]


@dataclass(frozen=True)
class _Mesh:
    """A mesh of a file."""

    file: str
    """Its file, relative to the folder of the MJCF file."""
    scale: tuple[float, ...]
    """Scale along x, y and z."""
    T_shape_file: Transform
    """Pose of the scaled mesh in its shape's frame."""


@dataclass
class _Links:
    """Links and joints while they are read."""

    links: dict[str, UrdfLink] = field(default_factory=dict)
    joints: dict[str, Joint] = field(default_factory=dict)

    def link(self, name: str, **shapes: tuple[UrdfShape, ...]) -> str:
        """Add a link with a unique name like ``name``, and return that."""
        unique = _unique(name, self.links)
        self.links[unique] = UrdfLink(unique, **shapes)
        return unique

    def join(
        self,
        name: str,
        parent: str,
        child: str,
        T: Transform,
        kind: str = "fixed",
        axis: Float[np.ndarray, " 3"] | None = None,
        limits: tuple[float, float] = (-math.inf, math.inf),
    ) -> None:
        """Add a joint with a unique name like ``name``."""
        unique = _unique(name, self.joints)
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
    """Reads the links and joints of a compiled model.

    Args:
        text: the file.
    """

    def __init__(self, text: MjcfText) -> None:
        self.ignored, self.made = set[str](), _Links()
        self._meshes = dict[int, _Mesh]()  # by geom
        self._model = self._compiled(text)
        self._names = [WORLD]  # link of each body

    def _compiled(self, text: MjcfText) -> Any:
        """Return the model; a box stands for each mesh, so that MuJoCo opens no file."""
        import mujoco

        try:
            spec = mujoco.MjSpec.from_string(text.plain())
            if not 1 <= len(spec.bodies) - 1 <= MOST_LINKS:
                raise text.fail("body", len(spec.bodies) - 1, f"1 to {MOST_LINKS} bodies")
            assets = {mesh.name: mesh for mesh in spec.meshes}
            geoms = []
            for geom in list(spec.geoms):
                where = f"body {shown(written(geom.parent.name))}: geom"
                if geom.parent.name == WORLD:
                    self.ignored.add("shapes of the world, which belong to the cell")
                    spec.delete(geom)
                elif int(geom.type) in _UNBOUNDED:
                    self.ignored.add(f"geom {_UNBOUNDED[int(geom.type)]} of {where[:-6]}")
                    spec.delete(geom)
                elif name := geom.meshname:  # a primitive shape would be fitted to the mesh
                    if name not in assets:
                        allowed = "a mesh of the file's assets"
                        raise text.fail(f"{where}: mesh", written(name), allowed)
                    geoms.append((geom, _mesh(text, assets[name], where)))
                    geom.type, geom.meshname = mujoco.mjtGeom.mjGEOM_BOX, ""
                    geom.size, geom.fromto = [0.01] * 3, [math.nan] * 6
            for mesh in list(spec.meshes):
                spec.delete(mesh)
            for joint in spec.joints:
                joint.armature = 1.0  # joints with one axis would have a singular inertia
            model = spec.compile()
        except (ValueError, mujoco.FatalError) as error:
            reason = re.sub(r",? line -?\d+", "", " ".join(written(str(error)).split()))
            raise UserError(f"{text.path}: MuJoCo cannot read it: {reason}") from error
        self._meshes = {geom.id: mesh for geom, mesh in geoms}
        return model

    def read(self) -> None:
        """Add the links and joints of all bodies."""
        model = self._model
        self.made.link(WORLD)
        for body in range(1, model.nbody):
            name = written(model.body(body).name) or f"body_{len(self.made.links)}"
            T = _pose(model.body_pos[body], model.body_quat[body])
            first = model.body_jntadr[body]
            joints = range(first, first + model.body_jntnum[body])
            if any(model.jnt_type[j] == _FREE for j in joints):
                link = self.made.link(name, **self._shapes(body))  # a root of its own
            else:
                link = self._jointed(name, body, joints, T)
            self._names.append(link)
            for site in np.flatnonzero(model.site_bodyid == body):
                label = written(model.site(site).name)
                if _TOOL.search(label.lower()):
                    tip = self.made.link(label)
                    place = _pose(model.site_pos[site], model.site_quat[site])
                    self.made.join(f"{tip}_site", link, tip, place)
        self.ignored |= self.made.drop_idle()

    def _jointed(self, name: str, body: int, joints: range, T: Transform) -> str:
        """Add the joints of a body between its parent and its link; return the link's name."""
        model, back, shapes = self._model, np.eye(4), self._shapes(body)
        at: str = self._names[model.body_parentid[body]]
        for i, j in enumerate(joints):
            number = f"_{i}" if len(joints) > 1 else ""
            joint = written(model.joint(j).name) or f"{name}_joint{number}"
            anchor, axis, kind = model.jnt_pos[j], model.jnt_axis[j].copy(), int(model.jnt_type[j])
            last = j == joints[-1] and not anchor.any()
            own = self.made.link(name if last else f"{name}_at_{joint}", **(shapes if last else {}))
            limited = bool(model.jnt_limited[j]) and kind in (_SLIDE, _HINGE)
            limits = tuple(model.jnt_range[j].tolist()) if limited else (-math.inf, math.inf)
            named = "continuous" if kind == _HINGE and not limited else _KINDS[kind]
            start = np.eye(4)  # the motion from the value at which the file states the body to 0
            stated = float(model.qpos0[model.jnt_qposadr[j]])
            if kind == _HINGE:
                start = rotation(axis, -stated)
            elif kind == _SLIDE:
                start = transform(-stated * axis)
            place = T @ back @ transform(anchor) @ start
            self.made.join(joint, at, own, place, named, axis, limits)
            T, back, at = np.eye(4), transform(-anchor), own
        if joints and not back[:3, 3].any():
            return at
        link = self.made.link(name, **shapes)
        self.made.join(f"{name}_fixed", at, link, T @ back)
        return link

    def _shapes(self, body: int) -> dict[str, tuple[UrdfShape, ...]]:
        """Return the shapes of a body: visual where they are displayed, of collision where they
        touch others."""
        model, first = self._model, self._model.body_geomadr[body]
        visual, collision = [], []
        for i in range(first, first + model.body_geomnum[body]):
            T = _pose(model.geom_pos[i], model.geom_quat[i])
            if (mesh := self._meshes.get(i)) is not None:
                shape = UrdfShape("mesh", T @ mesh.T_shape_file, mesh.scale, mesh.file)
            else:
                kind, factors = _SHAPES[int(model.geom_type[i])]
                size = zip(factors, model.geom_size[i].tolist(), strict=False)
                shape = UrdfShape(kind, T, tuple(factor * length for factor, length in size))
            displayed = model.geom_group[i] in (0, 1, 2)
            if displayed:
                visual.append(shape)
            if model.geom_contype[i] or model.geom_conaffinity[i] or not displayed:
                collision.append(shape)
        return {"visual": tuple(visual), "collision": tuple(collision)}


def _unique(name: str, taken: dict[str, Any]) -> str:
    unique, n = name, 2
    while unique in taken:
        unique, n = f"{name}_{n}", n + 1
    return unique


def _pose(place: Float[np.ndarray, " 3"], turn: Float[np.ndarray, " 4"]) -> Transform:
    """Return the pose (4, 4) of a place, m, and a quaternion w, x, y, z."""
    T = transform(place)
    T[:3, :3] = Rotation.from_quat(turn, scalar_first=True).as_matrix()
    return T


def _mesh(text: MjcfText, asset: Any, where: str) -> _Mesh:
    """Return a mesh of MuJoCo's ``asset``, with the pose that its ``refpos`` and ``refquat``
    state."""
    if not asset.file:
        raise text.fail(f"{where}: mesh", written(asset.name), "a mesh with a file")
    folder, bare = text.meshes
    file = PurePosixPath(written(asset.file).replace("\\", "/"))
    file = PurePosixPath(file.name) if bare else file
    file = file if file.is_absolute() else PurePosixPath(folder.replace("\\", "/")) / file
    scale, turn = np.array(asset.scale), np.array(asset.refquat)
    where = f"mesh {shown(written(asset.name))}"
    if turn[1:].any() and np.ptp(scale) > 1e-12:
        raise text.fail(f"{where}: refquat", turn.tolist(), "none, where the scale is uneven")
    T = np.linalg.inv(_pose(np.zeros(3), turn)) @ transform(-np.array(asset.refpos) * scale)
    return _Mesh(file.as_posix(), tuple(scale.tolist()), T)


def read_mjcf(path: Path, root: ET.Element) -> Urdf:
    """Return the robot in an MJCF file, whose root is ``root``.

    Raises:
        UserError: if it cannot be read or is not supported, or MuJoCo is not installed.
    """
    require("mujoco", str(path), "mujoco")
    text = read_text(path, root)
    reader = _Reader(text)
    reader.read()
    reader.ignored |= {
        tag for tag in _IGNORED if (part := root.find(tag)) is not None and len(part)
    }
    notes = (f"Ignored: {', '.join(sorted(reader.ignored))}.",) if reader.ignored else ()
    name = root.get("model") or PurePosixPath(path.name).stem
    return Urdf(path, name[:100], reader.made.links, reader.made.joints, notes)
