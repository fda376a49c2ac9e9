"""Section of a report on the firing schedule: which sensors may fire together, and the rates."""

from collections.abc import Iterator

from ...objectives.firing.schedule import FiringSchedule
from ..firing_text import COLUMNS, firing_lines, ring_heads, ring_row
from ..pages import escaped, table

FIRING = "firing.png"


def firing_section(schedule: FiringSchedule) -> Iterator[str]:
    """Yield the section's paragraphs, table and picture, as Markdown."""
    yield "## Who fires when\n"
    yield (
        "Two sensors whose light reaches the same place may both lose their target. Here no two of"
        " them range at the same time. This is slower than all at once, and only counts where the"
        " electronics keep to these slots: `place-rings export --to firmware --scheduled` writes"
        " firmware that does; without `--scheduled` sensors range at the rate of their bus.\n"
    )
    rows = [[escaped(cell) for cell in ring_row(ring)] for ring in schedule.rings]
    yield table(ring_heads(schedule), rows, right=(0, *range(2, 10)))
    yield f"{COLUMNS}\n"
    yield "\n".join(f"- {escaped(line)}" for line in firing_lines(schedule)) + "\n"
    yield f"![Which sensor fires when, ring by ring]({FIRING})\n"
