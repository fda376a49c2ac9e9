"""Picture of a firing schedule: which sensor fires when, ring by ring."""

from pathlib import Path

from ..coverage.robots.robot import Robot
from ..formats.export.palette import CELL, link_colours
from ..objectives.firing.schedule import FiringSchedule
from .plots import INK, lying, save, sheet

_LANE, _GAP = 0.075, 0.3  # inches: of a sensor, and between two rings
_PALE = 0.35
_TALLEST, _NAMED = 40.0, 150  # inches, and most rings with a name


def firing_figure(schedule: FiringSchedule, robot: Robot, file: Path) -> None:
    """Draw the slots of one period of each group as bars over time.

    Args:
        schedule: the schedule.
        robot: the robot, whose links have colours.
        file: PNG to write.
    """
    links = list(dict.fromkeys((*robot.links, *(r.link for r in schedule.rings))))
    colour = {link: link_colours(links).get(link, CELL) for link in links}
    height = sum(_LANE * r.sensors + _GAP for r in schedule.rings)
    figure = sheet(9.5, min(height, _TALLEST) + 1.0)
    ax, top, base = figure.add_subplot(), 0.0, dict[int, float]()
    for ring in schedule.rings:
        base[ring.ring] = top
        top += _LANE * ring.sensors + _GAP
    for group in schedule.groups:
        for slot in group.slots:
            ax.axvline(1000 * slot.start_s, color="#e5e8eb", lw=0.6, zorder=0)
            for number, sensor in slot.sensors:
                ring, y = schedule.rings[number], base[number] + _LANE * sensor
                for seconds, alpha in ((slot.seconds, _PALE), (ring.ranging_s, 1.0)):
                    ax.barh(
                        y,
                        1000 * min(seconds, slot.seconds),
                        left=1000 * slot.start_s,
                        height=0.85 * _LANE,
                        color=colour[ring.link],
                        alpha=alpha,
                        lw=0,
                    )
    places = [base[r.ring] + _LANE * (r.sensors - 1) / 2 for r in schedule.rings]
    names = [f"{r.ring}: {r.link.replace('_', ' ')}\n{r.rate_hz:.3g} Hz" for r in schedule.rings]
    step = 1 + len(names) // _NAMED
    lying(ax, places[::step], names[::step], "time in one period of its group, ms")
    ax.set_ylim(top - _GAP / 2, -_GAP / 2)
    ax.set_xlim(0, 1000 * max(g.period_s for g in schedule.groups))
    title = "dark: the sensor ranges; pale: readings are transferred until the slot ends"
    ax.set_title(title, fontsize=10, loc="left", color=INK)
    save(figure, file)
