"""One page that plays a planned motion in one browser."""

import threading
import time
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np
import viser
import viser.transforms
from jaxtyping import Float

from ..coverage.definitions.escaping import printable
from ..coverage.rings.ring import Setup
from ..coverage.robots.kinematics import forward
from ..coverage.robots.robot import BASE
from ..objectives.scene import Scene
from ..reporting.rendering.meshes import band, capsule, faces_of, faces_within, joined, rod, tube
from ..reporting.rendering.surface import Surface
from . import html as words
from .browser import BrowserPage, closing, set_value
from .camera import ASPECT, VIEWS, FittedCamera, fitted
from .colours import CURVE, FLOOR, OBSTACLE, ROBOT, link_colours
from .drawing import DrawnMesh, Edges, Item
from .scene_graph import Ray, SceneGraph
from .triangle_meshes import grid
from .worker import UserActions

TENTH = 0.1
_AROUND = np.array([[-0.4], [0.4]])  # m, about the joints of all poses
_STICK = 0.02  # m, radius of the links of a robot without bodies


@dataclass(frozen=True)
class PlannedMotion:
    """Joint angles in time, and the poses at which the robot stands."""

    time: Float[np.ndarray, " T"]
    """Times from 0, s."""
    joints: Float[np.ndarray, "T J"]
    """Joint values, rad or m; between two times they change evenly."""
    stops: tuple[tuple[str, float], ...]
    """Name and time, s, of each pose at which the robot stands, in order."""

    def pose(self, at: float) -> Float[np.ndarray, " J"]:
        """Return the joint values (J,) at a time, s."""
        return np.array([np.interp(at, self.time, joint) for joint in self.joints.T])

    def stop(self, at: float) -> int:
        """Return the number of the stop at a time, s, or the next one."""
        times = [time for _, time in self.stops]
        return min(int(np.searchsorted(times, at - 1e-9)), len(times) - 1)


@dataclass
class Clock:
    """Position in a motion, for one page; several threads use it."""

    end: float
    """Duration of the motion, s."""
    at: float = 0.0
    """Position, s."""
    rate: float = 1.0
    """Seconds of the motion in a second."""
    playing: bool = False
    """Whether it runs."""
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def jump(self, at: float) -> None:
        """Go to a position, s."""
        with self._lock:
            self.at = min(max(at, 0.0), self.end)

    def play(self) -> None:
        """Run, from the start if the end is reached."""
        with self._lock:
            self.at = 0.0 if self.at >= self.end else self.at
            self.playing = True

    def advance(self, seconds: float) -> bool:
        """Let ``seconds`` pass; return whether the position changed. It stops at the end."""
        with self._lock:
            if not self.playing:
                return False
            self.at = min(self.at + self.rate * seconds, self.end)
            self.playing = self.at < self.end
            return True


class MotionSession:
    """A motion of a robot with rings in its cell, for many pages at once."""

    def __init__(
        self,
        scene: Scene,
        setup: Setup,
        motion: PlannedMotion,
        notes: tuple[str, ...] = (),
        title: str = "Motion",
    ) -> None:
        """Prepare the drawing.

        Args:
            scene: robot and cell.
            setup: the rings.
            motion: what to show.
            notes: texts beside it.
            title: title of its pages.
        """
        self.scene, self.motion, self.notes, self.title = scene, motion, notes, title
        frames = np.asarray(forward(scene.robot.chain, motion.joints))
        self._tcp = frames[:, -1, :3, 3]
        places = frames[..., :3, 3].reshape(-1, 3)
        self.box = np.stack([places.min(axis=0), places.max(axis=0)]) + _AROUND  # (2, 3)
        self.links = self._links(setup)

    def start_view(self) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]:
        """Return the camera's position and the point that it looks at, both (3,) m, for a window
        of a common shape."""
        return fitted(self.extent(), VIEWS["Iso"], ASPECT)

    def extent(self) -> Float[np.ndarray, "8 3"]:
        """Return the corners (8, 3) m of a box about all that moves."""
        return np.array(list(product(*self.box.T)))

    def frames(self, at: float) -> Float[np.ndarray, "F 4 4"]:
        """Return the frames of all links and the TCP (F, 4, 4) m at a time, s."""
        return np.asarray(forward(self.scene.robot.chain, self.motion.pose(at)))

    def backdrop(self) -> dict[str, Item]:
        """Draw what does not move: the cell, and the way of the TCP."""
        found: dict[str, Item] = {
            "floor": Edges(grid(2.0, 0.5), FLOOR, 1.0),
            "way": Edges(np.stack([self._tcp[:-1], self._tcp[1:]], axis=1), CURVE, 1.5),
        }
        for i, obstacle in enumerate(self.scene.obstacles):
            corners = faces_within(obstacle.body, self.box).reshape(-1, 3)
            if len(corners):
                faces = np.arange(len(corners)).reshape(-1, 3)
                found[f"obstacle{i}"] = DrawnMesh(corners, faces, OBSTACLE, 0.7)
        return found

    def _links(self, setup: Setup) -> dict[int, dict[str, DrawnMesh]]:
        """Return the bodies that each frame of ``forward``, or ``BASE``, carries, in that frame."""
        robot, found = self.scene.robot, dict[int, dict[str, DrawnMesh]]()
        surfaces = dict[int, list[Surface]]()
        for body in robot.bodies:
            one = body.capsule
            circles = capsule(np.asarray(one.start), np.asarray(one.end), float(one.radius))
            surfaces.setdefault(body.frame, []).append(tube(circles))
        for carried in robot.carried:
            corners = faces_of(carried.body).reshape(-1, 3)
            faces = np.arange(len(corners)).reshape(-1, 3)
            surfaces.setdefault(carried.frame, []).append((corners, faces))
        if not robot.bodies:
            for j, T in enumerate(robot.chain.origin, start=BASE):
                if np.linalg.norm(T[:3, 3]) > 1e-6:
                    surfaces[j] = [tube(rod(np.zeros(3), T[:3, 3], _STICK))]
        for frame, some in surfaces.items():
            found.setdefault(frame, {})["body"] = DrawnMesh(*joined(some), ROBOT)
        still = np.tile(np.eye(4), (len(robot.chain) + 1, 1, 1))
        colours = link_colours(robot.links)
        for i, ring in enumerate(setup.rings):
            hoop = tube(band(self.scene, still, ring))
            frame = robot.mount(ring.link).frame
            found.setdefault(frame, {})[f"ring{i}"] = DrawnMesh(*hoop, colours[ring.link], 1.0)
        return found


_PERIOD = 0.05  # s between two pictures
_PATIENCE = 2.0  # s for the thread to end


class MotionPage:
    """A page for one client: a list of poses, a slider of the time, and a button to play."""

    def __init__(self, client: viser.ClientHandle, room: MotionSession) -> None:
        """Build the controls and show the start."""
        self._client, self._room = client, room
        self.clock, self._actions = Clock(float(room.motion.time[-1])), UserActions()
        self._ended, self._drawing = threading.Event(), threading.Lock()
        self._camera, browser = FittedCamera(client), BrowserPage(client)
        browser.title(printable(f"{room.title} · place-rings"))
        client.scene.configure_default_lights(cast_shadow=False)
        client.scene.add_frame("/base", axes_length=0.25, axes_radius=0.006)
        SceneGraph(client.scene, "/cell", (0.0, 0.0, 0.0), _nothing).show(room.backdrop())
        self._frames: dict[int, viser.FrameHandle] = {}
        for frame, items in room.links.items():
            graph = SceneGraph(client.scene, f"/link{frame}", (0.0, 0.0, 0.0), _nothing)
            graph.show(dict(items))
            if frame != BASE:
                self._frames[frame] = graph.frame
        gui, stops = client.gui, room.motion.stops
        self._names = [f"{i}: {name}" for i, (name, _) in enumerate(stops)]
        self.said = gui.add_html("")
        self.play = gui.add_button("Play")
        self.tenth = gui.add_checkbox("A tenth of the speed", False)
        self.time: Any = gui.add_slider(
            "Time, s", 0.0, max(round(self.clock.end, 2), 0.01), 0.01, initial_value=0.0
        )
        self.views = gui.add_button_group("View from", tuple(VIEWS))
        self.stop: Any = gui.add_dropdown("Pose", self._names, initial_value=self._names[0])
        gui.add_html(words.paragraphs(room.notes))
        self._connect()
        self._camera.show(room.extent(), VIEWS["Iso"])
        client.camera.on_update(lambda _: self._follow())
        self._show()
        self._thread = threading.Thread(target=self._run, name="motion", daemon=True)
        self._thread.start()

    def _connect(self) -> None:
        self._actions.press(self.play, self._turn)
        self._actions.on(self.tenth, self._slow_down)
        self._actions.on(self.time, self._jump)
        self._actions.on(self.stop, self._go)
        self._actions.choose(self.views, self._look)

    def _turn(self) -> None:
        if self.clock.playing:
            self.clock.playing = False
        else:
            self.clock.play()
        self._show()

    def _slow_down(self, on: Any) -> None:
        self.clock.rate = TENTH if on else 1.0

    def _jump(self, at: Any) -> None:
        """Go to a time; a browser may send what the slider would not allow."""
        if isinstance(at, int | float) and at == at:
            self.clock.jump(float(at))
            self._show()

    def _go(self, name: Any) -> None:
        """Go to a pose of the list, and stay there."""
        if name in self._names:
            self.clock.playing = False
            self.clock.jump(self._room.motion.stops[self._names.index(name)][1])
            self._show()

    def _look(self, view: Any) -> None:
        """Look from a standard view."""
        if view in VIEWS:
            self._camera.show(self._room.extent(), VIEWS[view])

    def _follow(self) -> None:
        """Keep the view fitted to the window."""
        if not self._ended.is_set():
            self._camera.follow()

    def _run(self) -> None:
        before = time.monotonic()
        while not self._ended.wait(_PERIOD):
            now = time.monotonic()
            if self.clock.advance(now - before):
                with closing():
                    self._show()
            before = now

    def _show(self) -> None:
        with self._drawing:
            at, motion = self.clock.at, self._room.motion
            frames = self._room.frames(at)
            stop = motion.stop(at)
            with self._client.atomic():
                for frame, handle in self._frames.items():
                    T = frames[frame]
                    handle.wxyz = viser.transforms.SO3.from_matrix(T[:3, :3]).wxyz
                    handle.position = T[:3, 3]
            arrived = abs(motion.stops[stop][1] - at) < 1e-6
            self.said.content = words.note(
                f"{at:.1f} of {self.clock.end:.1f} s: {'at' if arrived else 'on the way to'}"
                f" pose {self._names[stop]}"
            )
            self.play.label = "Pause" if self.clock.playing else "Play"
            set_value(self.time, round(at, 2))
            if arrived:
                set_value(self.stop, self._names[stop])
            self._client.flush()

    def close(self) -> None:
        """End when the browser disconnects or the server ends."""
        self._ended.set()
        self._actions.close()
        if threading.current_thread() is not self._thread:
            self._thread.join(_PATIENCE)


def _nothing(_: int, __: Ray) -> None:
    """Ignore a click."""
