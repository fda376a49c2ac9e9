"""Tables of sensor poses: CSV in the format of ``place-rings cones``, and JSON; both can be read
back as a setup."""

from ...coverage.definitions.definition import adapter
from ..sensors.sensor_lists import sensor_list
from ..sensors.sensor_poses import SensorPosesFile, poses_file
from .placed import PlacedSetup


def csv(placed: PlacedSetup) -> dict[str, bytes]:
    """Return ``sensors.csv``: the beam of every sensor at the pose, in the base frame."""
    return {"sensors.csv": sensor_list(placed.setup, placed.scene, [placed.pose]).encode()}


def json(placed: PlacedSetup) -> dict[str, bytes]:
    """Return ``sensors.json``: every sensor in the frame of its link, and in the base frame at the
    pose, looking along z."""
    file = poses_file(placed.scene, placed.setup, placed.pose, placed.base)
    text = adapter(SensorPosesFile).dump_json(file, indent=1, exclude_none=True)
    return {"sensors.json": text + b"\n"}
