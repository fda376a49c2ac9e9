"""One page in one browser: its controls, its state, and its reactions to the user.

Each page has its own state, so that two users do not move the same slider. One thread changes it
as the user asks, in order; another draws the newest state; a lock guards it.
"""

import threading
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import viser

from ..coverage.definitions.errors import UserError
from ..coverage.occlusion.occlusion_mode import OCCLUSIONS
from .browser import BrowserPage, closing
from .camera import START, VIEWS, FittedCamera
from .controls import SHOWN_KINDS, STEPS, Controls, ViewControls
from .drawn_parts import BEHIND, CUTS, NONE, SHOWN_CONES, facing
from .link_state import read_query
from .long_task import LongTask
from .page_drawing import PageDrawing
from .page_edits import PageEdits, finite
from .page_state import PageState
from .page_tasks import PageTasks
from .playback import Player
from .quick_estimate import nearest_sensor
from .ring_controls import RingControls
from .ring_handles import RingHandles
from .scene_graph import Ray, SceneGraph
from .session import ViewerSession
from .worker import UserActions


class Page:
    """A page for one client."""

    def __init__(self, client: viser.ClientHandle, room: ViewerSession) -> None:
        """Build the controls and show the setups as opened."""
        self._client, self._room = client, room
        self._closed = False
        self.state = PageState.of(room.scene, {str(t): t for t in room.targets}, room.setups)
        self._actions = UserActions()
        stages = [
            SceneGraph(
                client.scene, f"/setup{i}", place, partial(self._actions.do, self._clicked, i)
            )
            for i, place in enumerate(room.places())
        ]
        client.scene.configure_default_lights(cast_shadow=False)
        client.scene.add_frame("/base", axes_length=0.25, axes_radius=0.006)
        self.controls = Controls(client.gui, room, list(room.setups))
        self.camera, self._browser = FittedCamera(client), BrowserPage(client)
        self._work = LongTask(self.controls, room.turn)
        handles = RingHandles(client.scene, partial(self._actions.do, self._dragged))
        self._player = Player(len(room.scene.poses), self._go, self._playing)
        parts = self.controls, stages, handles, self.camera, self._browser
        self._drawing = PageDrawing(client, room, *parts, self.state.snapshot, self._attempt)
        self._edits = PageEdits(self.state, room, self.controls, self._show)
        self._tasks = PageTasks(client, self.state, room, self.controls, self._work, self._drawing)
        self._connect()
        self._look(START)
        self._drawing.then(self._opened)

    def _opened(self) -> None:
        """Follow the browser's camera and its address. A browser that still loads its first
        picture may report another view than the one it was given.
        """
        with closing():
            self._client.camera.on_update(lambda _: self._camera_moved())
            self._camera_moved()
            threading.Thread(target=self._greet, daemon=True, name="place-rings first look").start()

    def _connect(self) -> None:
        """Connect the controls to their actions."""
        c, edits, tasks = self.controls, self._edits, self._tasks
        self._connect_view(c.view)
        self._connect_rings(c.rings)
        self._actions.choose(c.steps, partial(self._attempt, edits.step))
        self._press(c.prove, tasks.prove)
        self._press(c.search, tasks.search)
        self._press(c.unseen, tasks.spheres)
        self._press(c.save, tasks.save)
        c.stop.on_click(lambda _: self._work.stop())  # at once, in a thread of viser
        c.picture.on_click(lambda _: self._attempt(tasks.picture))  # it waits for the browser
        commands = self._client.gui.add_command
        undo = commands(STEPS[0], hotkey="Z", modifier="cmd/ctrl")
        redo = commands(STEPS[1], hotkey="Z", modifier="cmd/ctrl+shift")
        for label, command in zip(STEPS, (undo, redo), strict=True):
            self._actions.trigger(command, partial(self._attempt, edits.step, label))

    def _connect_view(self, c: ViewControls) -> None:
        choose = self._choose
        self._on(c.setup, self._activate)
        self._on(c.pose, lambda v: self._go(int(v)))
        self._on(c.target, lambda v: self._aim(str(v)))
        self._on(c.occlusion, lambda v: choose(occlusion=OCCLUSIONS[OCCLUSIONS.index(v)]))
        self._on(c.cones, lambda v: choose(cones=SHOWN_CONES[SHOWN_CONES.index(v)]))
        self._on(c.outline, lambda v: choose(outline=bool(v)))
        self._on(c.robot, lambda v: choose(robot=bool(v)))
        self._on(c.kinds, lambda v: choose(kinds=SHOWN_KINDS[v]))
        self._on(c.spheres, lambda v: self._set(spheres=bool(v)))
        self._on(c.cut, self._cut)
        self._on(c.plane, lambda v: self._set(plane=finite(v) / 1000))
        self._on(c.dark, lambda v: self._set(dark=bool(v)))
        self._actions.choose(c.views, partial(self._attempt, self._look))
        self._press(c.play, lambda: self._player.toggle(self.state.choice.pose))

    def _connect_rings(self, c: RingControls) -> None:
        choose, edits = self._choose, self._edits
        self._on(c.handles, lambda v: self._set(handles=bool(v)))
        self._on(c.preset, edits.start_from)
        self._on(c.ring, lambda v: choose(ring=c.ring_number(v)))
        self._on(c.sensor, lambda v: choose(sensor=c.sensor_number(v)))
        self._on(c.link, edits.relink)
        self._on(c.position, edits.move_along)
        self._on(c.tilt, lambda v: edits.change(tilt_deg=float(v)))
        self._on(c.phase, lambda v: edits.change(phase_deg=float(v)))
        self._on(c.count, lambda v: edits.change(count=int(v)))
        for key, control in c.single.items():
            self._on(control, partial(edits.move, key))
        self._press(c.add, edits.add)
        self._press(c.remove, edits.remove)
        self._press(c.again, edits.as_opened)

    def _greet(self) -> None:
        """Take over how the browser opened the page."""
        with closing():
            self._take_over(*self._browser.first_look())

    def _take_over(self, query: dict[str, str], dark: bool) -> None:
        if self._closed:
            return

        def act() -> None:
            link = read_query(query)
            with self.state.held() as state:
                state.open(replace(link, dark=dark if link.dark is None else link.dark))
            if link.target is not None or link.view is not None:
                self._look(link.view if link.view in VIEWS else START)

        self._attempt(act)
        if query or dark:
            self._show()

    # Actions of the user.

    def _on(self, control: Any, act: Callable[[Any], None]) -> None:
        """Call ``act`` with each value to which the user changes a control."""
        self._actions.on(control, partial(self._attempt, act))

    def _press(self, button: Any, act: Callable[[], None]) -> None:
        self._actions.press(button, partial(self._attempt, act))

    def _attempt(self, act: Callable[..., None], *args: Any) -> None:
        """Call ``act`` and report its errors in a line.

        A browser may send values that the controls would not allow.
        """
        try:
            act(*args)
        except (ValueError, KeyError, IndexError, OverflowError, UserError) as error:
            self._work.note(str(error), True)

    def _clicked(self, setup: int, ring: int, ray: Ray) -> None:
        """Select the ring, and the sensor nearest to the click."""

        def act() -> None:
            with self.state.held() as state:
                state.active = setup
                group = state.setups[setup].groups[ring]
            apexes = self._room.drawing.apexes(group, self.state.choice.pose)
            self._choose(ring=ring, sensor=nearest_sensor(apexes, *ray))

        self._attempt(act)

    def _dragged(self, position: float | None, phase: float | None) -> None:
        self._attempt(self._edits.drag, position, phase)

    def _activate(self, label: str) -> None:
        with self.state.held() as state:
            state.active = self.controls.setup_number(label)
        self._choose(ring=0)

    def _choose(self, **what: Any) -> None:
        with self.state.held() as state:
            state.choose(**what)
        self._show()

    def _set(self, **what: Any) -> None:
        with self.state.held() as state:
            for key, value in what.items():
                setattr(state, key, value)
        self._show()

    def _go(self, pose: int) -> None:
        """Show another pose."""
        with closing():
            self._choose(pose=min(max(pose, 0), len(self._room.scene.poses) - 1))

    def _playing(self, on: bool) -> None:
        if not self._closed:
            with closing():
                self.controls.view.play.label = "Pause" if on else "Play"

    def _aim(self, label: str) -> None:
        """Choose another target and fit the view to it."""
        self._choose(target=self.state.targets[label])
        self.camera.show(self._room.extent(self.state.choice), self.camera.direction)

    def _look(self, view: str) -> None:
        """Look from a standard view."""
        choice = self.state.choice
        start = self._room.start_direction(choice.pose)
        with self.state.held() as state:
            state.view = view if view in VIEWS else None
        self.camera.show(self._room.extent(choice), VIEWS.get(view, start))
        self._show()

    def _camera_moved(self) -> None:
        """Keep the view fitted, and the cut on the camera's side of the robot."""
        if self._closed:
            return
        self.camera.follow()
        cut, curve = self._drawing.cut, self._room.drawing.curve(self.state.choice.pose)
        if self.state.cut != BEHIND or cut is None:
            return
        if facing(self.camera.direction, curve) != cut.normal:
            self._show()

    def _cut(self, kind: str) -> None:
        if kind not in CUTS:
            raise ValueError(f"cut: found {kind!r}, allowed: {', '.join(CUTS)}")
        self.controls.view.plane.visible = kind not in (BEHIND, NONE)
        self._set(cut=kind)

    def _show(self) -> None:
        """Show the newest state soon."""
        self._drawing.show()

    def close(self) -> None:
        """Stop the running job when the browser disconnects or the server ends."""
        self._closed = True
        self._actions.close()
        self._player.close()
        self._drawing.close()
        self._work.close()
