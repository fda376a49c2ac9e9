"""Options that several commands share, one by one."""

from pathlib import Path
from typing import Annotated

from cyclopts import Group, Parameter

from ...reporting.options import WHOLE as WHOLE

ARGUMENTS = Group("Arguments", sort_key=0)
COMMANDS = Group("Commands", sort_key=1)
SCENE = Group("Scene and targets", sort_key=2)
OPTIONS = Group("Options", sort_key=3)
FAILURES = Group("Failures and mounting errors", sort_key=4)
SENSOR = Group("Sensor", sort_key=5)
MOTION = Group("Recorded motion", sort_key=6)
FRAMES = Group("Sensors from a file", sort_key=7)
READING = Group("Robot from a URDF", sort_key=8)
RIG_FILES = Group("Check from files", sort_key=9)


_OPTIONS = {
    "folder": "--out",
    "layouts": "--layout",
    "over_poses": "--worst",
    "safety": "[safety] of the scene",
    "targets": "--target",
}


def option_of(argument: str) -> str:
    """Return the option that sets an argument of the API."""
    return _OPTIONS.get(argument, f"--{argument.replace('_', '-')}")


Targets = Annotated[
    tuple[str, ...],
    Parameter(
        name="--target",
        group=SCENE,
        negative=(),
        help=(
            "Volume to cover: NAME[:RADIUS][=WEIGHT], for example V_N:0.3=0.6. V_N: everything"
            " within RADIUS metres of the robot's bodies. V_S: the paper's shell, discs of RADIUS"
            " metres across the arm's centre line, cut flat at the tool. V_O: the robot's reach."
            " V_T: 1.5 m around the tool. V_OT: V_O and V_T together. V_P: the protective volume of"
            " ISO 10218-2:2025 (form of ISO/TS 15066). FILE.toml[=WEIGHT]: a volume of your own."
            " Repeatable. Default: the targets of the scene (reference scene: V_S:0.5)."
        ),
    ),
]
Radius = Annotated[
    float | None,
    Parameter(
        group=SCENE,
        help=(
            "Radius in metres of a --target V_N or V_S without one: --target V_N --radius 0.3 is"
            " --target V_N:0.3."
        ),
    ),
]
SceneFileOption = Annotated[
    Path | None,
    Parameter(
        name="--scene",
        group=SCENE,
        help=(
            "Scene file (TOML): robot, poses, sensor, targets, obstacles and rules. Default: the"
            " scene in the proposal, or the reference scene (a UR10 in one pose)."
        ),
    ),
]
RobotOption = Annotated[
    str | None,
    Parameter(
        group=SCENE,
        help=(
            "Built-in robot (see place-rings robots), robot file (.toml), URDF (.urdf), xacro"
            " (.xacro), MJCF (.xml), or a name of robot_descriptions such as ur5e_description."
            " Default: the robot of the scene."
        ),
    ),
]
CalibrationOption = Annotated[
    Path | None,
    Parameter(
        name="--calibration",
        group=SCENE,
        help=(
            "Calibration of your own arm of Universal Robots: calibration.conf of its controller,"
            " or kinematics.yaml of its ROS description. Default: that of the scene, or the"
            " model's kinematics."
        ),
    ),
]
PaperOption = Annotated[
    bool,
    Parameter(
        name="--paper",
        group=SCENE,
        negative=(),
        help=(
            "Count as the paper does: beams pass through the robot, and rings need no room on it."
        ),
    ),
]
Json = Annotated[
    bool, Parameter(name="--json", negative=(), help="Print JSON instead of text, for scripts.")
]
Subject = Annotated[
    str,
    Parameter(
        name="PROPOSAL_OR_NAME",
        help=(
            "The setup: a proposal (.toml, or FILE.toml:NAME in a file of several), a list of"
            " sensors (.csv, .json), a URDF with sensor frames (.urdf), or a layout of the paper."
            " n2_16_25 is the layout with 2 rings on each link, 16 sensors a ring, tilted by 25°,"
            " and one ring on the tool."
        ),
    ),
]
Floors = Annotated[
    tuple[str, ...],
    Parameter(
        negative=(),
        help=(
            "Minimum coverage of a target in percent: NAME[:RADIUS]=PERCENT, for example"
            " V_S:1.5=60. Repeatable."
        ),
    ),
]
