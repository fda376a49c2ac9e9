"""Panels of the help, in which options stand together."""

from cyclopts import Group

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
