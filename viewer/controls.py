"""Controls of a page: its texts, what starts tasks and writes files, and the tabs."""

from collections.abc import Sequence

import numpy as np
import viser
import viser.uplot

from ..coverage.definitions.escaping import printable
from ..coverage.occlusion.occlusion_mode import OCCLUSIONS
from ..coverage.rings.ring import Setup
from ..objectives.poses import Pose
from ..reporting.tables import target_meaning
from . import html as words
from .browser import set_value
from .camera import START, VIEWS
from .colours import KINDS
from .drawn_parts import CUTS, SHOWN_CONES, DrawnParts
from .playback import pose_axis
from .ring_controls import RingControls
from .session import ViewerSession

AS_ASKED = "as the scene asks"
UNDO, REDO = STEPS = ("Undo", "Redo")


class Controls:
    """The controls of one page, in the order on the page. ``Page`` defines what they do."""

    def __init__(self, gui: viser.GuiApi, room: ViewerSession, names: Sequence[str]) -> None:
        """Build the controls for the setups ``names``."""
        self._room, self._names = room, list(names)
        self._setups = [f"{chr(65 + i)}: {printable(name)[:60]}" for i, name in enumerate(names)]
        self.heading, self.headline = gui.add_html(""), gui.add_html("")
        self.rules = gui.add_html("")
        self.legend, self.zeta = gui.add_html(""), gui.add_html("")
        self.search = gui.add_button(
            "Search from here", hint="Search for a better setup, starting from this one."
        )
        self.prove = gui.add_button(
            "Count",
            hint="Count voxels, with the error of the count, and compute a guaranteed interval.",
        )
        self.unseen = gui.add_button(
            "Find unseen spheres",
            hint="Find the largest sphere about each place of the target that no sensor sees.",
        )
        self.stop = gui.add_button("Stop", color="red", visible=False)
        self.progress = gui.add_progress_bar(0.0, visible=False)
        self.said, self.proofs = gui.add_html(""), gui.add_html("")
        self.spheres = gui.add_html("")
        self.steps = gui.add_button_group("Changes", STEPS, hint="Also Ctrl+Z and Ctrl+Shift+Z.")
        tabs = gui.add_tab_group()
        with tabs.add_tab("View"):
            self.view = ViewControls(gui, room, self._setups)
        with tabs.add_tab("Rings"):
            self.rings = RingControls(gui, room, next(iter(room.setups.values())))
        with tabs.add_tab("Search and files"):
            self._search_and_files(gui)

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
        """Update the active setup and the texts: setups, coverage, and the legend.

        Args:
            names: present names of the setups.
            setups: setups on the page.
            rows: coverage by target.
            seconds: how the estimate was made.
            shares: share of the active setup's points in each class.
            choice: what the page shows.
            active: index of the active setup.
        """
        set_value(self.view.setup, self._setups[active])
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
        row = next(row for row in rows if row.target == label)
        dark = row.dark[active] if row.dark else None
        self.headline.content = words.headline(
            row.values[active][1],
            label,
            target_meaning(choice.target, scene),
            where,
            dark,
        )
        self.zeta.content = words.zeta_table(
            self._setups if len(setups) > 1 else self._names, rows, seconds, of
        )
        self.legend.content = words.legend(shares, label, at, bool(self.view.dark.value))

    def working(self, on: bool) -> None:
        """Switch the controls when a long task starts or ends."""
        set_value(self.progress, 0.0)
        self.progress.visible = on
        self.stop.visible = on
        for button in (self.prove, self.search, self.unseen):
            button.disabled = on
        self.save.disabled = on or self._room.out is None


SHOWN_KINDS = {
    "all": frozenset(k.number for k in KINDS),
    "uncovered": frozenset(k.number for k in KINDS if not k.covered),
    "covered": frozenset(k.number for k in KINDS if k.covered),
    "none": frozenset[int](),
}
"""Classes of points by the option that shows them."""
_NOW, _OPENED, _HERE = "#0072B2", "#888888", "#D55E00"


class ViewControls:
    """The controls of the tab ``View``."""

    def __init__(self, gui: viser.GuiApi, room: ViewerSession, setups: Sequence[str]) -> None:
        """Add the controls for the setups with these labels."""
        poses = len(room.scene.poses)
        self.setup = gui.add_dropdown("Setup to change", setups, visible=len(setups) > 1)
        self.pose = gui.add_slider("Pose", 0, max(poses - 1, 1), 1, 0, visible=poses > 1)
        self.play = gui.add_button("Play", visible=poses > 1)
        self.curve = _curve(gui, room.scene.poses) if poses > 1 else None
        self.target = gui.add_dropdown("Target", [str(t) for t in room.targets])
        self.occlusion = gui.add_dropdown(
            "Robot's body",
            OCCLUSIONS if room.scene.robot.bodies else OCCLUSIONS[:1],
            initial_value=room.scene.occlusion,
            hint=(
                "ignore: beams pass through it. shadow: points behind it are not covered."
                " blind: a sensor that sees it covers nothing farther away. returns: it does if it"
                " reports several targets that are far enough apart."
            ),
        )
        self.views = gui.add_button_group("View from", (START, *VIEWS))
        self.kinds = gui.add_dropdown("Points", list(SHOWN_KINDS))
        self.spheres = gui.add_checkbox(
            "Unseen spheres", True, hint="Once they are found: in place of the points."
        )
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


def _curve(gui: viser.GuiApi, poses: tuple[Pose, ...]) -> viser.GuiUplotHandle:
    """Add the curve of coverage over the poses."""
    at, name = pose_axis(poses)
    none = np.full(len(at), np.nan)
    series: tuple[viser.uplot.Series, ...] = (
        {"label": name},
        {"label": "now", "stroke": _NOW, "width": 2},
        {"label": "as opened", "stroke": _OPENED, "width": 1, "dash": (6, 4)},
        {
            "label": "this pose",
            "stroke": _HERE,
            "points": {"show": True, "size": 9, "fill": _HERE},
        },
    )
    grid: viser.uplot.Axis_Grid = {"stroke": "rgba(128,128,128,.25)", "width": 1}
    across: viser.uplot.Axis = {
        "stroke": _OPENED,
        "grid": grid,
        "label": name,
        "labelSize": 18,
    }
    up: viser.uplot.Axis = {"stroke": _OPENED, "grid": grid, "size": 40}
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
