"""One page in one browser: its controls, its state, and its reactions to the user.

Each page has its own state, so that two users do not move the same slider. Callbacks come from
several threads. A lock guards the state, and one thread at a time shows the newest state.
"""

import math
import threading
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import viser

from ..coverage.occlusion.occlusion_mode import OCCLUSIONS, Occlusion
from ..coverage.rings.ring import Setup
from ..formats.errors import UserError
from ..formats.escaping import printable
from . import html as words
from .browser_page import BrowserPage
from .camera import START, VIEWS, FittedCamera
from .closing import closing
from .controls import NO_PRESET, POSITIONS, SHOWN_KINDS, STEPS, UNDO, Controls, set_value
from .cut import BEHIND, CUTS, NONE, facing
from .drawing import SHOWN_CONES
from .edited_setup import EditedSetup
from .history import Version
from .jobs import Job
from .link_state import read_query
from .long_task import LongTask
from .page_drawing import PageDrawing
from .page_files import PageFiles
from .page_state import PageState
from .playback import Player
from .ring_handles import RingHandles
from .scene_graph import Ray, SceneGraph
from .sensor_report import nearest_sensor
from .session import ViewerSession
from .tasks import SearchAnswer, prove, search_from


class Page:
    """A page for one client."""

    def __init__(self, client: viser.ClientHandle, room: ViewerSession) -> None:
        """Build the controls and show the setups as opened."""
        self._client, self._room = client, room
        self._lock = threading.RLock()
        self._closed = False
        self.state = PageState.of(room.scene, {str(t): t for t in room.targets}, room.setups)
        stages = [
            SceneGraph(client.scene, f"/setup{i}", place, partial(self._clicked, i))
            for i, place in enumerate(room.places())
        ]
        client.scene.configure_default_lights(cast_shadow=False)
        client.scene.add_frame("/base", axes_length=0.25, axes_radius=0.006)
        self.controls = Controls(client.gui, room, list(room.setups))
        self.camera, self._browser = FittedCamera(client), BrowserPage(client)
        self._work = LongTask(self.controls, room.turn)
        self._files = PageFiles(client, room.out, self.controls, self._work)
        self._handles = RingHandles(client.scene, self._dragged)
        self._player = Player(len(room.scene.poses), self._go, self._playing)
        self._drawing = PageDrawing(
            client, room, self.controls, stages, self._handles, self.camera, self._browser
        )
        self._connect()
        self._look(START)
        client.camera.on_update(lambda _: self._camera_moved())
        self._camera_moved()
        threading.Thread(target=self._greet, daemon=True, name="place-rings first look").start()

    def _connect(self) -> None:
        """Connect the controls to their actions."""
        c, choose = self.controls, self._choose
        self._on(c.setup, self._activate)
        self._on(c.pose, lambda v: self._go(int(v)))
        self._on(c.target, lambda v: self._aim(str(v)))
        self._on(c.occlusion, lambda v: choose(occlusion=OCCLUSIONS[OCCLUSIONS.index(v)]))
        self._on(c.cones, lambda v: choose(cones=SHOWN_CONES[SHOWN_CONES.index(v)]))
        self._on(c.outline, lambda v: choose(outline=bool(v)))
        self._on(c.robot, lambda v: choose(robot=bool(v)))
        self._on(c.kinds, lambda v: choose(kinds=SHOWN_KINDS[v]))
        self._on(c.cut, self._cut)
        self._on(c.plane, lambda v: self._set(plane=_finite(v) / 1000))
        self._on(c.dark, lambda v: self._set(dark=bool(v)))
        self._on(c.handles, lambda v: self._set(handles=bool(v)))
        self._on(c.preset, self._start_from)
        self._on(c.ring, lambda v: choose(ring=c.ring_number(v)))
        self._on(c.sensor, lambda v: choose(sensor=c.sensor_number(v)))
        self._on(c.link, self._relink)
        self._on(c.position, self._move_along)
        self._on(c.tilt, lambda v: self._change(tilt_deg=float(v)))
        self._on(c.phase, lambda v: self._change(phase_deg=float(v)))
        self._on(c.count, lambda v: self._change(count=int(v)))
        for key, control in c.single.items():
            self._on(control, partial(self._move, key))
        self._press(c.add, lambda: self._edit(lambda d: d.added(c.link_named(c.link.value)), True))
        self._press(c.remove, lambda: self._edit(lambda d: d.removed(self.state.choice.ring)))
        self._press(c.again, self._as_opened)
        self._press(c.steps, lambda: self._step(c.steps.value))
        commands = self._client.gui.add_command
        undo = commands(STEPS[0], hotkey="Z", modifier="cmd/ctrl")
        redo = commands(STEPS[1], hotkey="Z", modifier="cmd/ctrl+shift")
        for label, command in zip(STEPS, (undo, redo), strict=True):
            command.on_trigger(partial(self._hotkey, label))
        self._press(c.views, lambda: self._look(c.views.value))
        self._press(c.play, lambda: self._player.toggle(self.state.choice.pose))
        self._press(c.prove, self._prove)
        self._press(c.search, self._search)
        self._press(c.stop, self._work.stop)
        self._press(c.save, self._save)
        self._press(c.picture, self._picture)

    def _greet(self) -> None:
        """Take over how the browser opened the page."""
        with closing():
            self._take_over(*self._browser.first_look())

    def _take_over(self, query: dict[str, str], dark: bool) -> None:
        if self._closed:
            return

        def act() -> None:
            link = read_query(query)
            with self._lock:
                self.state.open(replace(link, dark=dark if link.dark is None else link.dark))
            if link.target is not None or link.view is not None:
                self._look(link.view if link.view in VIEWS else START)

        self._try(act)
        if query or dark:
            self._show()

    # Actions of the user.

    def _on(self, control: Any, act: Callable[[Any], None]) -> None:
        """Call ``act`` with the control's newest value after the user changed it, not after the
        page did.
        """

        def changed(event: Any) -> None:
            if event.client_id is not None:
                self._try(lambda: act(control.value))

        control.on_update(changed)

    def _press(self, button: Any, act: Callable[[], None]) -> None:
        button.on_click(lambda _: self._try(act))

    def _hotkey(self, label: str, _: Any) -> None:
        self._try(lambda: self._step(label))

    def _try(self, act: Callable[[], None]) -> None:
        """Call ``act`` and report its errors in a line.

        A browser may send values that the controls would not allow.
        """
        try:
            act()
        except (ValueError, KeyError, IndexError, OverflowError, UserError) as error:
            self._work.note(str(error), True)

    def _clicked(self, setup: int, ring: int, ray: Ray) -> None:
        """Select the ring, and the sensor nearest to the click."""

        def act() -> None:
            with self._lock:
                self.state.active = setup
                group = self.state.setups[setup].groups[ring]
            apexes = self._room.drawing.apexes(group, self.state.choice.pose)
            self._choose(ring=ring, sensor=nearest_sensor(apexes, *ray))

        self._try(act)

    def _activate(self, label: str) -> None:
        with self._lock:
            self.state.active = self.controls.setup_number(label)
        self._choose(ring=0)

    def _choose(self, **what: Any) -> None:
        with self._lock:
            self.state.choose(**what)
        self._show()

    def _set(self, **what: Any) -> None:
        with self._lock:
            for key, value in what.items():
                setattr(self.state, key, value)
        self._show()

    def _go(self, pose: int) -> None:
        """Show another pose."""
        with closing():
            self._choose(pose=min(max(pose, 0), len(self._room.scene.poses) - 1))

    def _playing(self, on: bool) -> None:
        if not self._closed:
            with closing():
                self.controls.play.label = "Pause" if on else "Play"

    def _aim(self, label: str) -> None:
        """Choose another target and fit the view to it."""
        self._choose(target=self.state.targets[label])
        self.camera.show(self._room.extent(self.state.choice), self.camera.direction)

    def _look(self, view: str) -> None:
        """Look from a standard view."""
        choice = self.state.choice
        start = self._room.start_direction(choice.pose)
        with self._lock:
            self.state.view = view if view in VIEWS else None
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
        self.controls.plane.visible = kind not in (BEHIND, NONE)
        self._set(cut=kind)

    def _change(self, **what: Any) -> None:
        with self._lock:
            ring = self.state.choice.ring
        self._edit(lambda draft: draft.changed(ring, **what), control=(ring, *what))

    def _move_along(self, value: Any) -> None:
        """Move the selected ring to a place in mm along its link."""
        with self._lock:
            ring = self.state.history.now.setup.rings[self.state.choice.ring]
        length = 1000 * self._room.scene.robot.mount(ring.link).length
        self._change(position=_finite(value) / length if length > 0 else 0.0)

    def _dragged(self, position: float | None, phase: float | None) -> None:
        """Move the selected ring with its handles."""

        def act() -> None:
            if position is not None:
                self._change(position=position)
            if phase is not None:
                self._change(phase_deg=math.degrees(phase))

        self._try(act)

    def _relink(self, label: str) -> None:
        """Move the selected ring to a link; of a single sensor it is the link for a new ring."""
        with self._lock:
            rings = len(self.state.history.now.setup.rings)
        if self.state.choice.ring < rings:
            self._change(link=self.controls.link_named(label))

    def _move(self, key: str, value: float) -> None:
        """Change one number of the selected single sensor's pose."""
        number = float(value) / (1000.0 if key in POSITIONS else 1.0)
        ring = self.state.choice.ring
        self._edit(lambda draft: draft.moved(ring, **{key: number}), control=(ring, key))

    def _edit(
        self,
        edit: Callable[[EditedSetup], EditedSetup],
        last: bool = False,
        control: Any = None,
    ) -> None:
        """Change the setup; see ``PageState.edit``."""
        with self._lock:
            self.state.edit(edit, last, control)
        self._show()

    def _as_opened(self) -> None:
        with self._lock:
            self.state.replaced(self.state.history.opened)
        self._show()

    def _start_from(self, name: str) -> None:
        """Replace the rings by those of a layout of the paper."""
        if name == NO_PRESET:
            return
        with self._lock:
            self.state.replaced(Version(self._room.presets[name], name))
        set_value(self.controls.preset, NO_PRESET)
        self._show()

    def _step(self, label: str) -> None:
        if label not in STEPS:
            raise ValueError(f"found {label!r}, allowed: {', '.join(STEPS)}")
        with self._lock:
            self.state.step(label == UNDO)
        self._show()

    def _show(self) -> None:
        """Show the newest state, in this thread or in the thread that is already drawing."""

        def snapshot() -> PageState:
            with self._lock:
                return replace(self.state, histories=[h.frozen() for h in self.state.histories])

        self._drawing.show(snapshot)

    # Long tasks.

    def _asked(self) -> tuple[int, Setup, Any]:
        with self._lock:
            scene = replace(self._room.scene, occlusion=self.state.choice.occlusion)
            return self.state.active, self.state.history.now.setup, scene

    def _prove(self) -> None:
        i, setup, scene = self._asked()
        name = self.state.names[i]

        def work(job: Job) -> None:
            proofs = prove(scene, setup, self._room.targets, job.tell)
            told = words.proof_table(f"{name}, {setup.sensors} sensors", proofs)
            occlusion: Occlusion = scene.occlusion
            self._drawing.proof = setup, occlusion, told
            self._show()
            _, now, under = self._asked()
            changed = (
                ""
                if (now, under.occlusion) == (setup, scene.occlusion)
                else "; the setup has changed since"
            )
            self._work.note(
                f"counted in {sum(p.counted.seconds + p.certified.seconds for p in proofs):.1f}"
                f" s{changed}"
            )

        self._work.start(work)

    def _search(self) -> None:
        i, setup, scene = self._asked()
        target = self.state.targets.get(str(self.controls.aim.value))
        free = bool(self.controls.free.value)

        def work(job: Job) -> None:
            found = search_from(scene, setup, job.note, lambda: job.stopped, target, free)
            self._adopt(i, found)

        self._work.start(work)

    def _adopt(self, i: int, found: SearchAnswer) -> None:
        """Apply the result of a search if it is better."""
        change = f"{100 * found.before:.2f} → {100 * found.after:.2f} %, exact; {found.outcome}"
        if not found.better:
            self._work.note(f"the search found nothing better: {change}")
            return
        with self._lock:
            self.state.searched(i, found.setup)
        self._show()
        self._work.note(f"better: {change}")

    def _save(self) -> None:
        i, setup, scene = self._asked()

        def saved(name: str) -> None:
            with self._lock:
                self.state.histories[i].saved(setup, name)
            self._show()

        self._files.save(setup, scene, saved)

    def _picture(self) -> None:
        with self._lock:
            now, occlusion = self.state.history.now, self.state.choice.occlusion
        zetas = [
            f"{t} {100 * self._room.glance.zeta(now.setup, t, occlusion):.1f} %"
            for t in self._room.targets
        ]
        title = f"{printable(now.name)}: {now.setup.sensors} sensors"
        self._files.picture(now.name, title, "   ".join(zetas))

    def close(self) -> None:
        """Stop the running job when the browser disconnects or the server ends."""
        self._closed = True
        self._player.close()
        self._drawing.close()
        self._work.close()


def _finite(value: Any) -> float:
    """Return a number that a browser sent.

    Raises:
        ValueError: if it is not finite.
    """
    number = float(value)
    if not math.isfinite(number):
        raise ValueError("numbers must be finite")
    return number
