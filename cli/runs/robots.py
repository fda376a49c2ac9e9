"""The robots that are built in, as a table."""

from rich.table import Table

from ...coverage.robots.built_in import ROBOTS
from ...coverage.robots.robot import Robot
from ...reporting.terminal import Terminal


def robots() -> None:
    """Print the robots that are built in."""
    table = Table(title="Robots that are built in", title_justify="left")
    for column in ("name", "joints", "reach, m", "links with mounts (usable length, m)", "source"):
        table.add_column(column, justify="right" if column in ("joints", "reach, m") else "left")
    for robot in ROBOTS.values():
        table.add_row(
            robot.name, str(len(robot.chain)), f"{robot.reach:g}", _mounts(robot), robot.source
        )
    Terminal().print(table)


def _mounts(robot: Robot) -> str:
    lengths = [(m.link, m.length * (m.usable[1] - m.usable[0])) for m in robot.mounts]
    return ", ".join(f"{link} {length:.2f}" if length > 0 else link for link, length in lengths)
