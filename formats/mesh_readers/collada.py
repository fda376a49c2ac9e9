"""Reader of the surfaces in COLLADA meshes: the triangles of a file's scene.

Nested nodes count, with all that their instances name; ``up_axis`` does not, as in ROS.
"""

import xml.etree.ElementTree as ET
from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from .collada_geometry import SURFACES, Points, Triangles, geometry_triangles
from .mesh_numbers import (
    AGAIN,
    MOST_PARTS,
    MOST_TRIANGLES,
    MeshError,
    bounded,
    numbers,
    placed,
)

_MOST_DEEP = 100  # nodes in each other, those that instances name included
_INSTANCES = ("instance_geometry", "instance_controller", "instance_node")


def read_collada(root: ET.Element) -> Float[np.ndarray, "T 3 3"]:
    """Return the triangles (T, 3, 3) of a COLLADA file's scene, in its unit.

    Raises:
        MeshError: if it lacks a part that it names, or has too many triangles.
    """
    return _Scene(root).triangles()


class _Scene:
    def __init__(self, root: ET.Element) -> None:
        for element in root.iter():
            element.tag = element.tag.rpartition(":")[2]
        surfaces = sum(element.tag in SURFACES for element in root.iter())
        bounded(surfaces, MOST_PARTS, "surfaces")
        self._root = root
        self._ids = {(e.tag, e.get("id", "")): e for e in root.iter() if e.get("id")}
        self._geometries: dict[ET.Element, Triangles] = {}
        self._counts: dict[ET.Element, int] = {}
        self._points = Points(self._named)
        self._parts = 0

    def triangles(self) -> Triangles:
        scene = self._scene()
        bounded(
            sum(self._count(node, 0) for node in self._nodes(scene)), MOST_TRIANGLES, "triangles"
        )
        parts = [t for node in self._nodes(scene) for t in self._placed(node, np.eye(4))]
        return np.concatenate(parts) if parts else np.zeros((0, 3, 3))

    def _scene(self) -> ET.Element:
        instance = self._root.find("scene/instance_visual_scene")
        if instance is not None:
            return self._named(instance, "url", "visual_scene")
        scenes = self._root.findall("library_visual_scenes/visual_scene")
        if len(scenes) != 1:
            raise MeshError(f"a file that names its scene (it has {len(scenes)}); {AGAIN}")
        return scenes[0]

    def _named(self, element: ET.Element, key: str, tag: str) -> ET.Element:
        """Return the element of the file that an attribute names."""
        name = element.get(key, "")
        named = self._ids.get((tag, name.removeprefix("#")))
        if named is None:
            raise MeshError(
                f"a file with the {tag} that it names ({name[:60]} is missing); {AGAIN}"
            )
        return named

    def _nodes(self, parent: ET.Element) -> Iterator[ET.Element]:
        """Yield the nodes and instances in a node."""
        return (child for child in parent if child.tag == "node" or child.tag in _INSTANCES)

    def _count(self, element: ET.Element, depth: int) -> int:
        """Return the number of triangles of a node or an instance."""
        if depth > _MOST_DEEP:
            raise MeshError(f"at most {_MOST_DEEP} nodes in each other (it has more)")
        if element not in self._counts:
            if element.tag == "node":
                count = sum(self._count(child, depth + 1) for child in self._nodes(element))
            elif element.tag == "instance_node":
                count = self._count(self._named(element, "url", "node"), depth + 1)
            else:
                count = len(self._instance(element)[0])
            self._counts[element] = count
        return self._counts[element]

    def _placed(self, element: ET.Element, T: Float[np.ndarray, "4 4"]) -> Iterator[Triangles]:
        """Yield the triangles of a node or an instance that stands at T."""
        if not self._counts[element]:
            return
        if element.tag == "node":
            T = T @ _pose(element)
            for child in self._nodes(element):
                yield from self._placed(child, T)
        elif element.tag == "instance_node":
            yield from self._placed(self._named(element, "url", "node"), T)
        else:
            self._parts += 1
            bounded(self._parts, MOST_PARTS, "surfaces")
            triangles, bound = self._instance(element)
            yield placed(triangles, T @ bound)

    def _instance(self, element: ET.Element) -> tuple[Triangles, Float[np.ndarray, "4 4"]]:
        """Return the triangles of an instance of a geometry, or of a controller's skin at rest,
        and the pose at which it is bound."""
        bound = np.eye(4)
        if element.tag == "instance_controller":
            controller = self._named(element, "url", "controller")
            skin = controller.find("skin")
            if skin is None:
                raise MeshError("controllers with a skin (one has none)")
            matrix = skin.findtext("bind_shape_matrix")
            bound = np.eye(4) if matrix is None else _matrix(matrix)
            geometry = self._named(skin, "source", "geometry")
        else:
            geometry = self._named(element, "url", "geometry")
        if geometry not in self._geometries:
            self._geometries[geometry] = geometry_triangles(geometry, self._points)
        return self._geometries[geometry], bound


def _matrix(text: str) -> Float[np.ndarray, "4 4"]:
    return _values(text, 16, "a matrix").reshape(4, 4)


def _values(text: str | None, count: int, what: str) -> Float[np.ndarray, " N"]:
    values: np.ndarray = numbers(text or "", np.float64, what)
    if len(values) != count or not np.isfinite(values).all():
        raise MeshError(f"{what} of {count} finite numbers (one has {len(values)}); {AGAIN}")
    return values


def _pose(node: ET.Element) -> Float[np.ndarray, "4 4"]:
    """Return the product (4, 4) of a node's transforms."""
    T = np.eye(4)
    for element in node:
        step = np.eye(4)
        if element.tag == "matrix":
            step = _matrix(element.text or "")
        elif element.tag == "translate":
            step[:3, 3] = _values(element.text, 3, "a translation")
        elif element.tag == "scale":
            step[:3, :3] = np.diag(_values(element.text, 3, "a scale"))
        elif element.tag == "rotate":
            step[:3, :3] = _rotation(_values(element.text, 4, "a rotation"))
        elif element.tag in ("lookat", "skew"):
            raise MeshError(f"nodes with a matrix (one has {element.tag}); {AGAIN}")
        with np.errstate(over="ignore", invalid="ignore"):
            T = T @ step
    return T


def _rotation(turn: Float[np.ndarray, " 4"]) -> Float[np.ndarray, "3 3"]:
    """Return the rotation (3, 3) about an axis by an angle in degrees."""
    length = float(np.linalg.norm(turn[:3]))
    if length == 0:
        return np.eye(3)
    x, y, z = turn[:3] / length
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.radians(turn[3])
    R: np.ndarray = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return R
