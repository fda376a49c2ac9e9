"""Parts of a ring on the bed of a printer: as few as fit, and how each is turned."""

import math
from dataclasses import replace

import numpy as np
from manifold3d import Manifold

from ...coverage.rings.ring import Ring
from ...objectives.scene import Scene
from .print_plan import MM, PrintPlan, UnbuildableError, plan_ring
from .ring_solids import Assembly, assemble

_MOST_PARTS = 8  # of one ring
_STEP = 3.0  # degrees, between the rotations in which a part is tried
Bed = tuple[float, float, float] | None
PLATE = (0.25, 0.21, 1.0)
"""Width and depth of plates, m, where no bed is stated; a larger part lies on one of its own. The
height does not matter."""


def bed_yaw(solid: Manifold, bed: Bed) -> float | None:
    """Return the rotation about z, degrees, in which a part fits the bed with the most room.

    Returns 0 for a part that fits as it is, or without a bed; None if it does not fit.

    Args:
        solid: the part, mm.
        bed: width, depth and height that can be printed, m.
    """
    if bed is None:
        return 0.0
    x, y, z = (MM * size for size in bed)
    corners = np.asarray(solid.hull().to_mesh().vert_properties)[:, :3]
    if np.ptp(corners[:, 2]) > z:
        return None
    yaws = np.arange(0.0, 180.0, _STEP)
    c, s = np.cos(np.radians(yaws)), np.sin(np.radians(yaws))
    width = np.ptp(np.outer(c, corners[:, 0]) - np.outer(s, corners[:, 1]), axis=1)
    depth = np.ptp(np.outer(s, corners[:, 0]) + np.outer(c, corners[:, 1]), axis=1)
    room = np.minimum(x - width, y - depth)
    best = 0 if room[0] >= 0 else int(room.argmax())
    return float(yaws[best]) if room[best] >= 0 else None


def build_ring(scene: Scene, ring: Ring, number: int = 0) -> tuple[PrintPlan, Assembly]:
    """Return a ring in as few parts as fit the bed: two where it is large enough.

    Args:
        scene: the scene.
        ring: the ring.
        number: number of the ring in its setup, which it is engraved with.

    Raises:
        UnbuildableError: if it cannot be built, or no division of it fits the bed.
    """
    plan = plan_ring(scene, ring)
    bed = plan.printing.bed
    label = f"{number} {ring.link}" if plan.printing.lettering else ""
    if bed is not None and plan.lug[1] - plan.low > MM * bed[2]:
        raise UnbuildableError(
            f"it is {plan.lug[1] - plan.low:.0f} mm high; printing.bed_mm allows {MM * bed[2]:.0f}"
        )
    for parts in range(2, _MOST_PARTS + 1):
        try:
            plan = replace(plan_ring(scene, ring, parts=parts), label=label)
        except UnbuildableError:
            continue
        if bed is not None and _chord(plan) > MM * math.hypot(bed[0], bed[1]):
            continue  # without building it
        made = assemble(plan)
        if all(bed_yaw(part, bed) is not None for part in made.parts):
            return plan, made
    assert bed is not None
    raise UnbuildableError(
        f"no division of its {2 * plan.outermost:.0f} mm into at most {_MOST_PARTS} parts fits"
        f" printing.bed_mm of {MM * bed[0]:.0f} × {MM * bed[1]:.0f} mm"
    )


def _chord(plan: PrintPlan) -> float:
    """Return the largest distance, mm, between the ends of a part's band, along its bore."""
    widest = max(last - first for first, last in plan.arcs)
    return float(2 * plan.bore * math.sin(widest / 2) - MM * plan.printing.gap)
