"""Playing through the poses of a scene, and coverage over them as a curve."""

import math
import threading
from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from ..objectives.poses import Pose

_WHOLE = 12.0  # s for all poses
_PERIOD, _LONGEST = 0.1, 1.0  # s, shortest and longest time between two poses


class Player:
    """Steps through poses in a thread of its own.

    Args:
        count: number of poses.
        go: shows a pose by its index.
        changed: receives whether it plays, when that changes.
    """

    def __init__(
        self, count: int, go: Callable[[int], None], changed: Callable[[bool], None]
    ) -> None:
        self._count, self._go, self._changed = count, go, changed
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._lock = threading.Lock()

    @property
    def playing(self) -> bool:
        """Whether it plays."""
        return self._thread is not None and self._thread.is_alive() and not self._stop.is_set()

    def toggle(self, at: int) -> None:
        """Pause, or play from pose ``at``; from the first if that is the last."""
        with self._lock:
            if self.playing:
                self._stop.set()
                return
            self._stop = threading.Event()
            first = 0 if at >= self._count - 1 else at
            self._thread = threading.Thread(
                target=self._run, args=(first, self._stop), daemon=True, name="place-rings player"
            )
            self._thread.start()

    def close(self) -> None:
        """Stop."""
        self._stop.set()

    def _run(self, first: int, stop: threading.Event) -> None:
        self._changed(True)
        stride = max(math.ceil(self._count * _PERIOD / _WHOLE), 1)
        period = min(max(_WHOLE * stride / self._count, _PERIOD), _LONGEST)
        for pose in [*range(first, self._count - 1, stride), self._count - 1]:
            if stop.is_set():
                break
            self._go(pose)
            if stop.wait(period):
                break
        stop.set()
        self._changed(False)


def pose_axis(poses: tuple[Pose, ...]) -> tuple[Float[np.ndarray, " P"], str]:
    """Return where each pose (P,) stands on the curve's axis, and the axis' name.

    It is time in s where the poses come from a recorded motion, else the index of the pose.
    """
    times = [pose.time_s for pose in poses if pose.time_s is not None]
    if len(times) == len(poses) and all(np.diff(times) > 0):
        return np.array(times), "time, s"
    return np.arange(len(poses), dtype=float), "pose"


def curve_data(
    shares: dict[int, float], opened: dict[int, float], axis: Float[np.ndarray, " P"], pose: int
) -> tuple[Float[np.ndarray, " N"], ...]:
    """Return the curve's arrays (N,): axis, ζ now, ζ as opened, and ζ at the present pose only.

    Args:
        shares: ζ in [0, 1] at representative poses, by index.
        opened: the same of the setup as opened.
        axis: where each pose stands on the axis.
        pose: index of the present pose.
    """
    known = sorted(shares)
    at = np.unique(np.concatenate([axis[known], axis[[pose]]]))
    now, then = (
        100 * np.interp(at, axis[known], [each[k] for k in known]) for each in (shares, opened)
    )
    return at, now, then, np.where(at == axis[pose], now, np.nan)
