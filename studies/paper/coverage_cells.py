"""Cells and rows of the paper's coverage measurements, and of the choices that it does not state.

Every ζ is counted under `centre` at 1 cm, which has no bias, and under `touch` at 10 cm, which may
be how the published numbers were counted. Both UR10 chains are used, as the paper does not state
its frames.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

import numpy as np
from jaxtyping import Float

from ...coverage.choices import Rule
from ...coverage.rings.ring import RING_RADIUS, named_setup
from ...coverage.robots.built_in import PAPER_ROBOTS, ROBOTS
from ...coverage.sensors.sensor import PAPER_SENSOR
from ...coverage.targets.named import ReachAndToolSpheres, ReachSphere, Shell, ToolSphere
from ...coverage.targets.target import Target
from ...simulation.pick_and_place import TaskMotion, fastest, pick_and_place
from ..engine.scenes import Rings, ring_keys
from ..engine.store import Cell
from ..engine.tasks import zeta_cell

SETUPS = ("n1_8_0", "n1_16_0", "n2_16_10", "n2_16_25", "n2_16_55", "n3_16_55")
THETAS = tuple(range(0, 61, 5))  # degrees, theta of n2_16_theta
RADII = (0.5, 0.7, 0.9, 1.1, 1.5)  # m, radii of the shell
SHELLS = tuple(Shell(r) for r in RADII)
NEAR, FAR = SHELLS[0], SHELLS[-1]
TARGETS = (ReachSphere(), ToolSphere(), ReachAndToolSpheres(), NEAR, FAR)
PUBLISHED = {str(NEAR): 96.73, str(FAR): 69.80}  # percent, of n3_16_55
COUNTS: tuple[tuple[Rule, float], ...] = (("centre", 0.01), ("touch", 0.1))
# sensors, and rings on each link, of 16 sensors each, that make them
BUDGETS = {48: 1, 80: 2, 112: 3}
GOALS = {"near": (NEAR,), "far": (FAR,), "both": (NEAR, FAR)}
CHAINS = PAPER_ROBOTS
ALONG = 25  # poses along one cycle of the task


@dataclass(frozen=True)
class CoverageRow:
    """One ζ."""

    table: str
    """Table of the row."""
    chain: str
    """UR10 chain."""
    variant: str
    """Variant of the open choices."""
    at: float
    """Swept value of the table: an angle in degrees or a time in s."""
    setup: str
    """Name of the setup."""
    target: str
    """Label of the target."""
    rule: str
    """Rule of the count."""
    voxel: float
    """Side of a voxel, m."""
    zeta_percent: float = float("nan")
    """ζ in percent."""


Question = tuple[CoverageRow, Cell]


@cache
def task(chain: str) -> tuple[TaskMotion, int]:
    """Return the task's motion, and its sample of the highest TCP speed."""
    robot = ROBOTS[chain]
    motion = pick_and_place(robot)
    return motion, fastest(robot, motion)


def scene(chain: str, q: Float[np.ndarray, " J"] | None = None, **keys: Any) -> dict[str, Any]:
    """Return the keys of a scene at a pose (J,) rad, by default that of the highest TCP speed."""
    motion, top = task(chain)
    angles = np.round(np.degrees(motion.q[top] if q is None else q), 6).tolist()
    return {"robot": chain, "poses": [{"q_deg": angles}], **keys}


def question(
    row: CoverageRow, where: Mapping[str, object], setup: str | Rings, target: Target
) -> Question:
    """Return a row and the cell that fills it."""
    return row, zeta_cell(where, setup, target, row.rule, row.voxel)


def searches(seed: int = 0) -> dict[str, Cell]:
    """Return the cells of the searched setups by name, such as ``both 80``, for each goal and
    budget.
    """
    cells = {}
    for goal, targets in GOALS.items():
        wanted = [{"name": t.name, "radius": t.radius, "weight": 1 / len(targets)} for t in targets]
        for sensors, rings in BUDGETS.items():
            arguments = {
                "scene": scene("ur10", targets=wanted),
                "rings_per_link": rings,
                "sensors_per_ring": 16,
                "seed": seed,
            }
            cells[f"{goal} {sensors}"] = Cell("place", arguments)
    return cells


def configurations(searched: Mapping[str, Rings]) -> list[Question]:
    """Return the rows of the paper's bar chart.

    They are its six setups on both chains, and the searched ones on the chain of their search.
    """
    return [
        question(
            CoverageRow("configurations", chain, "", 0.0, name, str(target), rule, voxel),
            scene(chain),
            setup,
            target,
        )
        for chain in CHAINS
        for rule, voxel in COUNTS
        for target in dict.fromkeys([*TARGETS, *SHELLS])
        for name, setup in (
            {n: n for n in SETUPS} | (dict(searched) if chain == "ur10" else {})
        ).items()
    ]


def tilts() -> list[Question]:
    """Return the sweeps of theta for n2_16_theta: over all targets, and over the shell's radii."""
    targets = dict.fromkeys([*TARGETS, *SHELLS])
    return [
        question(
            CoverageRow("tilts", chain, "", theta, f"n2_16_{theta}", str(target), rule, voxel),
            scene(chain),
            f"n2_16_{theta}",
            target,
        )
        for chain in CHAINS
        for rule, voxel in COUNTS
        for target in targets
        for theta in THETAS
    ]


def cycle(searched: Mapping[str, Rings]) -> list[Question]:
    """Return the rows along the cycle of a product that contains the fastest movement."""
    motion, top = task("ur10")
    starts = np.flatnonzero(np.diff(motion.swing.astype(int)) > 0)
    middle = int(np.searchsorted(starts, top)) - 1
    first, last = starts[max(middle - 1, 0)], starts[min(middle + 1, len(starts) - 1)]
    setups = {n: n for n in ("n2_16_25", "n2_16_55", "n3_16_55")} | {
        n: searched[n] for n in ("both 80", "both 112")
    }
    return [
        question(
            CoverageRow(
                "cycle",
                "ur10",
                "",
                round(float(motion.time_s[i]), 3),
                name,
                str(target),
                "centre",
                0.02,
            ),
            scene("ur10", motion.q[i]),
            setup,
            target,
        )
        for i in np.round(np.linspace(first, last, ALONG)).astype(int)
        for target in (NEAR, FAR)
        for name, setup in setups.items()
    ]


def answer(
    questions: Iterable[Question], run: Callable[[list[Cell]], list[Any]]
) -> list[CoverageRow]:
    """Return the rows with ζ; ``run`` measures cells."""
    asked = list(questions)
    results = run([cell for _, cell in asked])
    return [
        replace(row, zeta_percent=round(r["zeta_percent"], 4))
        for (row, _), r in zip(asked, results, strict=True)
    ]


OPEN_SETUPS = ("n1_16_0", "n2_16_25", "n2_16_55", "n3_16_55")
OPEN_TARGETS = (NEAR, FAR, ReachAndToolSpheres())
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
            for target in OPEN_TARGETS:
                for name in OPEN_SETUPS:
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
