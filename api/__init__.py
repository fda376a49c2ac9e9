"""Place rings of Time-of-Flight sensors on a robot arm, and prove how much of the space around it
they cover.

Lengths are in metres and angles in radians, except in names that end in ``_deg``, ``_mm`` or
``_percent``. Coverage is a share in [0, 1]. Names that ``__all__`` does not list may change.

Example:
    >>> import place_rings as pr
    >>> scene = pr.Scene(robot="ur10e", targets=[pr.Shell(0.5)])
    >>> result = pr.verify("n1_8_0", scene, voxel=0.05)
    >>> 0 < result.coverage < 1
    True
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ._catalogue import robots, sensors
    from ._detection import detection_rates
    from ._errors import InputError
    from ._export import export
    from ._files import load, save
    from ._firing import FiringReport, firing_schedule
    from ._improve import improve
    from ._improvement import Improvement
    from ._lift import lift_to_surface
    from ._mesh import Mesh
    from ._proposal import Proposal
    from ._report import report
    from ._robustness import RobustnessReport, robustness
    from ._safety import SafetyReport, safety
    from ._search import search
    from ._soft import coverage_fraction, sample_points
    from ._study import StudyReport, study
    from ._trajectory import Trajectory
    from ._twin import twin
    from ._verify import Coverage, certify, verify
    from ._views import view
    from ._weight_field import weight_field
    from .coverage.detection.detection import Detection
    from .coverage.detection.pieces import TestPiece
    from .coverage.electronics.electronics import Electronics
    from .coverage.person_reach import Person
    from .coverage.rings.mounted_sensor import MountedSensor
    from .coverage.rings.ring import Ring, Setup
    from .coverage.robots.attached import Attached
    from .coverage.robots.robot import Robot
    from .coverage.robots.separation_distance import Safety
    from .coverage.robots.stop_times import StopTime
    from .coverage.sensors.sensor import Sensor
    from .coverage.targets.combined import DifferenceOf, IntersectionOf, UnionOf
    from .coverage.targets.named import (
        Near,
        ProtectiveVolume,
        ReachAndToolSpheres,
        ReachSphere,
        RobotVolume,
        Shell,
        ToolSphere,
    )
    from .coverage.targets.own import Box, Capsule, Cone, Cylinder, HalfSpace, Implicit, Sphere
    from .objectives.mount_rules import Limits, Rules
    from .objectives.obstacle import Obstacle
    from .objectives.poses import Pose
    from .objectives.prices import Prices
    from .objectives.scene import Scene
    from .placement.search.progress import Outcome, Progress
    from .placement.space.feasible_set import InfeasibleError
    from .simulation.twin.noise import Noise
    from .simulation.twin.sensor_twin import SensorTwin, TwinFrame

__all__ = [
    "Attached",
    "Box",
    "Capsule",
    "Cone",
    "Coverage",
    "Cylinder",
    "Detection",
    "DifferenceOf",
    "Electronics",
    "FiringReport",
    "HalfSpace",
    "Implicit",
    "Improvement",
    "InfeasibleError",
    "InputError",
    "IntersectionOf",
    "Limits",
    "Mesh",
    "MountedSensor",
    "Near",
    "Noise",
    "Obstacle",
    "Outcome",
    "Person",
    "Pose",
    "Prices",
    "Progress",
    "Proposal",
    "ProtectiveVolume",
    "ReachAndToolSpheres",
    "ReachSphere",
    "Ring",
    "Robot",
    "RobotVolume",
    "RobustnessReport",
    "Rules",
    "Safety",
    "SafetyReport",
    "Scene",
    "Sensor",
    "SensorTwin",
    "Setup",
    "Shell",
    "Sphere",
    "StopTime",
    "StudyReport",
    "TestPiece",
    "ToolSphere",
    "Trajectory",
    "TwinFrame",
    "UnionOf",
    "certify",
    "coverage_fraction",
    "detection_rates",
    "export",
    "firing_schedule",
    "improve",
    "lift_to_surface",
    "load",
    "report",
    "robots",
    "robustness",
    "safety",
    "sample_points",
    "save",
    "search",
    "sensors",
    "study",
    "twin",
    "verify",
    "view",
    "weight_field",
]

_MODULES = {
    "_catalogue": ("robots", "sensors"),
    "_verify": ("Coverage", "certify", "verify"),
    "_detection": ("detection_rates",),
    "_errors": ("InputError",),
    "_export": ("export",),
    "_files": ("load", "save"),
    "_firing": ("FiringReport", "firing_schedule"),
    "_improve": ("improve",),
    "_improvement": ("Improvement",),
    "_lift": ("lift_to_surface",),
    "_proposal": ("Proposal",),
    "_report": ("report",),
    "_robustness": ("RobustnessReport", "robustness"),
    "_safety": ("SafetyReport", "safety"),
    "_search": ("search",),
    "_soft": ("coverage_fraction", "sample_points"),
    "_study": ("StudyReport", "study"),
    "_mesh": ("Mesh",),
    "coverage.targets.own": (
        "Box",
        "Capsule",
        "Cone",
        "Cylinder",
        "HalfSpace",
        "Implicit",
        "Sphere",
    ),
    "coverage.targets.combined": ("DifferenceOf", "IntersectionOf", "UnionOf"),
    "_weight_field": ("weight_field",),
    "coverage.targets.named": (
        "Near",
        "ProtectiveVolume",
        "ReachAndToolSpheres",
        "ReachSphere",
        "RobotVolume",
        "Shell",
        "ToolSphere",
    ),
    "_trajectory": ("Trajectory",),
    "_twin": ("twin",),
    "_views": ("view",),
    "coverage.rings.mounted_sensor": ("MountedSensor",),
    "coverage.rings.ring": ("Ring", "Setup"),
    "coverage.robots.attached": ("Attached",),
    "coverage.robots.robot": ("Robot",),
    "coverage.robots.separation_distance": ("Safety",),
    "coverage.robots.stop_times": ("StopTime",),
    "coverage.detection.detection": ("Detection",),
    "coverage.detection.pieces": ("TestPiece",),
    "coverage.sensors.sensor": ("Sensor",),
    "coverage.electronics.electronics": ("Electronics",),
    "coverage.person_reach": ("Person",),
    "objectives.prices": ("Prices",),
    "objectives.mount_rules": ("Limits", "Rules"),
    "objectives.poses": ("Pose",),
    "objectives.obstacle": ("Obstacle",),
    "objectives.scene": ("Scene",),
    "placement.space.feasible_set": ("InfeasibleError",),
    "simulation.twin.noise": ("Noise",),
    "simulation.twin.sensor_twin": ("SensorTwin", "TwinFrame"),
    "placement.search.progress": ("Outcome", "Progress"),
}
_FORMER = {"attached": "Attached", "obstacle": "Obstacle"}
_WHERE = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> Any:
    """Load a public name on its first use; ``import place_rings`` alone loads none."""
    if name == "__version__":
        from importlib.metadata import version

        value: Any = version("place-rings")
    elif name in _FORMER:
        import warnings

        warnings.warn(f"{name} is now called {_FORMER[name]}", DeprecationWarning, stacklevel=2)
        return __getattr__(_FORMER[name])
    elif name in _WHERE:
        value = getattr(import_module(f".{_WHERE[name]}", __name__), name)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
