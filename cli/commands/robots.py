"""The command robots."""


def robots() -> None:
    """List the robots that are built in: joints, reach, links with mounts.

    Example: place-rings robots
    """
    from ..runs.robots import robots as run

    run()
