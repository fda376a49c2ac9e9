"""Formats of ``place-rings export``, with the function that makes the files of each."""

from collections.abc import Callable, Mapping, Sequence

from ..coverage.robots.base_frame import frame_text, must_turn
from ..formats.export.coppeliasim import coppeliasim
from ..formats.export.glb import glb
from ..formats.export.mcap_log import mcap
from ..formats.export.mjcf import MOST_ZONES, mjcf, zone_count
from ..formats.export.placed import PlacedSetup
from ..formats.export.ros2 import ros2
from ..formats.export.sdf import sdf
from ..formats.export.sensor_tables import csv, json
from ..formats.export.srdf import srdf
from ..formats.export.urdf import urdf, xacro
from ..formats.export.usd import usd
from ..formats.firmware.ring_slots import slot_notes
from ..formats.firmware.wiring import plan_setup

Files = Mapping[str, bytes]  # contents by file name


def _urdf(placed: PlacedSetup) -> Files:
    return urdf(placed) | xacro(placed) | srdf(placed)


def _mcap(placed: PlacedSetup) -> Files:
    if not placed.readings:
        return mcap(placed)
    from ..simulation.twin.ros_topics import twin_topics  # loads the twin

    return mcap(placed, twin_topics)


def _stl(placed: PlacedSetup) -> Files:
    from ..formats.printing.print_files import ASSEMBLED, ring_files  # loads solids
    from .assembly_picture import assembly_picture
    from .ring_pictures import ring_pictures

    result, data = ring_files(placed.setup, placed.scene, ring_pictures)
    return data | {ASSEMBLED: assembly_picture(placed.scene, placed.setup, result, data)}


def _firmware(placed: PlacedSetup) -> Files:
    from ..formats.firmware.power_plan import power_page, power_plan
    from ..formats.firmware.sketch import DRAWING, sketch
    from .firing_text import firing_rows
    from .pages import csv_text
    from .wiring_drawing import wiring_drawing

    schedule = placed.schedule
    wirings = plan_setup(placed.setup, placed.scene.electronics, schedule)
    power = power_plan(placed.scene, placed.setup, wirings)
    files = {"POWER.md": power_page(power).encode()}
    if schedule is not None:
        files["schedule.csv"] = csv_text(firing_rows(schedule)).encode()
    for wiring in wirings:
        files |= sketch(wiring) | {f"{wiring.name}/{DRAWING}": wiring_drawing(wiring)}
    return files


FORMATS: dict[str, Callable[[PlacedSetup], Files]] = {
    "urdf": _urdf,
    "mjcf": mjcf,
    "usd": usd,
    "sdf": sdf,
    "glb": glb,
    "csv": csv,
    "json": json,
    "coppeliasim": coppeliasim,
    "ros2": ros2,
    "mcap": _mcap,
    "stl": _stl,
    "firmware": _firmware,
}


def export_notes(placed: PlacedSetup, kinds: Sequence[str]) -> list[str]:
    """Return notes on what these formats leave out of a setup."""
    notes = list[str]()
    if "firmware" in kinds and placed.schedule is not None:
        notes += slot_notes(placed.setup, placed.schedule)
    if "mjcf" in kinds and (zones := zone_count(placed)) > MOST_ZONES:
        notes.append(
            f"scene.xml: the sensors have {zones} zones; more than {MOST_ZONES} rangefinders slow"
            " MuJoCo down, so that each sensor has one, along its axis"
        )
    if "csv" in kinds and must_turn(placed.scene.robot, placed.base):
        notes.append(f"sensors.csv: in {frame_text(placed.scene.robot)}, as all such lists")
    if "usd" in kinds and placed.scene.robot.chain.mimics:
        notes.append("scene.usda: joints that follow another one move freely there")
    return notes
