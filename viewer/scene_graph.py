"""Transfer of named arrays to a browser; unchanged items are not sent again."""

from collections.abc import Callable
from typing import Any

import numpy as np
import viser

from .colours import on_page, rgb
from .drawing import Dots, DrawnMesh, Edges, Item

# origin, m, and direction of a click's ray, in the frame of the setup
Ray = tuple[np.ndarray, np.ndarray]


class SceneGraph:
    """Items of one page below one frame of its scene."""

    def __init__(
        self,
        scene: viser.SceneApi,
        root: str,
        place: tuple[float, float, float],
        click: Callable[[int, Ray], None],
    ) -> None:
        """Create the frame.

        Args:
            scene: scene of the page.
            root: name of the frame.
            place: position of the frame, m.
            click: receives the index of the ring that the user clicked, and the ray of the click,
                in viser's own thread.
        """
        self._scene, self._root, self._click = scene, root, click
        self._place, self._dark = np.array(place), False
        self._shown: dict[str, tuple[Item, Any]] = {}
        self.frame = scene.add_frame(root, show_axes=False, position=place)

    def show(self, items: dict[str, Item], dark: bool = False) -> None:
        """Show exactly these items, on a light or dark page."""
        if dark != self._dark:
            self._dark = dark
            for _, handle in self._shown.values():
                handle.remove()
            self._shown.clear()
        for name in self._shown.keys() - items.keys():
            self._shown.pop(name)[1].remove()
        for name, item in items.items():
            old = self._shown.get(name)
            if old is None or not _alike(old[0], item):
                self._shown[name] = item, self._add(f"{self._root}/{name}", item)

    def _add(self, name: str, item: Item) -> Any:
        """Add an item; it replaces one of the same name."""
        scene, colour = self._scene, rgb(on_page(item.colour, self._dark))
        if isinstance(item, Dots):
            return scene.add_point_cloud(
                name,
                item.points,
                colour,
                point_size=item.size,
                point_shape="circle",
                point_shading="gradient",
            )
        if isinstance(item, Edges):
            colours = np.broadcast_to(np.array(colour, np.uint8), item.ends.shape)
            return scene.add_line_segments(
                name, item.ends, colours, thickness=item.width, thickness_units="screen"
            )
        solid = item.opacity >= 1.0
        handle = scene.add_mesh_simple(
            name,
            item.vertices,
            item.faces,
            color=colour,
            opacity=None if solid else item.opacity,
            side="double",
            cast_shadow=False,
            receive_shadow=False,
        )
        if (ring := item.ring) is not None:
            self._listen(handle, ring)
        return handle

    def _listen(self, handle: Any, ring: int) -> None:
        async def clicked(event: Any) -> None:
            origin, direction = np.array(event.ray_origin), np.array(event.ray_direction)
            self._click(ring, (origin - self._place, direction))

        handle.on_click(clicked)


def _alike(a: Item, b: Item) -> bool:
    """Return whether two items are the same.

    ``Drawing`` keeps unchanged arrays, so identity is enough; arrays of points are always new.
    """
    if isinstance(a, Dots) and isinstance(b, Dots):
        return (a.colour, a.size) == (b.colour, b.size) and np.array_equal(a.points, b.points)
    if isinstance(a, DrawnMesh) and isinstance(b, DrawnMesh):
        same = a.vertices is b.vertices and a.faces is b.faces
        return same and (a.colour, a.opacity, a.ring) == (b.colour, b.opacity, b.ring)
    if isinstance(a, Edges) and isinstance(b, Edges):
        return a.ends is b.ends and (a.colour, a.width) == (b.colour, b.width)
    return False
