"""The command robots."""


def robots() -> None:
    """List the built-in robots with their joints, their reach, and the links that carry rings.

    For example:

    ```bash
    place-rings robots
    place-rings verify n2_16_25 --robot ur5e
    ```

    ``place-rings --help`` explains the terms.
    """
    from ...coverage.robots.built_in import ROBOTS
    from ...reporting.explained import Explained
    from ...reporting.terminal import Terminal

    lengths = {
        robot.name: [(m.link, m.length * (m.usable[1] - m.usable[0])) for m in robot.mounts]
        for robot in ROBOTS.values()
    }
    rows = [
        (
            robot.name,
            str(len(robot.chain)),
            f"{robot.reach:g}",
            ", ".join(f"{link} {m:.2f}" if m > 0 else link for link, m in lengths[robot.name]),
            robot.source,
        )
        for robot in ROBOTS.values()
    ]
    table = Explained.of(
        "Built-in robots",
        ("name", "joints", "reach, m", "links for rings", "source"),
        rows,
        "reach: radius of V_O; links for rings: with the length in metres along which a ring can"
        " sit; source: the origin of the dimensions.",
        left=("name", "links for rings", "source"),
    )
    Terminal().print(table)
