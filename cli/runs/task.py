"""Print the paper's task as CSV."""

import csv
import io

from ...objectives.scene import Scene
from ...reporting.terminal import say_lines
from ...simulation.pick_and_place import pick_and_place


def task(scene: Scene, rate: float) -> None:
    """Print the paper's task as a recorded motion at ``rate`` rows a second."""
    motion = pick_and_place(scene.robot).every(rate)
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["time_s", *(f"q{i}" for i in range(len(scene.robot.chain)))])
    writer.writerows(
        [round(float(v), 9) + 0.0 for v in (t, *q)]
        for t, q in zip(motion.time_s, motion.q, strict=True)
    )
    say_lines(text.getvalue())
