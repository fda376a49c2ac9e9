"""MCAP: a run of the robot through the poses of a scene as a ROS 2 bag, for Foxglove, rerun, RViz
and ``ros2 bag play``."""

import tempfile
from pathlib import Path

import numpy as np
from jaxtyping import Float

from .frame_tree import fixed_frames, joint_names, moved_frames
from .glb_animation import keys
from .placed import PlacedSetup
from .ros2_bag import JOINTS, STATIC, TRANSFORMS, RosBag, bag_files, require_rosbags

RUN = "run"  # folder of the bag
_RATE = 20.0  # messages per second
_MOST = 20_000  # messages of a topic
_START = 1.0  # s, of the first message: a stamp of 0 means the latest transform in ROS


def mcap(placed: PlacedSetup) -> dict[str, bytes]:
    """Return ``run/run.mcap`` and ``run/metadata.yaml``: ``/joint_states`` and ``/tf`` along the
    scene's poses, and ``/tf_static`` with all sensors, which look along x.

    Raises:
        UserError: if rosbags is missing, or the user's URDF lacks the robot's chain.
    """
    require_rosbags("--to mcap")
    stamps, q = _samples(placed)
    moved, names = moved_frames(placed, q), joint_names(placed)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / RUN
        with RosBag(path) as bag:
            fixed = bag.transforms(stamps[0], fixed_frames(placed))
            bag.write(STATIC, TRANSFORMS, stamps[0], fixed)
            for k, stamp in enumerate(stamps):
                bag.write("/joint_states", JOINTS, stamp, bag.joints(stamp, names, q[k]))
                bag.write("/tf", TRANSFORMS, stamp, bag.transforms(stamp, moved[k]))
        return {f"{RUN}/{name}": data for name, data in bag_files(path).items()}


def _samples(placed: PlacedSetup) -> tuple[Float[np.ndarray, " S"], Float[np.ndarray, "S J"]]:
    """Return stamps (S,) s and joint values (S, J), evenly in time along the poses."""
    times, q = keys(placed.scene.robot.chain, placed.scene.poses)
    count = int(min(times[-1] * _RATE + 1, _MOST))
    at = np.linspace(0, times[-1], max(count, 1))
    return _START + at, np.stack([np.interp(at, times, joint) for joint in q.T], axis=1)
