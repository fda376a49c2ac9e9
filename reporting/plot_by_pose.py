"""Picture of the coverage of each pose: over the time of a motion, or pose by pose."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from ..objectives.scene import Scene
from ..objectives.verified import Verified
from .plots import COLOURS, GREY, INK, plain, save, sheet
from .tables import percent, target_label

_HEIGHT = 2.6  # inches, of one target
_MARKED = 30  # largest number of poses of which each is marked


def plot_by_pose(results: Sequence[Verified], scene: Scene, file: Path) -> None:
    """Draw ζ of a setup at each pose, one row for each target.

    The band is the error of a count, or the guaranteed interval. The dashed line is the mean by the
    weights of the poses.

    Args:
        results: records of the targets, with their poses.
        scene: scene of the count.
        file: PNG to write.
    """
    figure = sheet(9.0, _HEIGHT * len(results) + 0.3)
    rows = figure.subplots(len(results), 1, sharex=True, squeeze=False)[:, 0]
    times = [pose.time_s for pose in scene.poses]
    known = [t for t in times if t is not None]
    moving = len(known) == len(times)
    x = np.array(known) if moving else np.arange(len(times), dtype=float)
    for ax, record in zip(rows, results, strict=True):
        _row(ax, record, x)
        title = f"{record.setup}, {target_label(record)}: {percent(record, record.rule)} %"
        plain(ax, f"{title} as a mean over {len(x)} poses", y="ζ, %")
    rows[-1].set_xlabel("time in the motion, s" if moving else "pose")
    if not moving:
        rows[-1].xaxis.set_major_locator(MaxNLocator(integer=True))
    save(figure, file)


def _row(ax: Axes, record: Verified, x: np.ndarray) -> None:
    """Draw the curve of one target, its band, its mean and its worst pose."""
    zeta = 100 * np.array([pose.zeta for pose in record.poses])
    error = np.array([100 * (pose.error or 0.0) for pose in record.poses])
    low = np.minimum([100 * pose.low for pose in record.poses], zeta - error)
    high = np.maximum([100 * pose.high for pose in record.poses], zeta + error)
    ax.fill_between(x, low, high, color=COLOURS[5], alpha=0.5, lw=0)
    marker = "o" if len(x) <= _MARKED else ""
    ax.plot(x, zeta, color=COLOURS[0], lw=1.4, marker=marker, ms=4)
    ax.axhline(100 * record.zeta, color=GREY, lw=1, ls="--")
    worst = int(zeta.argmin())
    ax.plot(x[worst], zeta[worst], "o", color=COLOURS[1], ms=6)
    beside = float(np.clip((x[worst] - x[0]) / max(np.ptp(x), 1e-9), 0.0, 1.0))
    ax.annotate(
        f"worst: {zeta[worst]:.1f} %, pose {worst}",
        (x[worst], zeta[worst]),
        xytext=(0, -7),
        textcoords="offset points",
        ha="left" if beside < 0.2 else "right" if beside > 0.8 else "center",
        va="top",
        color=INK,
        fontsize=9,
    )
    span = max(high.max() - low.min(), 1.0)
    ax.set_ylim(max(low.min() - 0.25 * span, 0.0), min(high.max() + 0.15 * span, 100.0))
