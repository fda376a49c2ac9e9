"""Lines about targets that extend beyond the reach of the sensors."""

from ...objectives.reach import farthest, reachable_share
from ...objectives.scene import CoreScene

_ALL = 0.995  # share of a target from which nothing is said


def reach_lines(scene: CoreScene) -> list[str]:
    """Return a line for each target of which a part is out of reach of all rings.

    Raises:
        ValueError: as ``reachable_share`` does.
    """
    lines, far = [], max(farthest(sensor) for sensor in scene.sensors)
    for goal in scene.goals:
        share = reachable_share(scene, goal.target)
        if share < _ALL:
            lines.append(
                f"{goal.target} extends beyond the sensors' reach: no layout covers more than about"
                f" {100 * share:.0f} % of it, because a beam ends at most {far:.2f} m from its"
                " sensor."
            )
    return lines
