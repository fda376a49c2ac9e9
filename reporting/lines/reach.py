"""Lines about how far sensors and people reach into targets."""

from collections.abc import Sequence

from ...formats.schema.result_models import VerifyResult
from ...objectives.reach import Beyond, beyond_sensors
from ...objectives.scene import CoreScene
from ..tables import target_label

_NONE = 0.5  # percent of a target, below which nothing is said


def reach_lines(scene: CoreScene) -> list[str]:
    """Return a line for each target of which no layout covers a part.

    Raises:
        ValueError: as ``beyond_sensors`` does.
    """
    each = [(str(g.target), beyond_sensors(scene, g.target)) for g in scene.targets]
    return [line for name, b in each for line in _beyond(name, b)]


def record_lines(results: Sequence[VerifyResult]) -> list[str]:
    """Return lines about the parts of targets that no layout covers and that people can touch."""
    lines = []
    for r in results:
        if r.beyond is not None:
            lines += _beyond(target_label(r), r.beyond)
        if r.people is not None:
            lines.append(
                f"{target_label(r)}: a person can touch {100 * r.people.share:.1f} % of it; of this"
                f" part {100 * r.people.zeta:.2f} % is covered."
            )
    return lines


def _beyond(name: str, beyond: Beyond) -> list[str]:
    share, error = 100 * beyond.share, 100 * beyond.error
    if share <= _NONE:
        return []
    return [
        f"{name}: {share:.1f} % (± {error:.1f}) of it is beyond any sensor that the rules allow on"
        f" the arm; no layout covers more than about {min(100 - share + error, 100):.1f} %."
    ]
