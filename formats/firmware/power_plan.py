"""Power plan of an arm: one feed from the base along the arm, a regulator for each ring that its
controller cannot feed, the gauge of the feed, and the slack of cables at the joints.

Each controller is fed over its USB cable. The feed is one pair of wires along the arm with a branch
at each ring. By Ohm's law a stretch of length L drops 2 L r I, with the resistance r per metre of
the gauge and the current I of all rings from there on.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ...coverage.electronics.bus_load import SUPPLY
from ...coverage.rings.ring import Setup
from ...objectives.scene import Scene
from .cabling import JointCrossing, cable_run, crossings
from .wiring import FEED_V, RingWiring, safe_name

_EFFICIENCY = 0.85  # of a step-down regulator at full load: an estimate
_MOST_DROP = 0.05  # of the feed's voltage, up to the farthest ring
# AWG: resistance Ω/m of solid copper at 20 °C (ASTM B258), and current A in a bundle, an estimate
_GAUGES = {
    28: (0.2129, 0.8),
    26: (0.1339, 1.3),
    24: (0.0842, 2.0),
    22: (0.0530, 3.0),
    20: (0.0333, 5.0),
    18: (0.0210, 7.0),
}
_SUPPLIES = (0.5, 1.0, 1.5, 2.5, 5.0, 10.0)  # A, of supplies at the feed's voltage as sold


@dataclass(frozen=True)
class RingPower:
    """Power of one ring or single sensor."""

    title: str
    """Number and link of the ring."""
    sensors_ma: float
    """Peak current of its sensors at 3.3 V, mA."""
    regulator_a: float | None
    """Current of its regulator, A; None if its controller feeds the sensors."""
    usb_ma: float
    """Current of its USB cable, mA: the controller, and the sensors that it feeds."""
    cable_m: float
    """Length of its cables from the base, m."""

    @property
    def feed_ma(self) -> float:
        """Current that its regulator takes from the feed, mA, rounded up."""
        on_feed = self.sensors_ma if self.regulator_a is not None else 0.0
        return math.ceil(on_feed * SUPPLY / (FEED_V * _EFFICIENCY) - 1e-9)


@dataclass(frozen=True)
class PowerPlan:
    """Supply of all rings and single sensors of a setup."""

    rings: tuple[RingPower, ...]
    """Each ring, in the order of the setup."""
    awg: int | None
    """Gauge of the feed's wires; None without a feed, or if none is thick enough."""
    loops: tuple[JointCrossing, ...]
    """Joints that cables cross, with the slack to leave at each."""

    @property
    def sensors_ma(self) -> float:
        """Peak current of all sensors at 3.3 V, mA."""
        return math.fsum(ring.sensors_ma for ring in self.rings)

    @property
    def feed_ma(self) -> float:
        """Current of the feed, mA."""
        return math.fsum(ring.feed_ma for ring in self.rings)

    @property
    def feed_m(self) -> float:
        """Length of the feed, m: up to the farthest ring with a regulator."""
        return max((r.cable_m for r in self.rings if r.regulator_a is not None), default=0.0)

    @property
    def supply_a(self) -> float | None:
        """Current of the supply at the base, A; None if none that is sold is large enough."""
        return next((a for a in _SUPPLIES if a >= 1.25 * self.feed_ma / 1000), None)

    @property
    def drop_v(self) -> float:
        """Voltage drop up to the farthest ring, V, with the plan's gauge."""
        return 0.0 if self.awg is None else _drop(self.rings, self.awg)

    @property
    def fault(self) -> str:
        """Why the rings cannot be supplied; empty if they can."""
        if self.feed_ma and self.awg is None:
            return f"no wire for {self.feed_ma / 1000:.1f} A over {self.feed_m:.1f} m"
        if self.supply_a is None:
            return f"no {FEED_V:g} V supply of {self.feed_ma / 1000:.1f} A"
        return ""

    @property
    def sentence(self) -> str:
        """The feed in one line."""
        if not self.feed_ma:
            return (
                f"{self.sensors_ma:.0f} mA at 3.3 V for all sensors; each controller feeds its own,"
                " over its USB cable"
            )
        if self.fault:
            return f"{self.sensors_ma:.0f} mA at 3.3 V for all sensors: {self.fault}"
        return (
            f"{self.sensors_ma:.0f} mA at 3.3 V for all sensors; one feed of {FEED_V:g} V with"
            f" {self.feed_ma:.0f} mA from a supply of {self.supply_a:g} A, {self.feed_m:.1f} m of"
            f" AWG {self.awg}, drop {100 * self.drop_v / FEED_V:.1f} %"
        )


def _drop(rings: Sequence[RingPower], awg: int) -> float:
    """Return the voltage drop of a feed up to its farthest ring, V."""
    fed = sorted((r for r in rings if r.feed_ma), key=lambda r: r.cable_m)
    at, drop = 0.0, 0.0
    for i, ring in enumerate(fed):
        amperes = math.fsum(r.feed_ma for r in fed[i:]) / 1000
        drop += 2 * (ring.cable_m - at) * _GAUGES[awg][0] * amperes
        at = ring.cable_m
    return drop


def power_plan(scene: Scene, setup: Setup, wirings: Sequence[RingWiring]) -> PowerPlan:
    """Return the power plan of a setup.

    Args:
        scene: its scene, with the robot and its motion.
        setup: the setup.
        wirings: wirings of all its rings and single sensors, as ``plan_setup`` returns them.
    """
    runs = [cable_run(scene, group) for group in setup.groups]
    rings = tuple(
        RingPower(
            w.title,
            w.supply_ma,
            w.regulator_a,
            w.controller.own_ma + (0.0 if w.own_supply else w.supply_ma),
            run.length,
        )
        for w, run in zip(wirings, runs, strict=True)
    )
    amperes = math.fsum(ring.feed_ma for ring in rings) / 1000
    awg = next(
        (
            gauge
            for gauge, (_, most) in _GAUGES.items()
            if amperes and amperes <= most and _drop(rings, gauge) <= _MOST_DROP * FEED_V
        ),
        None,
    )
    crossed = crossings(scene)[: max((run.joints for run in runs), default=0)]
    return PowerPlan(rings, awg, tuple(crossed))


def power_rows(plan: PowerPlan) -> list[tuple[str, ...]]:
    """Return the table of a plan as text: a row for each ring, then their sums."""
    rows = [
        (
            ring.title,
            f"{ring.sensors_ma:.0f}",
            "by its controller" if ring.regulator_a is None else f"{ring.regulator_a} A",
            f"{ring.feed_ma:.0f}",
            f"{ring.usb_ma:.0f}",
            f"{ring.cable_m:.1f}",
        )
        for ring in plan.rings
    ]
    usb = math.fsum(ring.usb_ma for ring in plan.rings)
    sums = ("all", f"{plan.sensors_ma:.0f}", "", f"{plan.feed_ma:.0f}", f"{usb:.0f}", "")
    return [*rows, sums]


POWER_HEADS = (
    "ring",
    "sensors at 3.3 V, mA",
    "regulator",
    f"feed at {FEED_V:g} V, mA",
    "USB, mA",
    "cable, m",
)


def power_page(plan: PowerPlan) -> str:
    """Return ``POWER.md``: the feed, the regulators, and the slack at the joints."""
    rows = [POWER_HEADS, ("---", *["---:"] * 5), *power_rows(plan)]
    fed = [ring for ring in plan.rings if ring.regulator_a is not None]
    lines = ["# Power of all rings", "", f"{plan.sentence}.", ""]
    lines += ["| " + " | ".join(safe_name(text) for text in row) + " |" for row in rows]
    lines += ["", "Currents are the peaks of the sensors' boards and of the controllers."]
    if fed:
        lines += [
            f"The feed is one pair of wires along the arm; at each of {len(fed)} rings it branches"
            f" to a step-down regulator, {FEED_V:g} V to 3.3 V, of at least"
            f" {100 * _EFFICIENCY:.0f} % efficiency. Connect all grounds. The drop"
            f" stays below {100 * _MOST_DROP:.0f} % of the feed.",
        ]
    lines += ["", "Leave this slack of every cable at each joint that it crosses:", ""]
    lines += ["| joint | slack, mm |", "| --- | ---: |"]
    lines += [f"| {safe_name(joint.joint)} | {1000 * joint.loop:.0f} |" for joint in plan.loops]
    return "\n".join([*lines, ""])
