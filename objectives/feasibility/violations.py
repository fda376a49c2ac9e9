"""Which of a scene's rules a setup violates, computed from the setup alone."""

import itertools
import math
from collections import Counter
from collections.abc import Sequence

from ...coverage.rings.ring import Ring, Setup
from ...coverage.rings.ring_envelope import Envelope
from ..scene import Scene
from .board_fit import unfit, unwired
from .clearance import MountClearance
from .mounting import REAL, Fault, standing
from .ring_envelopes import envelope, spacing

# Files hold positions to 1e-6 of a link, rounded to the safe side, and angles to 1e-4 degrees,
# rounded to the nearest.
_PLACE, _ANGLE = 1e-8, 1e-6
_BUILT = ("spacing", "printing")  # keys of the rules that this module checks of a real mount
ELECTRONICS = "electronics"
"""Rule of a ring whose sensors its bus, controller or regulator does not carry."""
_SAME_PLACE = 2e-6  # of a link: tolerance for a file's ring to match a ring of a scene


def _same(a: Ring, b: Ring) -> bool:
    turn = math.remainder(a.phase - b.phase, 2 * math.pi / max(a.count, 1))
    return (
        (a.link, a.count) == (b.link, b.count)
        and abs(a.position - b.position) < _SAME_PLACE
        and max(abs(a.tilt - b.tilt), abs(turn)) < 2 * _ANGLE
        and abs(a.radius - b.radius) < _PLACE
    )


def held(scene: Scene, rings: Sequence[Ring]) -> tuple[frozenset[int], tuple[Ring, ...]]:
    """Return which of ``rings`` are fixed rings of the scene, and which fixed rings are missing."""
    matched: set[int] = set()
    missing = []
    for fixed in scene.rules.fixed:
        match = next(
            (i for i, ring in enumerate(rings) if i not in matched and _same(ring, fixed)), None
        )
        if match is None:
            missing.append(fixed)
        else:
            matched.add(match)
    return frozenset(matched), tuple(missing)


def commonest_tilt(rings: Sequence[Ring]) -> float:
    """Return the most common absolute tilt of ``rings``, rad; the first one of several.

    ``rings`` must not be empty.
    """
    rounded = Counter(round(abs(ring.tilt), 5) for ring in rings)
    most = max(rounded, key=lambda tilt: rounded[tilt])
    return next(abs(ring.tilt) for ring in rings if round(abs(ring.tilt), 5) == most)


def otherwise_tilted(scene: Scene, rings: Sequence[Ring]) -> list[int]:
    """Return the fixed rings of ``rings`` that keep another tilt than the one that all others
    share; none without the rule."""
    fixed, _ = held(scene, rings)
    own = [ring for i, ring in enumerate(rings) if i not in fixed]
    if not scene.rules.shared_tilt or not own:
        return []
    tilt = commonest_tilt(own)
    return [i for i in sorted(fixed) if abs(abs(rings[i].tilt) - tilt) > 2 * _ANGLE]


def faults(scene: Scene, rings: Sequence[Ring], clear: MountClearance | None = None) -> list[Fault]:
    """Return all violations of the rules of ``scene`` by ``rings``.

    Args:
        scene: the scene.
        rings: the rings of the setup. The scene's fixed rings may have any tilt and position.
        clear: the scene's mount clearance, if it is already available.
    """
    fixed, missing = held(scene, rings)
    own = [i for i in range(len(rings)) if i not in fixed]
    broken = [f for i in own for f in _alone(scene, i, rings[i])]
    envelopes = [envelope(scene, ring) for ring in rings] if scene.real else []
    for i, j in itertools.combinations(range(len(rings)), 2):
        same = rings[i].link == rings[j].link and not {i, j} <= fixed
        if same and (text := _too_near(scene, rings, i, j, envelopes)):
            broken.append(Fault((i, j), "spacing", f"rings {i} and {j} ({rings[i].link}) {text}"))
    if scene.real:
        real = standing(clear or MountClearance(scene), rings)
        broken += [fault for fault in real if not set(fault.rings) <= fixed]
    for link in scene.robot.links:
        there = [i for i, ring in enumerate(rings) if ring.link == link]
        if len(there) > scene.rules.max_rings_per_link and not set(there) <= fixed:
            text = f"{link} has {len(there)} rings, allowed: {scene.rules.max_rings_per_link}"
            broken.append(Fault(tuple(i for i in there if i in own), "max_rings_per_link", text))
    if scene.rules.shared_tilt and own:
        tilt = commonest_tilt([rings[i] for i in own])
        for i in own:
            if abs(abs(rings[i].tilt) - tilt) > 2 * _ANGLE:
                leans = f"is tilted by {_deg(rings[i].tilt)}, most by {_deg(tilt)}"
                broken.append(Fault((i,), "shared_tilt", f"ring {i} ({rings[i].link}) {leans}"))
    broken += [
        Fault((), "fixed", f"the fixed ring at {r.position:.3f} of {r.link} is not mounted")
        for r in missing
    ]
    return broken


def mount_faults(scene: Scene, setup: Setup, clear: MountClearance | None = None) -> list[Fault]:
    """Return why real rings of ``setup`` could not be mounted; nothing for rings without bodies.

    These are the violations of ``faults`` that no other choice of rules would allow: rings without
    room or that cannot be closed, rings that touch, and boards that do not fit.
    """
    return of_mount(scene, faults(scene, setup.rings, clear)) if scene.real else []


def of_mount(scene: Scene, violations: Sequence[Fault]) -> list[Fault]:
    """Return the violations of the mount among all violations of a setup's rings."""
    return [
        violation for violation in violations if scene.real and violation.rule in (*REAL, *_BUILT)
    ]


def _deg(angle: float) -> str:
    return f"{math.degrees(angle):.1f}°"


def _too_near(
    scene: Scene, rings: Sequence[Ring], i: int, j: int, envelopes: Sequence[Envelope]
) -> str:
    """Return a message if two rings on one link are too near to each other, or "".

    The envelopes of all rings are given where rings have bodies.
    """
    length = scene.robot.mount(rings[i].link).length
    if length == 0:
        return "are on a link that takes only one ring"
    proximal, distal = sorted((i, j), key=lambda k: rings[k].position)
    apart = (rings[distal].position - rings[proximal].position) * length
    allowed = scene.rules.spacing
    if scene.real:
        allowed = spacing(scene, envelopes[proximal], envelopes[distal])
    if apart >= allowed - _PLACE:
        return ""
    return f"are {1000 * apart:.1f} mm apart, allowed: {1000 * allowed:.1f} mm or more"


def _alone(scene: Scene, i: int, ring: Ring) -> list[Fault]:
    """Return the violations of ring ``i`` by itself."""
    limits, (least, most) = scene.limits_of(ring.link), scene.rules.sensors
    length, name, broken = scene.robot.mount(ring.link).length, f"ring {i} ({ring.link})", []
    if not limits.tilt[0] - _ANGLE <= ring.tilt <= limits.tilt[1] + _ANGLE:
        allowed = f"{_deg(limits.tilt[0])} to {_deg(limits.tilt[1])}"
        broken.append(
            Fault((i,), "tilt_deg", f"{name} is tilted by {_deg(ring.tilt)}, allowed: {allowed}")
        )
    if not least <= ring.count <= most:
        text = f"{name} has {ring.count} sensors, allowed: {least} to {most}"
        broken.append(Fault((i,), "sensors_per_ring", text))
    if text := unfit(scene, ring) or "":
        broken.append(Fault((i,), "printing", f"{name}: {text}"))
    if text := unwired(scene, ring):
        broken.append(Fault((i,), ELECTRONICS, f"{name}: {text}"))
    if length == 0:
        if any(low <= 0 <= high for low, high in limits.keep_out):
            broken.append(Fault((i,), "keep_out", f"{name} sits in a keep-out"))
        return broken
    margin = scene.rules.from_joints / length
    low, high = max(limits.position[0], margin), min(limits.position[1], 1 - margin)
    if not low - _PLACE <= ring.position <= high + _PLACE:
        text = f"{name} sits at {ring.position:.3f}, allowed: {low:.3f} to {high:.3f}"
        broken.append(Fault((i,), "position", text))
    for a, b in limits.keep_out:
        if a + _PLACE < ring.position < b - _PLACE:
            text = f"{name} sits at {ring.position:.3f}, in the keep-out {a:g} to {b:g}"
            broken.append(Fault((i,), "keep_out", text))
    return broken
