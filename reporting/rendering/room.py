"""Floor and far walls of a picture, with a grid in metres of the base frame."""

from typing import Any

import numpy as np

from ..plots import GREY, GRID, INK
from .canvas import Canvas


def draw_room(canvas: Canvas) -> None:
    """Draw the floor and the far walls of the box with a grid in metres of the base frame; from
    above, the floor only.
    """
    from matplotlib.collections import LineCollection

    (low, high), walls = canvas.box, canvas.rotation[2, 2] < 0.99
    far = np.where(canvas.rotation[2] > 0, low, high)
    near, unit, step = (
        low + high - far,
        0.035 * canvas.size,
        0.5 if (high - low).max() < 2.8 else 1.0,
    )
    ticks = [
        step * np.arange(np.ceil(low[i] / step), np.floor(high[i] / step) + 1) + 0.0
        for i in range(3)
    ]

    # the line across the box at t on axis i
    def rule(i: int, along: int, t: float, start: Any) -> Any:
        ends = np.array([start, start])
        ends[:, i], ends[:, along] = t, canvas.box[:, along]
        return canvas.project(ends)[0]

    faces = [(0, 1), (1, 0), *([(0, 2), (2, 0), (1, 2), (2, 1)] if walls else [])]
    rules = [rule(i, j, t, far) for i, j in faces for t in (low[i], *ticks[i], high[i])]
    canvas.ax.add_collection(LineCollection(rules, colors=GRID, linewidths=0.8, zorder=0))
    front, left = np.array([near[0], near[1], low[2]]), np.array([far[0], near[1], low[2]])
    for i, start in enumerate((front, front, left) if walls else (front, front)):
        a, b = rule(i, i, 0, start)
        x, y = (b - a) / np.linalg.norm(b - a)
        out = np.array([y, -x]) * np.sign(a @ [y, -x])  # away from the centre, which is at 0
        for t in ticks[i]:
            # x and y meet at the near corner
            if i == 2 or not walls or abs(t - near[i]) > 0.12 * step:
                u, v = canvas.project(np.array([*start[:i], t, *start[i + 1 :]]))[0] + unit * out
                canvas.ax.text(u, v, f"{t:g}", color=GREY, fontsize=10.5, ha="center", va="center")
        name, angle = (a + b) / 2 + 2.2 * unit * out, (np.degrees(np.arctan2(y, x)) + 80) % 180 - 80
        canvas.ax.text(
            name[0],
            name[1],
            f"{'xyz'[i]} (m)",
            color=INK,
            fontsize=11.5,
            rotation=angle,
            ha="center",
            va="center",
        )
        canvas.ax.update_datalim([name + 0.6 * unit * out])
