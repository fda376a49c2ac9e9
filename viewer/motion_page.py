"""One page that plays a planned motion in one browser."""

import threading
import time
from typing import Any

import viser
import viser.transforms

from ..coverage.definitions.escaping import printable
from ..coverage.robots.robot import BASE
from . import html as words
from .browser import BrowserPage, closing, set_value
from .camera import VIEWS, FittedCamera
from .motion import TENTH, Clock, MotionSession
from .scene_graph import Ray, SceneGraph
from .worker import UserActions

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
