"""Sensors that lie flush in a body, lifted to its surface."""

from ._arguments import number
from ._errors import InputError, input_errors
from ._validation import SetupLike, resolve_setup
from .coverage.rings.ring import Setup
from .coverage.rings.surface_lift import lift_to_surface as lift
from .objectives.scene import Scene


def lift_to_surface(setup: SetupLike, scene: Scene | None = None, *, limit: float = 0.03) -> Setup:
    """Move sensors that lie in a body of their own link along their axes to its surface.

    The bodies of a robot are capsules, a little larger than its links, so that a pad of a skin or a
    board on a housing lies inside and sees nothing. Only bodies that move with the sensor count,
    so that its place on the link is the same at every pose. A ring of which a sensor moves becomes
    single sensors. ``MountedSensor.lifted`` of each states how far it moved.

    Args:
        setup: the setup, as in ``verify``.
        scene: its scene; by default the proposal's own, or the reference scene.
        limit: largest distance, m; sensors that would need more stay.

    Returns:
        The setup with these sensors moved.

    Raises:
        InputError: for a robot without bodies, or a limit out of range.

    Example:
        >>> import place_rings as pr
        >>> pad = pr.MountedSensor("forearm", (0.04, 0.0, 0.3), (1.0, 0.0, 0.0))
        >>> lifted = pr.lift_to_surface(pr.Setup((), (pad,)), limit=0.05).singles[0]
        >>> 0 < lifted.lifted < 0.05, abs(lifted.position[0] - 0.04 - lifted.lifted) < 1e-12
        (True, True)
    """
    number("limit", limit, "m, above 0")
    if not limit > 0:
        raise InputError(f"found {limit:g}, allowed: m, above 0", "limit")
    _, placed, core = resolve_setup(setup, scene)
    with input_errors():
        return lift(core.robot, placed, limit)[0]
