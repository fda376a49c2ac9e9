"""The models whose JSON Schema users may read: of files, and of what ``--json`` prints."""

from importlib import import_module
from typing import Any

# file of this folder and class; one is imported when it is asked for
MODELS = {
    "scene": ("versions", "SceneFile"),
    "robot": ("versions", "RobotFile"),
    "sensor": ("versions", "SensorFile"),
    "target": ("target_models", "TargetFile"),
    "layout": ("layout_models", "LayoutFile"),
    "proposal": ("proposal_models", "ProposalFile"),
    "verify": ("..objectives.verified", "Verified"),
    "robustness": ("..objectives.robustness", "Robustness"),
    "result": ("proposal_models", "SearchFile"),
    "improve": ("redesign_models", "ImproveResult"),
    "schedule": ("..objectives.firing.schedule", "FiringSchedule"),
    "safety": ("..simulation.safety", "SafetyResult"),
    "dossier": ("..simulation.dossier.dossier", "Dossier"),
    "facts": ("..simulation.dossier.statements", "Statements"),
    "report": ("written_models", "ReportResult"),
    "export": ("written_models", "ExportResult"),
    "sensors": (".sensors.sensor_poses", "SensorPosesFile"),
    "printing": ("print_models", "PrintResult"),
}


def model_named(name: str) -> Any:
    """Return the model or definition of a name in ``MODELS``; imports no other file than its own.

    Raises:
        KeyError: for another name.
    """
    module, model = MODELS[name]
    return getattr(import_module(f".{module}", __package__), model)
