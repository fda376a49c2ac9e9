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
    from ..runs.robots import robots as run

    run()
