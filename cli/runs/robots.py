"""Print the built-in robots as a table."""

from rich.table import Table

from ...coverage.robots.built_in import ROBOTS
from ...coverage.robots.robot import Robot
from ...reporting.explained import Explained
from ...reporting.terminal import Terminal


def robots() -> None:
    """Print the built-in robots."""
    table = Table()
    for column in ("name", "joints", "reach, m", "links for rings", "source"):
        right = column in ("joints", "reach, m")
        table.add_column(column, justify="right" if right else "left", overflow="fold")
    for robot in ROBOTS.values():
        table.add_row(
            robot.name, str(len(robot.chain)), f"{robot.reach:g}", _mounts(robot), robot.source
        )
    Terminal().print(
        Explained(
            "Built-in robots",
            table,
            "reach: radius of V_O; links for rings: with the length in metres along which a ring"
            " can sit; source: the origin of the dimensions.",
        )
    )


def _mounts(robot: Robot) -> str:
    lengths = [(m.link, m.length * (m.usable[1] - m.usable[0])) for m in robot.mounts]
    return ", ".join(f"{link} {length:.2f}" if length > 0 else link for link, length in lengths)
