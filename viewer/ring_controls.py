"""Controls of a page that change a setup: its rings and single sensors."""

import math
from typing import Any

import viser

from ..coverage.definitions.escaping import printable
from ..coverage.rings.mounted_sensor import MountedSensor
from ..coverage.rings.ring import Ring, Setup
from .browser import labelled, set_value
from .edited_setup import MOST_SENSORS, STEEPEST_DEG, SinglePose
from .session import ViewerSession

NO_PRESET, NO_SENSOR = "…", "none"
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


class RingControls:
    """The controls of the tab ``Rings``."""

    def __init__(self, gui: viser.GuiApi, room: ViewerSession, first: Setup) -> None:
        """Add the controls; they show the setup ``first``."""
        self._room, self._labels = room, _labels(first)
        self._links = labelled(room.scene.robot.links)
        self.preset = gui.add_dropdown(
            "Start from", (NO_PRESET, *room.presets), hint="Replaces all rings."
        )
        self.ring = gui.add_dropdown("Ring", self._labels, hint="Or a single sensor. Or click one.")
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
        self.add = gui.add_button("Add a ring on this link")
        self.remove = gui.add_button("Remove this ring")
        self.again = gui.add_button("As opened")

    def ring_number(self, label: str) -> int:
        """Return the index of the chosen ring; ValueError if there is none."""
        return self._labels.index(label)

    def sensor_number(self, label: str) -> int | None:
        """Return the index of the chosen sensor, or None; ValueError if there is none such."""
        return None if label == NO_SENSOR else int(label)

    def link_named(self, label: str) -> str:
        """Return the link for a label; ``label`` itself if there is none."""
        return self._links.get(label, label)

    def follow(self, setup: Setup, i: int, most: int, sensor: int | None = None) -> None:
        """Update the controls.

        Args:
            setup: the setup.
            i: index of the ring or single sensor to show.
            most: largest number of sensors that the ring may have.
            sensor: index of the selected sensor on it, or None.
        """
        group = setup.groups[i]
        self._labels = _labels(setup)
        sensors = (NO_SENSOR, *map(str, range(group.count)))
        if tuple(self.sensor.options) != sensors:
            self.sensor.options = sensors
        set_value(self.sensor, NO_SENSOR if sensor is None else str(sensor))
        if tuple(self.ring.options) != tuple(self._labels):
            self.ring.options = tuple(self._labels)
        set_value(self.ring, self._labels[i])
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
            set_value(number, value, nearly=1e-3)
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
            set_value(slider, value, nearly=slider.step / 2)  # keep what the user just set
