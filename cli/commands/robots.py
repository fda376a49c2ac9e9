"""The command robots."""

from ..options.common import Json


def robots(*, as_json: Json = False) -> None:
    """List the built-in robots with their joints, their reach, and the links that carry rings.

    For example:

    ```bash
    place-rings robots
    place-rings verify n2_16_25 --robot ur5e
    ```

    ``place-rings --help`` explains the terms.
    """
    import json

    from ...coverage.robots.built_in import ROBOTS
    from ...reporting.explained import Explained
    from ...reporting.terminal import Terminal, say_json

    lengths = {
        robot.name: {m.link: m.length * (m.usable[1] - m.usable[0]) for m in robot.mounts}
        for robot in ROBOTS.values()
    }
    if as_json:
        records = [
            {
                "name": robot.name,
                "joints": robot.chain.joints,
                "reach_m": robot.reach,
                "links_m": lengths[robot.name],
                "source": robot.source,
            }
            for robot in ROBOTS.values()
        ]
        say_json(json.dumps(records, indent=2))
        return
    rows = [
        (
            robot.name,
            str(len(robot.chain)),
            f"{robot.reach:g}",
            ", ".join(f"{k} {m:.2f}" if m > 0 else k for k, m in lengths[robot.name].items()),
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
