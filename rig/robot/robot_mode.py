"""Mode of the robot, as its data protocol states it, and what to do where it is not running."""

from enum import IntEnum


class RobotMode(IntEnum):
    """Values of the variable robot_mode."""

    NO_CONTROLLER = -1
    DISCONNECTED = 0
    CONFIRM_SAFETY = 1
    BOOTING = 2
    POWER_OFF = 3
    POWER_ON = 4
    IDLE = 5
    BACKDRIVE = 6
    RUNNING = 7
    UPDATING_FIRMWARE = 8


_REMEDIES = {
    RobotMode.NO_CONTROLLER: "start its controller",
    RobotMode.DISCONNECTED: "connect the arm to its controller, then switch it on",
    RobotMode.CONFIRM_SAFETY: "confirm its safety configuration on the pendant",
    RobotMode.BOOTING: "wait until it has started",
    RobotMode.POWER_OFF: "switch the arm on and release the brakes",
    RobotMode.POWER_ON: "release the brakes",
    RobotMode.IDLE: "release the brakes",
    RobotMode.BACKDRIVE: "end the backdrive on the pendant",
    RobotMode.UPDATING_FIRMWARE: "wait until its firmware is updated",
}


def not_running(mode: int | None) -> str | None:
    """Return why a robot in this mode does not move, and the remedy, or None if it can; None also
    for a mode that is not known.
    """
    if mode is None or mode == RobotMode.RUNNING:
        return None
    if mode not in list(RobotMode):
        return f"robot mode {mode}: unknown, wanted: {RobotMode.RUNNING.value} (RUNNING)"
    known = RobotMode(mode)
    return f"robot mode {known.name}: {_REMEDIES[known]}"
