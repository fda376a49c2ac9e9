"""One page in one browser: its controls, its state, and its reactions to the user.

Each page has its own state, so that two users do not move the same slider. Callbacks come from
several threads. A lock guards the state, and one thread at a time shows the newest state.
"""

import threading
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import viser

from ..coverage.occlusion.occlusion_mode import OCCLUSIONS, Occlusion
from ..coverage.rings.ring import Setup
from ..coverage.targets import Target
from ..formats.errors import UserError
from ..formats.escaping import printable
from . import html as words
from .colours import KINDS
from .controls import POSITIONS, Controls
from .drawing import SHOWN_CONES, DrawnParts
from .edited_setup import EditedSetup
from .jobs import Job
from .long_task import LongTask
from .page_files import PageFiles
from .scene_graph import SceneGraph
from .session import ViewerSession
from .tasks import SearchAnswer, prove, search_from

_MOST_TOLD = 3  # violated rules that are listed


class Page:
    """A page for one client."""

    def __init__(self, client: viser.ClientHandle, room: ViewerSession) -> None:
        """Build the controls and show the setups as opened."""
        self._client, self._room = client, room
        self._names = list(room.setups)
        self._lock, self._showing = threading.RLock(), threading.Lock()
        self._wanted, self._closed = False, False
        # setup, occlusion model, text
        self._proof: tuple[Setup, Occlusion, str] | None = None
        self._drafts = [EditedSetup(room.scene, setup) for setup in room.setups.values()]
        self._active = 0
        first = room.scene.goals[0].target
        self._choice = DrawnParts(0, first, room.scene.occlusion)
        self._stages = [
            SceneGraph(client.scene, f"/setup{i}", place, partial(self._clicked, i))
            for i, place in enumerate(room.places())
        ]
        client.scene.configure_default_lights(cast_shadow=False)
        client.scene.add_frame("/base", axes_length=0.25, axes_radius=0.006)
        for i, name in enumerate(self._names if len(self._names) > 1 else []):
            top = float(room.drawing.box(self._choice)[1][2])
            client.scene.add_label(
                f"/setup{i}/name", printable(name)[:60], position=(0.0, 0.0, top + 0.1)
            )
        self.controls = Controls(client.gui, room, self._names)
        self._work = LongTask(self.controls, room.turn)
        self._files = PageFiles(client, room.out, self.controls, self._work)
        self._connect()
        self._show()

    def _connect(self) -> None:
        """Connect the controls to their actions."""
        c, choose = self.controls, self._choose
        targets = {str(t): t for t in self._room.targets}
        self._on(c.setup, self._activate)
        self._on(
            c.pose, lambda v: choose(pose=min(max(int(v), 0), len(self._room.scene.poses) - 1))
        )
        self._on(c.target, lambda v: self._aim(targets[v]))
        self._on(c.occlusion, lambda v: choose(occlusion=OCCLUSIONS[OCCLUSIONS.index(v)]))
        self._on(c.cones, lambda v: choose(cones=SHOWN_CONES[SHOWN_CONES.index(v)]))
        self._on(c.outline, lambda v: choose(outline=bool(v)))
        self._on(c.robot, lambda v: choose(robot=bool(v)))
        for kind in KINDS:
            self._on(c.kinds[kind.number], partial(self._choose_kind, kind.number))
        self._on(c.ring, lambda v: choose(ring=c.ring_number(v)))
        self._on(c.link, self._relink)
        self._on(c.position, lambda v: self._change(position=float(v)))
        self._on(c.tilt, lambda v: self._change(tilt_deg=float(v)))
        self._on(c.phase, lambda v: self._change(phase_deg=float(v)))
        self._on(c.count, lambda v: self._change(count=int(v)))
        for key, control in c.single.items():
            self._on(control, partial(self._move, key))
        self._press(
            c.add, lambda: self._edit(lambda d: d.added(c.link_named(c.link.value)), chosen=-1)
        )
        self._press(c.remove, lambda: self._edit(lambda d: d.removed(self._choice.ring)))
        self._press(
            c.again,
            lambda: self._edit(
                lambda d: replace(d, setup=self._room.setups[self._names[self._active]])
            ),
        )
        self._press(c.prove, self._prove)
        self._press(c.search, self._search)
        self._press(c.stop, self._work.stop)
        self._press(c.save, lambda: self._files.save(*self._asked()[1:]))
        self._press(c.picture, self._picture)

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

    def _try(self, act: Callable[[], None]) -> None:
        """Call ``act`` and report its errors in a line.

        A browser may send values that the controls would not allow.
        """
        try:
            act()
        except (ValueError, KeyError, IndexError, OverflowError, UserError) as error:
            self._work.note(str(error), True)

    def _clicked(self, setup: int, ring: int) -> None:
        def act() -> None:
            with self._lock:
                self._active = setup
            self._choose(ring=ring)

        self._try(act)

    def _activate(self, label: str) -> None:
        with self._lock:
            self._active = self.controls.setup_number(label)
        self._choose(ring=0)

    def _choose(self, **what: Any) -> None:
        with self._lock:
            if not 0 <= what.get("ring", 0) < len(self._drafts[self._active].setup.groups):
                raise ValueError(f"ring {what['ring']} does not exist")
            self._choice = replace(self._choice, **what)
        self._show()

    def _aim(self, target: Target) -> None:
        """Choose another target and point the camera at it."""
        self._choose(target=target)
        position, look_at = self._room.look(self._choice)
        with self._client.atomic():
            self._client.camera.look_at = look_at
            self._client.camera.position = position

    def _choose_kind(self, number: int, on: bool) -> None:
        with self._lock:
            kinds = self._choice.kinds | {number} if on else self._choice.kinds - {number}
        self._choose(kinds=kinds)

    def _change(self, **what: Any) -> None:
        self._edit(lambda draft: draft.changed(self._choice.ring, **what))

    def _relink(self, label: str) -> None:
        """Move the selected ring to a link; of a single sensor it is the link for a new ring."""
        with self._lock:
            rings = len(self._drafts[self._active].setup.rings)
        if self._choice.ring < rings:
            self._change(link=self.controls.link_named(label))

    def _move(self, key: str, value: float) -> None:
        """Change one number of the selected single sensor's pose."""
        number = float(value) / (1000.0 if key in POSITIONS else 1.0)
        self._edit(lambda draft: draft.moved(self._choice.ring, **{key: number}))

    def _edit(self, edit: Callable[[EditedSetup], EditedSetup], chosen: int | None = None) -> None:
        """Change the setup, then select ring ``chosen`` if given; negative values count from
        the end.
        """
        with self._lock:
            draft = edit(self._drafts[self._active])
            self._drafts[self._active] = draft
            ring = self._choice.ring if chosen is None else chosen % len(draft.setup.rings)
            self._choice = replace(self._choice, ring=min(ring, len(draft.setup.groups) - 1))
        self._show()

    # Display.

    def _show(self) -> None:
        """Show the newest state, in this thread or in the thread that is already drawing."""
        self._wanted = True
        while self._wanted and not self._closed and self._showing.acquire(blocking=False):
            try:
                self._wanted = False
                self._draw()
            finally:
                self._showing.release()

    def _draw(self) -> None:
        began = time.perf_counter()
        with self._lock:
            drafts, choice, active = list(self._drafts), self._choice, self._active
        room, setups = self._room, [d.setup for d in drafts]
        drawn = []
        for i, setup in enumerate(setups):
            mine = (
                choice
                if i == active
                else replace(choice, ring=min(choice.ring, len(setup.groups) - 1))
            )
            dots, shares = room.drawing.points(setup, mine, setups)
            drawn.append(
                ({**room.drawing.backdrop(mine), **room.drawing.rings(setup, mine), **dots}, shares)
            )
        rows = [
            words.TableRow(
                str(target),
                tuple(
                    (
                        room.glance.zeta(opened, target, choice.occlusion),
                        room.glance.zeta(setup, target, choice.occlusion),
                    )
                    for opened, setup in zip(room.setups.values(), setups, strict=True)
                ),
            )
            for target in room.targets
        ]
        with self._client.atomic():
            for stage, (items, _) in zip(self._stages, drawn, strict=True):
                stage.show(items)
        seconds = time.perf_counter() - began
        self.controls.tell(setups, rows, seconds, drawn[active][1], choice, active)
        self.controls.follow(setups[active], choice.ring, active, drafts[active].most(choice.ring))
        proof = self._proof
        holds = proof is not None and proof[:2] == (setups[active], choice.occlusion)
        self.controls.proofs.content = proof[2] if proof is not None and holds else ""
        broken = room.broken(setups[active], choice.occlusion)
        more = f" (and {len(broken) - _MOST_TOLD} more)" if len(broken) > _MOST_TOLD else ""
        self.controls.rules.content = words.note("; ".join(broken[:_MOST_TOLD]) + more, True)
        self._client.flush()

    # Long tasks.

    def _asked(self) -> tuple[int, Any, Any]:
        with self._lock:
            i = self._active
            scene = replace(self._room.scene, occlusion=self._choice.occlusion)
            return i, self._drafts[i].setup, scene

    def _prove(self) -> None:
        i, setup, scene = self._asked()

        def work(job: Job) -> None:
            proofs = prove(scene, setup, self._room.targets, job.tell)
            told = words.proof_table(f"{self._names[i]}, {setup.sensors} sensors", proofs)
            self._proof = setup, scene.occlusion, told
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
        target = {str(t): t for t in self._room.targets}.get(self.controls.aim.value)
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
            self._drafts[i] = replace(self._drafts[i], setup=found.setup)
            self._choice = replace(
                self._choice, ring=min(self._choice.ring, len(found.setup.groups) - 1)
            )
        self._show()
        self._work.note(f"better: {change}")

    def _picture(self) -> None:
        with self._lock:
            setups, choice = [d.setup for d in self._drafts], self._choice
        zetas = [
            f"{t} {100 * self._room.glance.zeta(setups[self._active], t, choice.occlusion):.1f} %"
            for t in self._room.targets
        ]
        title = f"{printable(self._names[self._active])}: {setups[self._active].sensors} sensors"
        self._files.picture(title, "   ".join(zetas))

    def close(self) -> None:
        """Stop the running job when the browser disconnects or the server ends."""
        self._closed = True
        self._work.close()
