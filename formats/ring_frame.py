"""Size and layout of the frames and hellos that a ring sends; docs/rig.md has the tables of
bytes.
"""

import struct
from typing import NamedTuple

import numpy as np

# magic, version, count, its complement, sequence, timestamp in µs
HEADER = struct.Struct("<2sBBBHQ")
# of a frame with zones, after its header: rows, columns, targets, content, complement
GRID = struct.Struct("<BBBBB")
CHECK = struct.Struct("<I")
HELLO = struct.Struct("<2sBBQ")  # magic, version, number of sensors, serial number of the board
SENSORS = np.dtype([("mm", "<u2"), ("status", "u1")])
# of a target whose chip states its precision: standard deviation in mm, signal in kcps per SPAD
MEASURED = np.dtype([("mm", "<u2"), ("status", "u1"), ("sigma", "u1"), ("signal", "<u2")])
MOST_ZONES, MOST_TARGETS = 64, 4


class Grid(NamedTuple):
    """Zones of a sensor, and what a frame holds of each."""

    rows: int
    """Rows of zones."""
    columns: int
    """Zones in a row."""
    targets: int = 1
    """Targets of a zone, nearest first."""
    measured: bool = False
    """Whether each target has its standard deviation and signal."""

    @property
    def zones(self) -> int:
        """Number of zones."""
        return self.rows * self.columns

    @property
    def record(self) -> np.dtype:
        """NumPy type of a target."""
        return MEASURED if self.measured else SENSORS

    def pack(self) -> bytes:
        """Return the bytes that state the grid."""
        four = (self.rows, self.columns, self.targets, int(self.measured))
        return GRID.pack(*four, 255 ^ four[0] ^ four[1] ^ four[2] ^ four[3])

    @staticmethod
    def read(data: bytes | bytearray, at: int) -> "Grid | None":
        """Return the grid that the bytes from ``at`` on state; None if they state none."""
        rows, columns, targets, content, complement = GRID.unpack_from(data, at)
        right = complement == 255 ^ rows ^ columns ^ targets ^ content and content in (0, 1)
        if right and 1 <= rows * columns <= MOST_ZONES and 1 <= targets <= MOST_TARGETS:
            return Grid(rows, columns, targets, bool(content))
        return None


def frame_length(count: int, grid: Grid | None = None) -> int:
    """Return the length of a frame with ``count`` sensors, each with the zones of ``grid``, in
    bytes.
    """
    if grid is None:
        return HEADER.size + count * SENSORS.itemsize + CHECK.size
    targets = count * grid.zones * grid.targets
    return HEADER.size + GRID.size + targets * grid.record.itemsize + CHECK.size
