"""Tables of sensor poses: CSV as ``place-rings cones`` prints it, and JSON; both are read back into
a setup.
"""

from ..sensors.sensor_lists import sensor_list
from ..sensors.sensor_poses import poses_file
from .placed import PlacedSetup


def csv(placed: PlacedSetup) -> dict[str, bytes]:
    """``sensors.csv``: every sensor's beam at the pose, base frame."""
    return {"sensors.csv": sensor_list(placed.setup, placed.scene, [placed.pose]).encode()}


def json(placed: PlacedSetup) -> dict[str, bytes]:
    """``sensors.json``: every sensor in the frame of its link, and in the base frame at the pose;
    it looks along z.
    """
    file = poses_file(placed.scene, placed.setup, placed.pose)
    return {"sensors.json": (file.model_dump_json(indent=1, exclude_none=True) + "\n").encode()}
