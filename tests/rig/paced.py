"""Frames of rings that fire in slots, in simulated time."""

import numpy as np
from place_rings.rig.check.timing_check import RingFrames
from place_rings.rig.rings.protocol import Frame, Status
from place_rings.rig.simulated.frame_pace import FramePace


def frames_of(pace, count, rng, seconds=6.0, late=0.0, slower=1.0, lost=0.0, noise=0.004):
    """What a ring sends: each reading stays until the sensor's next slot."""
    paced, frames, number = FramePace(pace, count, late, slower), [], 0
    distance = np.ones(count)
    while (at := paced.due(number)) < seconds:
        new = np.round(1 + rng.normal(0, noise, count), 3)
        distance = np.where(paced.fresh(number), new, distance)
        if rng.random() >= lost:
            frames.append(Frame(at, at, number, distance, np.full(count, Status.VALID)))
        number += 1
    return frames


def heard(frames, rng, delay=0.0, drift=0.0, jitter=0.0):
    """These frames as a host times them."""
    sent = np.array([frame.clock for frame in frames])
    times = delay + (1 + drift) * sent + rng.uniform(-jitter, jitter, len(sent))
    return RingFrames.of(frames, times - 3.0)
