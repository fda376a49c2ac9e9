"""How late frames come on a busy machine, and which readings of a simulated check count."""

import numpy as np

from ..sensing.readings import Readings
from ..session.gathering import Gathered
from .simulated_time import Lateness

BUSY = Lateness(
    (0.0, 0.1, 0.25, 0.5, 0.75, 0.9, 0.95, 0.98, 0.99, 0.995, 0.999, 1.0),
    (0.0, 0.0007, 0.0032, 0.0077, 0.0228, 0.0517, 0.0736, 0.099, 0.1207, 0.1596, 0.2316, 0.3348),
)
"""Delays of 2,957 frames of a ring, beside eight busy processes on two cores, relative to the
quickest, measured once. The correlation of two frames
0.04 s apart was 0.58, 0.2 s apart 0.24.
"""


def counted(readings: Readings, gathered: Gathered) -> Readings:
    """Select the readings of the steps that a simulated mount check noted."""
    some, begun = np.zeros(len(readings), bool), 0.0
    for at, said in gathered.said:
        if said["what"] == "begin":
            begun = at
        elif said["what"] == "end":
            some |= (readings.time >= begun) & (readings.time <= at)
    return readings.only(some)
