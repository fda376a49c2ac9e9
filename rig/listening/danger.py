"""What asks for a stop while the robot moves: a fault of link or recording, a ring that is not heard, a near reading."""

from collections.abc import Collection, Sequence

import numpy as np
from jaxtyping import Float

from ..rings.protocol import Frame, Status
from .session import Session

NEAR = 0.15  # m, a default


def near(
    frames: Sequence[Frame | None],
    least: float | Sequence[Float[np.ndarray, " n"]] = NEAR,
    passed_over: Collection[tuple[int, int]] = (),
) -> str | None:
    """What is wrong with the newest frames of all rings; None: nothing.

    Args:
        frames: of each ring; None where there is no fresh one.
        least: m, the nearest that a valid or a weak reading may be; of all, or of each ring's sensors.
        passed_over: (ring, sensor) of those that see the robot itself, or are known to have failed.
    """
    for ring, frame in enumerate(frames):
        if frame is None:
            return f"ring {ring} is not heard"
        most = np.broadcast_to(least if isinstance(least, float) else least[ring], frame.distance.shape)
        told = np.isin(frame.status, (Status.VALID, Status.WEAK)) & (frame.distance < most)
        for sensor in np.flatnonzero(told):
            if (ring, int(sensor)) not in passed_over:
                found, allowed = 1000 * frame.distance[sensor], 1000 * most[sensor]
                return f"ring {ring}, sensor {sensor}: {found:.0f} mm, nearer than {allowed:.0f} mm"
    return None


def danger(
    session: Session,
    least: float | Sequence[Float[np.ndarray, " n"]] = NEAR,
    passed_over: Collection[tuple[int, int]] = (),
) -> str | None:
    """What asks for a stop right now, as ``motion.Mover`` wants it; arguments as of ``near``."""
    return session.trouble or near(session.rings.latest(), least, passed_over)
