"""Lines about what a ring can carry electrically, before a search."""

from ...coverage.electronics.electronics import most_on_ring, unknown_reason
from ...coverage.sensors.effective_range import model_of
from ...objectives.scene import CoreScene


def electronics_lines(scene: CoreScene) -> list[str]:
    """Return a line for each catalogue sensor of new rings that nothing limits, and one for each
    that its electronics limit to fewer sensors than the rules."""
    lines = dict[str, None]()
    for link in scene.robot.links if scene.real else ():
        sensor = scene.sensor_of(link)
        if sensor.use is None:
            continue
        name, most = model_of(sensor.use).name, scene.rules.sensors[1]
        carried = most_on_ring(scene.electronics, sensor, scene.radius_of(link))
        if reason := unknown_reason(scene.electronics, sensor):
            lines[f"Electronics do not limit the rings: {reason}."] = None
        elif carried is not None and carried < most:
            lines[f"Electronics: a ring carries at most {carried} {name}."] = None
    return list(lines)
