"""The command cones."""

from ..options.common import RobotOption, SceneFileOption, Subject


def cones(subject: Subject, /, *, scene: SceneFileOption = None, robot: RobotOption = None) -> None:
    """Print every sensor's cone at every pose, as CSV in the base frame.

    Example: place-rings cones n2_16_25 > cones.csv
    """
    from ...formats.loader import resolve
    from ...formats.sensors.sensor_lists import sensor_list
    from ...reporting.terminal import say_lines
    from ..options.scenes import resolve_scene

    say_lines(sensor_list(*resolve(subject, resolve_scene(scene, robot))))
