"""Controls of a page: labels, bounds, and updates from the setup."""

import math
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
import viser
import viser.uplot

from ..coverage.occlusion.occlusion_mode import OCCLUSIONS
from ..coverage.rings.mounted_sensor import MountedSensor
from ..coverage.rings.ring import Ring, Setup
from ..formats.escaping import printable
from . import html as words
from .camera import START, VIEWS
from .colours import KINDS
from .cut import CUTS
from .drawing import SHOWN_CONES, DrawnParts
from .edited_setup import MOST_SENSORS, STEEPEST_DEG
from .playback import pose_axis
from .session import ViewerSession
from .single_pose import SinglePose


class Control(Protocol):
    """A control that shows a value."""

    @property
    def value(self) -> str | float: ...


def set_value(control: Control, value: str | float) -> None:
    """Set the value that a control shows."""
    # mypy takes the value for read-only: viser's setter does not directly follow its getter
    control.value = value  # type: ignore[misc]


AS_ASKED, NO_PRESET, NO_SENSOR = "as the scene asks", "…", "none"
UNDO, REDO = STEPS = ("Undo", "Redo")
SHOWN_KINDS = {
    "all": frozenset(k.number for k in KINDS),
    "uncovered": frozenset(k.number for k in KINDS if not k.covered),
    "covered": frozenset(k.number for k in KINDS if k.covered),
    "none": frozenset[int](),
}
"""Classes of points by the option that shows them."""
CURVE_NOW, CURVE_OPENED, CURVE_HERE = "#0072B2", "#888888", "#D55E00"


POSITIONS = ("x", "y", "z")
_ANGLES = (
    ("Azimuth", 180.0, "of the beam's axis, from x of the link's frame towards y"),
    ("Elevation", 90.0, "of the beam's axis, towards z of the link's frame"),
    ("Roll", 180.0, "about the beam's axis; for a beam that is not round"),
)


def _labels(setup: Setup) -> list[str]:
    """Return a label for each ring and single sensor."""
    rings = [f"{i}: {printable(ring.link)[:40]}" for i, ring in enumerate(setup.rings)]
    return rings + [
        f"{i}: {printable(one.name or 'sensor')[:30]} ({printable(one.link)[:30]})"
        for i, one in enumerate(setup.singles, start=len(rings))
    ]


def labelled(names: Sequence[str]) -> dict[str, str]:
    """Return each name by its printable text; a later one with the same text gets its number,
    too.
    """
    found = dict[str, str]()
    for i, name in enumerate(names):
        label = printable(name)
        while label in found:
            label += f" ({i})"
        found[label] = name
    return found


class Controls:
    """The controls of one page, in the order on the page. ``Page`` defines what they do."""

    def __init__(self, gui: viser.GuiApi, room: ViewerSession, names: Sequence[str]) -> None:
        """Build the controls for the setups ``names``."""
        self._room, self._names = room, list(names)
        self._setups = [f"{chr(65 + i)}: {printable(name)[:60]}" for i, name in enumerate(names)]
        first = next(iter(room.setups.values()))
        self._rings = _labels(first)
        self._links = labelled(room.scene.robot.links)
        self.heading, self.headline = gui.add_html(""), gui.add_html("")
        self.legend, self.zeta = gui.add_html(""), gui.add_html("")
        self.search = gui.add_button(
            "Search from here", hint="Search for a better setup, starting from this one."
        )
        self.prove = gui.add_button(
            "Count exactly", hint="Count voxels, and compute a guaranteed interval."
        )
        self.stop = gui.add_button("Stop", color="red", visible=False)
        self.progress = gui.add_progress_bar(0.0, visible=False)
        self.said, self.proofs = gui.add_html(""), gui.add_html("")
        self.steps = gui.add_button_group("Changes", STEPS, hint="Also Ctrl+Z and Ctrl+Shift+Z.")
        tabs = gui.add_tab_group()
        with tabs.add_tab("View"):
            self._view(gui)
        with tabs.add_tab("Rings"):
            self._rings_and_sensors(gui)
        with tabs.add_tab("Search and files"):
            self._search_and_files(gui)

    def _view(self, gui: viser.GuiApi) -> None:
        """Add what changes the view only."""
        room, poses = self._room, len(self._room.scene.poses)
        several = len(self._names) > 1
        self.setup = gui.add_dropdown("Setup to change", self._setups, visible=several)
        self.pose = gui.add_slider("Pose", 0, max(poses - 1, 1), 1, 0, visible=poses > 1)
        self.play = gui.add_button("Play", visible=poses > 1)
        self.curve = self._curve(gui) if poses > 1 else None
        self.target = gui.add_dropdown("Target", [str(t) for t in room.targets])
        self.occlusion = gui.add_dropdown(
            "Robot's body",
            OCCLUSIONS if room.scene.robot.bodies else OCCLUSIONS[:1],
            initial_value=room.scene.occlusion,
            hint=(
                "ignore: beams pass through it. shadow: points behind it are not covered."
                " blind: a sensor that sees it covers nothing farther away."
            ),
        )
        self.views = gui.add_button_group("View from", (START, *VIEWS))
        self.kinds = gui.add_dropdown("Points", list(SHOWN_KINDS))
        self.cut = gui.add_dropdown(
            "Cut", CUTS, hint="Points on one side of a plane are not drawn. They still count."
        )
        reach = round(1000 * room.widest)
        self.plane = gui.add_slider(
            "Plane at, mm", -reach, reach, 10, 0, visible=False, hint="from the base"
        )
        self.cones = gui.add_dropdown("Cones", SHOWN_CONES, initial_value=DrawnParts.cones)
        self.outline = gui.add_checkbox("Outline of the target", True)
        self.robot = gui.add_checkbox("Robot", True)
        self.dark = gui.add_checkbox("Dark", False)

    def _curve(self, gui: viser.GuiApi) -> viser.GuiUplotHandle:
        """Add the curve of coverage over the poses."""
        at, name = pose_axis(self._room.scene.poses)
        none = np.full(len(at), np.nan)
        series: tuple[viser.uplot.Series, ...] = (
            {"label": name},
            {"label": "now", "stroke": CURVE_NOW, "width": 2},
            {"label": "as opened", "stroke": CURVE_OPENED, "width": 1, "dash": (6, 4)},
            {
                "label": "this pose",
                "stroke": CURVE_HERE,
                "points": {"show": True, "size": 9, "fill": CURVE_HERE},
            },
        )
        grid: viser.uplot.Axis_Grid = {"stroke": "rgba(128,128,128,.25)", "width": 1}
        across: viser.uplot.Axis = {
            "stroke": CURVE_OPENED,
            "grid": grid,
            "label": name,
            "labelSize": 18,
        }
        up: viser.uplot.Axis = {"stroke": CURVE_OPENED, "grid": grid, "size": 40}
        return gui.add_uplot(
            (at, none, none, none),
            series,
            title="ζ in % of the target",
            scales={"x": {"time": False}},
            axes=(across, up),
            legend={"live": False},
            padding=(12, 16, 0, 0),
            height=200,
        )

    def _rings_and_sensors(self, gui: viser.GuiApi) -> None:
        """Add what changes a setup."""
        self.preset = gui.add_dropdown(
            "Start from", (NO_PRESET, *self._room.presets), hint="Replaces all rings."
        )
        self.ring = gui.add_dropdown("Ring", self._rings, hint="Or a single sensor. Or click one.")
        self.sensor = gui.add_dropdown("Sensor", (NO_SENSOR,), hint="Or click one in the scene.")
        self.report = gui.add_html("")
        self.handles = gui.add_checkbox(
            "Handles", False, hint="Drag the ring along and around its link in the scene."
        )
        self.link = gui.add_dropdown("Link", list(self._links))
        self.position = gui.add_slider(
            "Position, mm", 0.0, 1.0, 1.0, 0.0, hint="from the proximal end of the link's axis"
        )
        self.tilt = gui.add_slider(
            "Tilt, °", -STEEPEST_DEG, STEEPEST_DEG, 0.5, 0.0, hint="positive towards distal"
        )
        self.phase = gui.add_slider("Phase, °", 0.0, 360.0, 0.5, 0.0, hint="about the link's axis")
        self.count = gui.add_slider("Sensors", 1, MOST_SENSORS, 1, 1)
        self.single = {
            key: gui.add_number(f"{key}, mm", 0.0, step=1.0, hint="in the frame of its link")
            for key in POSITIONS
        } | {
            f"{key.lower()}_deg": gui.add_slider(f"{key}, °", -most, most, 0.5, 0.0, hint=hint)
            for key, most, hint in _ANGLES
        }
        self.rules = gui.add_html("")
        self.add = gui.add_button("Add a ring on this link")
        self.remove = gui.add_button("Remove this ring")
        self.again = gui.add_button("As opened")

    def _search_and_files(self, gui: viser.GuiApi) -> None:
        """Add the options of a search, and what writes files."""
        self.aim = gui.add_dropdown("Search for", [AS_ASKED, *(str(t) for t in self._room.targets)])
        self.free = gui.add_checkbox(
            "Rings and counts free", False, hint="Keep the number of sensors; choose rings freely."
        )
        kept = self._room.out is not None
        self.name = gui.add_text("Name", "proposal")
        self.replace = gui.add_checkbox("Replace an existing file", False, disabled=not kept)
        self.save = gui.add_button(
            "Save as a new proposal" if kept else "Save (start with --out FOLDER)",
            disabled=not kept,
        )
        self.picture = gui.add_button("Picture of the view")
        self.address = gui.add_html("")

    def setup_number(self, label: str) -> int:
        """Return the index of the chosen setup; ValueError if there is none."""
        return self._setups.index(label)

    def ring_number(self, label: str) -> int:
        """Return the index of the chosen ring; ValueError if there is none."""
        return self._rings.index(label)

    def sensor_number(self, label: str) -> int | None:
        """Return the index of the chosen sensor, or None; ValueError if there is none such."""
        return None if label == NO_SENSOR else int(label)

    def link_named(self, label: str) -> str:
        """Return the link for a label; ``label`` itself if there is none."""
        return self._links.get(label, label)

    def tell(
        self,
        names: Sequence[str],
        setups: Sequence[Setup],
        rows: Sequence[words.TableRow],
        seconds: str,
        shares: Sequence[float],
        choice: DrawnParts,
        active: int,
    ) -> None:
        """Update the texts: setups, coverage, and the legend.

        Args:
            names: present names of the setups.
            setups: setups on the page.
            rows: coverage by target.
            seconds: how the estimate was made.
            shares: share of the active setup's points in each class.
            choice: what the page shows.
            active: index of the active setup.
        """
        scene, few = self._room.scene, self._room.glance.few
        poses = len(scene.poses)
        of = (
            f" at {few} of {poses} poses"
            if few < poses
            else f", mean of {poses} poses"
            if poses > 1
            else ""
        )
        where = f", {self._setups[active]}" if len(setups) > 1 else ""
        at = where + (f", at pose {choice.pose}" if poses > 1 else "")
        rings, sensors = [len(s.rings) for s in setups], [s.sensors for s in setups]
        self.heading.content = words.heading(names, scene.robot.name, sensors, rings)
        label = str(choice.target)
        now = next(row.values[active][1] for row in rows if row.target == label)
        self.headline.content = words.headline(
            now, label, words.meaning(choice.target, scene), where
        )
        self.zeta.content = words.zeta_table(
            self._setups if len(setups) > 1 else self._names, rows, seconds, of
        )
        self.legend.content = words.legend(shares, label, at, bool(self.dark.value))

    def follow(
        self, setup: Setup, i: int, active: int, most: int, sensor: int | None = None
    ) -> None:
        """Update the sliders.

        Args:
            setup: active setup.
            i: index of the ring or single sensor to show.
            active: index of the setup.
            most: largest number of sensors that the ring may have.
            sensor: index of the selected sensor on it, or None.
        """
        group = setup.groups[i]
        self._rings = _labels(setup)
        sensors = (NO_SENSOR, *map(str, range(group.count)))
        if tuple(self.sensor.options) != sensors:
            self.sensor.options = sensors
        set_value(self.sensor, NO_SENSOR if sensor is None else str(sensor))
        set_value(self.setup, self._setups[active])
        if tuple(self.ring.options) != tuple(self._rings):
            self.ring.options = tuple(self._rings)
        set_value(self.ring, self._rings[i])
        for control in (self.position, self.tilt, self.phase, self.count):
            control.visible = isinstance(group, Ring)
        for number in self.single.values():
            number.visible = isinstance(group, MountedSensor)
        if isinstance(group, MountedSensor):
            self._follow_single(group)
        else:
            self._follow_ring(group, most)

    def _follow_single(self, one: MountedSensor) -> None:
        pose = SinglePose.of(one)
        for key, number in self.single.items():
            value = getattr(pose, key) * (1000.0 if key in POSITIONS else 1.0)
            if abs(number.value - value) > 1e-3:
                set_value(number, value)
        self.single["roll_deg"].disabled = not one.sensor.oriented

    def _follow_ring(self, ring: Ring, most: int) -> None:
        of_ring = next(label for label, link in self._links.items() if link == ring.link)
        set_value(self.link, of_ring)
        length = 1000 * self._room.scene.robot.mount(ring.link).length
        self.position.disabled = length == 0
        if self.position.max != max(round(length, 1), 1.0):
            self.position.max = max(round(length, 1), 1.0)
        self.count.max = most
        values: tuple[tuple[Any, float], ...] = (
            (self.position, round(ring.position * length, 1)),
            (self.tilt, math.degrees(ring.tilt)),
            (self.phase, math.degrees(ring.phase) % 360),
            (self.count, ring.count),
        )
        for slider, value in values:
            if abs(slider.value - value) > slider.step / 2:  # keep what the user just set
                slider.value = value

    def working(self, on: bool) -> None:
        """Switch the controls when a long task starts or ends."""
        set_value(self.progress, 0.0)
        self.progress.visible = on
        self.stop.visible = on
        for button in (self.prove, self.search):
            button.disabled = on
        self.save.disabled = on or self._room.out is None
