"""Choices that the paper does not state, and their effect on coverage."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ...coverage.rings.ring import RING_RADIUS, named_setup
from ...coverage.sensors.sensor import PAPER_SENSOR
from ...coverage.targets.named import ReachAndToolSpheres
from ..engine.scenes import Rings, ring_keys
from .coverage_cells import COUNTS, FAR, NEAR, CoverageRow, Question, question, scene

SETUPS = ("n1_16_0", "n2_16_25", "n2_16_55", "n3_16_55")
TARGETS = (NEAR, FAR, ReachAndToolSpheres())
AS_CHOSEN = "as chosen"
POSES_DEG = {
    "reference scene": (0.0, -45.0, 60.0, -105.0, -90.0, 0.0),
    "stretched": (0.0, -25.0, 25.0, -90.0, -90.0, 0.0),
    "folded": (0.0, -80.0, 120.0, -130.0, -90.0, 0.0),
    "upright": (0.0, -90.0, 0.0, -90.0, 0.0, 0.0),
}


@dataclass(frozen=True)
class Variant:
    """One choice made differently."""

    name: str
    """Name of the variant."""
    keys: dict[str, Any] = field(default_factory=dict)
    """Changed keys of the scene."""
    rings: dict[str, float] = field(default_factory=dict)
    """Changed arguments of ``rings``."""
    voxels: float = 1.0
    """Factor on the side of the voxels."""


def rings(
    name: str, radius: float = RING_RADIUS, phase_deg: float = 0.0, inset: float = 0.0
) -> Rings:
    """Return the paper's setup with other rings.

    Args:
        name: name of the setup.
        radius: radius of the rings, m.
        phase_deg: phase of the rings, degrees.
        inset: distance of the end rings from the ends of the link, as a share of the link.
    """
    setup = named_setup(name, radius=radius)
    moved = [
        replace(
            r,
            phase=np.radians(phase_deg),
            position=min(max(r.position, inset), 1 - inset) if r.link != "tool" else 0.0,
        )
        for r in setup.rings
    ]
    return ring_keys(replace(setup, rings=tuple(moved)), PAPER_SENSOR)


def variants() -> list[Variant]:
    """Return each choice varied on its own, after the chosen values."""
    return [
        Variant(AS_CHOSEN),
        Variant("chain: ur10_dh", {"robot": "ur10_dh"}),
        *(
            Variant(f"pose: {name}", {"poses": [{"q_deg": list(q)}]})
            for name, q in POSES_DEG.items()
        ),
        *(Variant(f"ring radius: {100 * r:g} cm", rings={"radius": r}) for r in (0.06, 0.10, 0.12)),
        *(Variant(f"phase: {p:g}°", rings={"phase_deg": p}) for p in (5.625, 11.25)),
        *(Variant(f"end rings inward: {100 * i:g} %", rings={"inset": i}) for i in (0.05, 0.1)),
        *(Variant(f"blend: {b:g}", {"curve": {"blend": b}}) for b in (0.2, 1.0)),
        *(Variant(f"points per bend: {n}", {"curve": {"points_per_bend": n}}) for n in (5, 60)),
        *(Variant(f"voxel: {f:g} times", voxels=f) for f in (0.5, 2.0)),
    ]


def openness() -> list[Question]:
    """Return the sensitivity study: ζ of some setups under every variant."""
    found = []
    for variant in variants():
        where = scene(variant.keys.get("robot", "ur10")) | variant.keys
        for rule, voxel in COUNTS:
            for target in TARGETS:
                for name in SETUPS:
                    row = CoverageRow(
                        "open",
                        where["robot"],
                        variant.name,
                        0.0,
                        name,
                        str(target),
                        rule,
                        voxel * variant.voxels,
                    )
                    found.append(question(row, where, rings(name, **variant.rings), target))
    return found
