"""Controls of a page that change the view only."""

from collections.abc import Sequence

import numpy as np
import viser
import viser.uplot

from ..coverage.occlusion.occlusion_mode import OCCLUSIONS
from ..objectives.poses import Pose
from .camera import START, VIEWS
from .colours import KINDS
from .cut import CUTS
from .drawn_parts import SHOWN_CONES, DrawnParts
from .playback import pose_axis
from .session import ViewerSession

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
