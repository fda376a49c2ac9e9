"""The command cones."""

from ..options.common import PaperOption, RobotOption, SceneFileOption, Subject
from ..options.reading import AS_WRITTEN, ReadingOptions


def cones(
    subject: Subject,
    /,
    *,
    scene: SceneFileOption = None,
    robot: RobotOption = None,
    paper: PaperOption = False,
    reading: ReadingOptions = AS_WRITTEN,
) -> None:
    """Print the beam of every sensor at every pose as CSV, in the robot's base frame.

    The columns are pose, ring and sensor (counted from 0), apex and range in metres, axis, and full
    angle in degrees. Other commands read this list as a setup.

    For example:

    ```bash
    place-rings cones n2_16_25 > cones.csv
    ```

    ``place-rings --help`` explains the terms.
    """
    from ...formats.loader import resolve
    from ...formats.sensors.sensor_lists import sensor_list
    from ...reporting.terminal import say_lines
    from ..options.scenes import scene_for

    say_lines(sensor_list(*resolve(subject, scene_for(subject, scene, robot, paper, reading))))
