"""Drawing of a page's state: from few points while the user moves something, then from all."""

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import viser
from jaxtyping import Float

from ..coverage.definitions.escaping import printable
from ..coverage.occlusion.occlusion_mode import Occlusion
from ..coverage.rings.ring import Ring, Setup
from ..coverage.robots.base_frame import frame_text
from ..objectives.dark_clothing import in_dark_clothing
from . import html as words
from .browser import BrowserPage, closing, set_value
from .camera import FittedCamera
from .controls import Controls
from .drawing import BASE_AXES
from .drawn_parts import Cut, DrawnParts, cut_of
from .page_state import PageState
from .playback import curve_data, pose_axis
from .quick_estimate import SHOWN, sensor_report
from .ring_handles import RingHandles
from .scene_graph import SceneGraph
from .session import ViewerSession
from .unseen_spheres import UnseenSpheres
from .worker import Worker

_SLOW = 0.12  # s; where all points take longer, few are counted first
_REST = 0.25  # s without a change, after which all points are counted
_SOON = 0.05  # s; where the rules take longer, they follow after a rest
_NAME_SIZE = 60  # characters of a name in the scene


class PageDrawing:
    """Draws the newest state of one page, in a thread of its own."""

    def __init__(
        self,
        client: viser.ClientHandle,
        room: ViewerSession,
        controls: Controls,
        stages: Sequence[SceneGraph],
        handles: RingHandles,
        camera: FittedCamera,
        browser: BrowserPage,
        newest: Callable[[], PageState],
        guard: Callable[[Callable[[], None]], None],
    ) -> None:
        """Take over the parts of the page that show something.

        Args:
            client: the browser.
            room: what all pages share.
            controls: of the page.
            stages: scene of each setup.
            handles: of the selected ring.
            camera: of the page.
            browser: the page in the browser.
            newest: returns the newest state.
            guard: calls what it is given, and reports its errors on the page.
        """
        self._client, self._room, self._controls = client, room, controls
        self._stages, self._handles = stages, handles
        self._camera, self._browser = camera, browser
        self._newest, self._guard = newest, guard
        self._worker, self._wanted = Worker("drawing"), threading.Event()
        self._closed, self._took, self._dark = False, 0.0, False
        self._faulty = [frozenset[int]()] * len(room.setups)
        self.cut: Cut | None = None
        self.proof: tuple[Setup, Occlusion, str] | None = None
        """Setup, model and text of the last count; the text is shown while both are."""
        self.spheres: UnseenSpheres | None = None
        """The last map of unseen spheres, drawn in place of the points while it holds."""
        self._labels = self._names_in_scene()
        frame = f" of {frame_text(room.scene.robot)}"
        for name, (_, end) in zip("xyz", BASE_AXES, strict=True):
            client.scene.add_label(
                f"/setup0/axes/{name}", name + frame * (name == "x"), position=1.05 * end
            )

    def _names_in_scene(self) -> list[viser.LabelHandle]:
        """Add a label above each of several setups."""
        names = list(self._room.setups)
        first = DrawnParts(0, self._room.targets[0], self._room.scene.occlusion)
        top = float(self._room.drawing.box(first)[1][2])
        return [
            self._client.scene.add_label(
                f"/setup{i}/name", printable(name)[:_NAME_SIZE], position=(0.0, 0.0, top + 0.1)
            )
            for i, name in enumerate(names if len(names) > 1 else [])
        ]

    def show(self) -> None:
        """Show the newest state soon; return at once."""
        self._wanted.set()
        self._worker.do(self._guard, self._catch_up)

    def then(self, act: Callable[[], None]) -> None:
        """Call ``act`` after what is wanted now has been drawn; return at once."""
        self._worker.do(act)

    def _catch_up(self) -> None:
        """Draw until nothing new is wanted."""
        with closing():
            while self._wanted.is_set() and not self._closed:
                self._wanted.clear()
                self._draw(self._newest(), few=self._took > _SLOW)
                if self._took > _SLOW and not self._wanted.wait(_REST) and not self._closed:
                    self._draw(self._newest(), few=False)

    def close(self) -> None:
        """Draw nothing any more."""
        self._closed = True
        self._wanted.set()
        self._worker.close()

    def _draw(self, state: PageState, few: bool) -> None:
        began = time.perf_counter()
        room, controls, active = self._room, self._controls, state.active
        setups = state.setups
        self.cut = cut_of(
            state.cut,
            state.plane,
            self._camera.direction,
            room.drawing.curve(state.choice.pose),
        )
        choice = replace(state.choice, cut=self.cut)
        self._theme(state.dark)
        if room.judging <= _SOON:
            self._judge(setups, choice.occlusion)
        shares = self._draw_scene(setups, state, choice)
        count = min(SHOWN, room.glance.each) if few else None
        if not few and room.glance.each > SHOWN and room.glance.weights[choice.pose] > 0:
            shares = room.drawing.shares(setups[active], choice, room.glance.each)
        rows = self._rows(setups, choice.occlusion, count)
        took = time.perf_counter() - began
        if not few:
            self._took = took
        how = f"{took:.2f} s{', first estimate' if few else ''}"
        if self._closed:
            return
        controls.tell(state.names, setups, rows, how, shares, choice, active)
        most = state.draft.most(choice.ring)
        controls.rings.follow(setups[active], choice.ring, most, choice.sensor)
        now = rows[[r.target for r in rows].index(str(choice.target))].values[active][1]
        covered = f"{100 * now:.1f} % of {choice.target} covered"
        self._client.gui.set_panel_label(printable(covered))
        self._browser.title(printable(f"{state.names[active]}: {covered} · place-rings"))
        controls.address.content = words.link(f"?{state.link().query()}")
        for control, value in (
            (controls.view.pose, state.choice.pose),
            (controls.view.target, str(choice.target)),
            (controls.view.occlusion, choice.occlusion),
        ):
            set_value(control, value)
        self._client.flush()
        if not few and not self._closed:
            self._draw_details(setups, state, choice)

    def _draw_scene(
        self, setups: list[Setup], state: PageState, choice: DrawnParts
    ) -> tuple[float, ...]:
        """Draw the setups; return the share of the active setup's points in each class."""
        room, drawn = self._room, []
        shares: tuple[float, ...] = ()
        for i, setup in enumerate(setups):
            mine = replace(choice, faulty=self._faulty[i])
            if i != state.active:
                ring = min(choice.ring, len(setup.groups) - 1)
                mine = replace(mine, ring=ring, sensor=None)
            dots, each = room.drawing.points(setup, mine, setups)
            if (spheres := self._spheres(setup, mine, state)) is not None:
                dots = spheres.items(mine)
            drawn.append({**room.drawing.backdrop(mine), **room.drawing.rings(setup, mine), **dots})
            shares = each if i == state.active else shares
        with self._client.atomic():
            for stage, items in zip(self._stages, drawn, strict=True):
                stage.show(items, state.dark)
            for label, name in zip(self._labels, state.names, strict=False):
                label.text = printable(name)[:_NAME_SIZE]
            group = setups[state.active].groups[choice.ring]
            if state.handles and isinstance(group, Ring):
                q = room.scene.poses[choice.pose].q
                self._handles.show(f"/setup{state.active}", room.scene.robot, q, group)
            else:
                self._handles.hide()
        return shares

    def _spheres(self, setup: Setup, choice: DrawnParts, state: PageState) -> UnseenSpheres | None:
        """Return the map of unseen spheres if it is to be drawn for a setup."""
        spheres = self.spheres
        holds = state.spheres and spheres is not None and spheres.of(setup, choice)
        return spheres if holds else None

    def _rows(
        self, setups: list[Setup], occlusion: Occlusion, count: int | None
    ) -> list[words.TableRow]:
        glance, opened = self._room.glance, self._room.setups.values()
        return [
            words.TableRow(
                str(target),
                tuple(
                    (
                        glance.zeta(before, target, occlusion),
                        glance.zeta(setup, target, occlusion, None if before == setup else count),
                    )
                    for before, setup in zip(opened, setups, strict=True)
                ),
                tuple(
                    None if dark is None else glance.zeta(dark, target, occlusion, count)
                    for dark in map(in_dark_clothing, setups)
                ),
            )
            for target in self._room.targets
        ]

    def _judge(self, setups: list[Setup], occlusion: Occlusion) -> bool:
        """Find which rings of each setup cannot be built; return whether these are others now."""
        before, self._faulty = (
            self._faulty,
            [
                frozenset(
                    ring for fault in self._room.broken(setup, occlusion) for ring in fault.rings
                )
                for setup in setups
            ],
        )
        return self._faulty != before

    def _draw_details(self, setups: list[Setup], state: PageState, choice: DrawnParts) -> None:
        """Show what may come a little later: rules, the selected sensor, the curve, the count."""
        controls, room, setup = self._controls, self._room, setups[state.active]
        proof, report = self.proof, ""
        holds = proof is not None and proof[:2] == (setup, choice.occlusion)
        if room.judging > _SOON and self._wanted.wait(_REST):
            return  # a newer state is drawn next
        if self._judge(setups, choice.occlusion):
            self._draw_scene(setups, state, choice)
        broken = room.broken(setup, choice.occlusion)
        if choice.sensor is not None:
            at = choice.target, choice.pose, choice.occlusion, choice.ring, choice.sensor
            ring = "ring " if choice.ring < len(setup.rings) else ""
            report = words.sensor_text(
                sensor_report(room.glance, setup, *at), f"{ring}{controls.rings.ring.value}"
            )
        curve = self._curve(setup, state) if controls.view.curve is not None else None
        if self._closed:
            return
        spheres = self._spheres(setup, choice, state)
        controls.spheres.content = (
            "" if spheres is None else words.sphere_legend(spheres, state.dark)
        )
        controls.proofs.content = proof[2] if proof is not None and holds else ""
        controls.rules.content = words.violations([fault.text for fault in broken])
        controls.rings.report.content = report
        if controls.view.curve is not None and curve is not None:
            controls.view.curve.data = curve
        self._client.flush()

    def _curve(self, setup: Setup, state: PageState) -> tuple[Float[np.ndarray, " N"], ...]:
        """Return the arrays of the curve of coverage over the poses."""
        glance, choice = self._room.glance, state.choice
        now, then = (
            glance.shares(one, choice.target, choice.occlusion)
            for one in (setup, state.history.opened.setup)
        )
        return curve_data(now, then, pose_axis(self._room.scene.poses)[0], choice.pose)

    def _theme(self, dark: bool) -> None:
        if dark != self._dark:
            self._dark = dark
            set_value(self._controls.view.dark, dark)
            self._client.gui.configure_theme(
                dark_mode=dark, control_width="large", show_logo=False, show_share_button=False
            )
