"""Section of a report on cables: the bus on each ring, the cable to the base, and the slip at each
joint.
"""

import math
from collections.abc import Iterator, Sequence

from ...coverage.electronics.bus_load import CABLE_PF_M, MOST_PF, RISE_NS
from ...coverage.rings.ring import Group, Setup
from ...formats.firmware.cabling import USB_M, JointCrossing, cable_run, crossings
from ...formats.firmware.power_plan import POWER_HEADS, PowerPlan, power_plan, power_rows
from ...formats.firmware.wiring import RingWiring, plan_ring
from ...objectives.scene import Scene
from ..pages import escaped, table
from .directions import plain

_HEADS = (
    *("ring", "link", "I2C", "clock, kHz", "rate, Hz", "busy, %", "cable on the ring, m"),
    *("load, pF", "rise, ns", "joints to the base", "cable to the base, m"),
)


def bus_cable(wiring: RingWiring) -> float:
    """Return the length of four-wire cable on a ring, m."""
    trunk = wiring.bus.segments[0].cable_m
    if not wiring.channels:
        return trunk
    return trunk + wiring.count * wiring.bus.segments[1].cable_m


def wirings(scene: Scene, setup: Setup) -> tuple[list[RingWiring | None], list[str]]:
    """Return the wiring of each ring and single sensor, None where no bus bears it, and why."""
    planned, reasons = list[RingWiring | None](), list[str]()
    for i, group in enumerate(setup.groups):
        try:
            planned.append(plan_ring(f"ring {i}", group, scene.electronics))
        except ValueError as error:
            planned.append(None)
            reasons.append(f"{escaped(str(error))}.")
    return planned, reasons


def arm_power(scene: Scene, setup: Setup) -> PowerPlan | None:
    """Return the power plan of a setup; None if a ring has no wiring."""
    planned = [one for one in wirings(scene, setup)[0] if one is not None]
    return power_plan(scene, setup, planned) if len(planned) == len(setup.groups) else None


def cable_section(scene: Scene, setup: Setup) -> Iterator[str]:
    """Yield the section's paragraphs and tables, as Markdown."""
    yield "## Cables and buses\n"
    planned, reasons = wirings(scene, setup)
    runs = [cable_run(scene, group) for group in setup.groups]
    yield (
        "Each ring has its own controller board, so I2C stays on the ring: at"
        f" {CABLE_PF_M:.0f} pF a metre, the {MOST_PF:.0f} pF that the bus may carry are"
        f" {MOST_PF / CABLE_PF_M:.0f} m of bare cable, without any sensor. The readings of a"
        " ring go to the base over one USB 2.0 cable along the arm, which feeds its controller, of"
        f" at most {USB_M:g} m. None of these sensors needs SPI.\n"
    )
    yield table(
        _HEADS,
        [
            _row(i, group, wiring, run.joints, f"{run.length:.1f}{'' if run.usb else ' (hub)'}")
            for i, (group, wiring, run) in enumerate(zip(setup.groups, planned, runs, strict=True))
        ],
        right=(0, 3, 4, 5, 6, 7, 8, 9, 10),
    )
    limits = " and ".join(f"{ns:.0f} ns at {hz // 1000} kHz" for hz, ns in RISE_NS.items())
    yield (
        f"The load is that of the busiest line, at most {MOST_PF:.0f} pF; a line may rise for"
        f" {limits} (UM10204). The cable"
        " to the base is the straight way along the links and a tenth more, the loops of the next"
        " table, and 0.3 m for the ends. With a USB hub on a link, its rings share one cable.\n"
    )
    if not all(run.usb for run in runs):
        yield f"Cables longer than {USB_M:g} m are marked: they need a USB hub on the way.\n"
    for line in reasons:
        yield f"{line}\n"
    if any(group.sensor.use is None for group in setup.groups):
        yield (
            "A sensor that names no model has no electrical data: its wiring is that of a VL53L1X,"
            " and the search does not limit how many of it a ring carries.\n"
        )
    plan = arm_power(scene, setup)
    if plan is not None:
        yield f"**Power.** {plan.sentence}.\n"
        rows = [(plain(title), *cells) for title, *cells in power_rows(plan)]
        yield table(POWER_HEADS, rows, right=(1, 2, 3, 4, 5))
    crossed = crossings(scene)[: max((run.joints for run in runs), default=0)]
    if crossed:
        yield from _slips(scene, crossed)


def _row(
    number: int, group: Group, wiring: RingWiring | None, joints: int, length: str
) -> tuple[str, ...]:
    """Return a row of the table of rings."""
    if wiring is None:
        return (str(number), plain(group.link), "none", *["–"] * 6, str(joints), length)
    worst = max(wiring.bus.segments, key=lambda segment: segment.line.load_pf)
    way = f"{len(wiring.channels)} TCA9548A" if wiring.channels else "direct"
    return (
        str(number),
        plain(group.link),
        way,
        f"{wiring.bus.hertz // 1000}",
        f"{wiring.rate_hz}",
        f"{100 * wiring.bus.busy:.0f}",
        f"{bus_cable(wiring):.1f}",
        f"{worst.line.load_pf:.0f}",
        f"{max(segment.line.rise_ns for segment in wiring.bus.segments):.0f}",
        str(joints),
        length,
    )


def _slips(scene: Scene, crossed: Sequence[JointCrossing]) -> Iterator[str]:
    """Yield the table of joints."""
    rows = []
    for joint in crossed:
        motion = f"{joint.motion:.2f} m" if joint.slides else f"{math.degrees(joint.motion):.0f}°"
        radius = "–" if joint.slides else f"{1000 * joint.radius:.0f}"
        rows.append(
            (
                plain(joint.joint),
                motion,
                radius,
                f"{1000 * joint.slip:.0f}",
                f"{1000 * joint.loop:.0f}",
            )
        )
    heads = ("joint", "motion", "cable from the axis, mm", "slip, mm", "loop to leave, mm")
    over = (
        "over the poses of the scene"
        if len(scene.poses) > 1
        else "of its limits, at most one turn, because the scene has one pose; state the motion"
        " with `--trajectory`"
    )
    yield (
        "Cables slip across a joint by its motion times their distance from its axis. The motion"
        f" is that {over}.\n"
    )
    yield table(heads, rows, right=(1, 2, 3, 4))
