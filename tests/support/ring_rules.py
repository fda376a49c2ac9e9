"""The rules for one ring among others, by a judge that uses no rule of the package."""

from collections.abc import Iterable

from place_rings.coverage.rings.ring import Ring
from place_rings.objectives.scene import Scene


def check_ring(
    scene: Scene, ring: Ring, others: Iterable[Ring], place: float, angle: float
) -> None:
    """A ring keeps its limits, and its distance from all others, but for rounding."""
    limits, length = scene.limits_of(ring.link), scene.robot.mount(ring.link).length
    if not scene.rules.shared_tilt:
        assert limits.tilt[0] - angle <= ring.tilt <= limits.tilt[1] + angle
    beside = [other for other in others if other is not ring and other.link == ring.link]
    if length > 0:
        margin, at = scene.rules.from_joints / length, ring.position
        low, high = max(limits.position[0], margin), min(limits.position[1], 1 - margin)
        assert low - place <= at <= high + place
        assert not any(a + place < at < b - place for a, b in limits.keep_out)
        for other in beside:
            assert abs(other.position - at) * length >= scene.rules.spacing - place
