"""GLB: a 3D scene with robot, obstacles, rings, sensors, their beams, and points of the targets."""

from typing import Any

import numpy as np
import trimesh
from trimesh.visual.material import PBRMaterial

from ...coverage.robots.robot import BASE
from ...objectives.occlusion import setup_sight
from .glb_animation import animated
from .palette import COVERED_ONCE, SENSOR, UNCOVERED, rgb
from .placed import BASE_LINK, PlacedSetup
from .scene_parts import ScenePart, node_names, scene_parts

_UNIT = (0.006, 0.008)  # m, displayed radius and length of a sensor
_Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])  # glTF has y up


def glb(placed: PlacedSetup) -> dict[str, bytes]:
    """Return ``scene.glb``: the node ``base_link`` is the base frame; nodes with sensor names look
    along their z axis. A node for each joint carries what moves with it; if the scene has several
    poses, an animation moves these nodes through them."""
    scene, nodes = trimesh.Scene(base_frame="world"), node_names(placed)
    scene.graph.update(frame_to=BASE_LINK, matrix=_Y_UP @ placed.T_world_base)
    parents = [BASE_LINK, *nodes]
    T_base_parent = np.concatenate([np.eye(4)[None], placed.T_base_frame[:-1]])
    for name, parent, T, before in zip(
        nodes, parents, placed.T_base_frame, T_base_parent, strict=False
    ):
        scene.graph.update(frame_to=name, frame_from=parent, matrix=np.linalg.inv(before) @ T)
    for part in scene_parts(placed):
        _add(scene, placed, nodes, part)
    unit = trimesh.creation.cylinder(_UNIT[0], _UNIT[1], sections=16)
    unit.visual = trimesh.visual.TextureVisuals(material=_material(SENSOR))
    for s in placed.sensors:
        scene.add_geometry(
            unit,
            node_name=s.name,
            geom_name="sensor",
            parent_node_name=_node(nodes, s.frame),
            transform=s.T_frame_sensor,
        )
    _add_points(scene, placed)
    data = scene.export(file_type="glb")
    if len(placed.scene.poses) > 1:
        chain = placed.scene.robot.chain
        data = animated(data, nodes[: len(chain)], chain, placed.scene.poses)
    return {"scene.glb": data}


def _node(nodes: tuple[str, ...], frame: int) -> str:
    return BASE_LINK if frame == BASE else nodes[frame]


def _rgba(colour: str, opacity: float = 1.0) -> Any:
    return np.round(255 * np.array([*rgb(colour), opacity])).astype(np.uint8)


def _material(colour: str, opacity: float = 1.0) -> Any:
    clear = opacity < 1
    return PBRMaterial(
        baseColorFactor=_rgba(colour, opacity),
        metallicFactor=0.0,
        roughnessFactor=0.8,
        alphaMode="BLEND" if clear else "OPAQUE",
        doubleSided=clear,
    )


def _add(scene: Any, placed: PlacedSetup, nodes: tuple[str, ...], part: ScenePart) -> None:
    """Add a mesh to the node of its frame."""
    mesh = part.on_frame(placed)
    mesh.visual = trimesh.visual.TextureVisuals(material=_material(part.colour, part.opacity))
    names = {"node_name": part.name, "geom_name": part.name}
    scene.add_geometry(mesh, parent_node_name=_node(nodes, part.frame), **names)


def _add_points(scene: Any, placed: PlacedSetup) -> None:
    """Add points of each target: covered points in one colour, uncovered points in another."""
    q = placed.scene.poses[placed.pose].q
    for n, goal in enumerate(placed.scene.targets if placed.points else ()):
        points = placed.scene.sample(goal.target, placed.pose, placed.points, 0)
        seen = np.asarray(setup_sight(placed.scene, placed.setup, q).holds(points))
        for name, some, colour in (("seen", seen, COVERED_ONCE), ("unseen", ~seen, UNCOVERED)):
            if some.any():
                colours = np.tile(_rgba(colour), (int(some.sum()), 1))
                cloud = trimesh.PointCloud(points[some], colors=colours)
                node = f"target_{n}_{name}"
                scene.add_geometry(
                    cloud, node_name=node, geom_name=node, parent_node_name=BASE_LINK
                )
