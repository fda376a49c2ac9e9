"""Size and layout of the frames that a ring sends; docs/rig.md has the table of bytes."""

import struct

import numpy as np

# magic, version, count, its complement, sequence, timestamp in µs
HEADER = struct.Struct("<2sBBBHQ")
CHECK = struct.Struct("<I")
SENSORS = np.dtype([("mm", "<u2"), ("status", "u1")])


def frame_length(count: int) -> int:
    """Return the length of a frame with ``count`` sensors in bytes."""
    return HEADER.size + count * SENSORS.itemsize + CHECK.size
