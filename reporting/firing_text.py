"""Text of a firing schedule: its table, its lines and its CSV."""

from collections.abc import Mapping

from ..objectives.firing.schedule import FiringSchedule, RingRate
from ..objectives.firing.slots import GUARD_S
from .explained import Explained
from .text import counted

_WAYS = {
    "direct": "one lights the other's window",
    "overlap": "beams overlap, or one lights the other's window",
    "reflection": "beams overlap, also by one reflection on a body",
}

COLUMNS = (
    "group: rings that share slots; slots: those in which the ring's sensors fire; ranging and"
    " transfer: of one sensor; start: loading firmware. –: not known."
)
"""Meaning of the columns of ``ring_heads``."""


def firing_rows(schedule: FiringSchedule) -> list[Mapping[str, object]]:
    """Return a row for each sensor, slot by slot, for CSV."""
    return [
        {
            "group": number,
            "slot": i,
            "start_s": f"{slot.start_s:.6f}",
            "length_s": f"{slot.seconds:.6f}",
            "ring": ring,
            "sensor": sensor,
        }
        for number, group in enumerate(schedule.groups)
        for i, slot in enumerate(group.slots)
        for ring, sensor in slot.sensors
    ]


def pairs_text(schedule: FiringSchedule) -> str:
    """Return how many pairs may disturb each other, and how."""
    number, sensors = len(schedule.pairs), schedule.sensors
    unlike = f"{schedule.unlike} left out, by wavelength or immunity; " if schedule.unlike else ""
    between = sum(p.ring != p.other_ring for p in schedule.pairs)
    return (
        f"{counted(number, 'pair')} of {sensors * (sensors - 1) // 2} may disturb each other"
        f" ({_WAYS[schedule.reach]}), {between} of them between rings; {unlike}all others"
        f" are proven apart in {counted(schedule.poses, 'pose')}"
    )


def firing_lines(schedule: FiringSchedule) -> list[str]:
    """Return lines on the schedule below its table."""
    lines = [pairs_text(schedule)]
    for number, group in enumerate(schedule.groups):
        if len(group.slots) == 1:
            continue
        excess = 100 * (group.period_s / group.bound_s - 1)
        short = (
            "as short as possible"
            if excess < 0.05
            else f"at most {excess:.1f} % longer than the best"
        )
        rings = ", ".join(map(str, group.rings))
        clock = "" if len(group.rings) == 1 else "; needs one controller, or a line for their clock"
        lines.append(
            f"group {number}, rings {rings}: {len(group.slots)} slots,"
            f" {1000 * group.period_s:.4g} ms, {short}{clock}"
        )
    lines.append(f"whole skin: {schedule.rate_hz:.3g} Hz, {1000 * schedule.period_s:.4g} ms")
    assumed = [str(r.ring) for r in schedule.rings if r.assumed]
    if assumed:
        lines.append(
            f"*: no source states the rate of the sensors of ring {', '.join(assumed)}: assumed"
        )
    lines += [f"ring {r.ring}: {r.fault}" for r in schedule.rings if r.fault]
    return lines + affordable_lines(schedule)


def affordable_lines(schedule: FiringSchedule) -> list[str]:
    """Return which rings keep the requested rate, and how many sensors would; nothing without
    one."""
    if (most := schedule.affordable) is None:
        return []
    kept = [str(r.ring) for r in schedule.rings if r.holds]
    rate = f"{schedule.wanted_hz:g} Hz"
    first = f"{rate}: kept by ring {', '.join(kept)}" if kept else f"{rate}: kept by no ring"
    if not most.sensors:
        period = 1000 / (schedule.wanted_hz or 1.0)
        slot = 1000 * max(r.ranging_s + GUARD_S + (r.transfer_s or 0.0) for r in schedule.rings)
        room = f"{period:.3g} ms have room for {counted(int(period / slot), 'slot')}"
        last = f"one sensor on each ring does not keep {rate} either: {room} of {slot:.3g} ms"
        return [first, last]
    if most.sensors == schedule.sensors:
        return [f"{rate}: kept by all {most.sensors} sensors"]
    counts = ", ".join(map(str, most.counts))
    return [first, f"{most.sensors} sensors keep {rate}, on the rings {counts}"]


def ring_heads(schedule: FiringSchedule) -> list[str]:
    """Return the heads of the cells of ``ring_row``."""
    heads = ["ring", "link", "sensors", "group", "slots", "ranging ms", "transfer ms", "start s"]
    return [*heads, "Hz", *(["holds"] if schedule.wanted_hz else [])]


def ring_row(r: RingRate) -> list[str]:
    """Return the times and the rate of a ring."""
    holds = [] if r.holds is None else ["yes" if r.holds else "no"]
    return [
        *(str(r.ring), r.link, str(r.sensors), str(r.group), str(r.slots)),
        f"{1000 * r.ranging_s:.3g}" + "*" * r.assumed,
        "–" if r.transfer_s is None else f"{1000 * r.transfer_s:.3g}",
        "–" if r.start_s is None else f"{r.start_s:.3g}",
        f"{r.rate_hz:.3g}",
        *holds,
    ]


def firing_table(schedule: FiringSchedule) -> Explained:
    """Return a table of rings with times and rates."""
    title = f"{counted(len(schedule.rings), 'ring')}, {counted(schedule.sensors, 'sensor')}"
    rows = map(ring_row, schedule.rings)
    return Explained.of(title, ring_heads(schedule), rows, COLUMNS, left=("link",))
