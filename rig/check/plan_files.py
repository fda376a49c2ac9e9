"""Files of plans: stops of a mount check, trials of a coverage check. Lengths in metres, angles in
degrees.
"""

import math
from pathlib import Path
from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from ...coverage.definitions.definition import refuse
from ...coverage.definitions.field_types import LONGEST_NAME, Metres
from ...coverage.targets.named import named_target
from ...coverage.targets.target import named_kinds
from ...formats.schema.base_model import StrictModel
from ...formats.schema.field_types import Percent
from ...formats.schema.versions import VersionedFile
from ...formats.writing import to_toml, write_text
from ...objectives.scene import Scene
from ..mount.stop_plan import MountPlan
from ..rod.rod import Detection, Rod
from ..rod.trial_plan import RodPlan, Stratum

_Angles = Annotated[
    list[Annotated[float, Field(ge=-720, le=720, description="degrees")]],
    Field(min_length=1, max_length=20),
]
_Place = Annotated[float, Field(ge=-100, le=100, description="metres, base frame")]
_Count = Annotated[int, Field(ge=1, le=100_000)]
_Index = Annotated[int, Field(ge=0, le=100_000, description="counted from 0")]
_DIGITS = 6  # decimals


class StopModel(StrictModel):
    q_deg: _Angles


class MountPlanFile(VersionedFile):
    """Stops of the robot for a mount check, and the number of frames read at each.

    ``information`` holds for each ring the information matrix of slip, tilt, phase and offset, in
    units of 20 mm, 5°, 5° and 20 mm.
    """

    frames: _Count
    stops: list[StopModel] = Field(min_length=1, max_length=10_000)
    information: list[list[list[float]]] = Field(max_length=1000)

    @model_validator(mode="after")
    def _square(self) -> Self:
        refuse(
            (("information", i), f"{[len(row) for row in part]}", "four rows of four")
            for i, part in enumerate(self.information)
            if [len(row) for row in part] != [4] * 4
        )
        joints = len(self.stops[0].q_deg)
        refuse(
            (("stops", i, "q_deg"), len(s.q_deg), f"{joints} angles, as the first")
            for i, s in enumerate(self.stops)
            if len(s.q_deg) != joints
        )
        return self


class TrialModel(StrictModel):
    stratum: _Index
    point: Annotated[list[_Place], Field(min_length=3, max_length=3)]


class RodPlanFile(VersionedFile):
    """Points at which a test rod is placed at each pose: upright, with its centre at the point."""

    target: str = Field(max_length=2 * LONGEST_NAME)
    target_radius: Metres | None = None
    testable_percent: Percent
    rod: Rod
    detection: Detection
    poses: list[StopModel] = Field(min_length=1, max_length=10_000)
    strata: list[Stratum] = Field(min_length=1, max_length=20_000)
    trials: list[TrialModel] = Field(min_length=1, max_length=100_000)

    @model_validator(mode="after")
    def _agreeing(self) -> Self:
        try:
            if self.target in named_kinds():
                named_target(self.target, self.target_radius)
        except ValueError as error:
            refuse([(("target_radius",), self.target_radius, f"another: {error}")])
        poses, strata = len(self.poses), len(self.strata)
        refuse(
            (("strata", i, "pose"), s.pose, f"0 to {poses - 1}")
            for i, s in enumerate(self.strata)
            if s.pose >= poses
        )
        refuse(
            (("trials", i, "stratum"), t.stratum, f"0 to {strata - 1}")
            for i, t in enumerate(self.trials)
            if t.stratum >= strata
        )
        return self


def _stops(joints: np.ndarray) -> list[StopModel]:
    return [StopModel(q_deg=[round(math.degrees(a), _DIGITS) for a in q]) for q in joints]


def _joints(stops: list[StopModel]) -> np.ndarray:
    return np.radians([s.q_deg for s in stops])


def mount_plan_model(plan: MountPlan) -> MountPlanFile:
    """Convert a plan of stops to its file model."""
    return MountPlanFile(
        frames=plan.frames, stops=_stops(plan.joints), information=plan.information.tolist()
    )


def mount_plan_of(file: MountPlanFile) -> MountPlan:
    """Convert a file model to a plan of stops."""
    return MountPlan(
        _joints(file.stops), file.frames, np.array(file.information, float).reshape(-1, 4, 4)
    )


def write_mount_plan(path: Path, plan: MountPlan) -> None:
    """Write a plan of stops as TOML; raise UserError if that fails."""
    write_text(path, to_toml(mount_plan_model(plan)))


def rod_plan_model(plan: RodPlan) -> RodPlanFile:
    """Convert a plan of trials to its file model."""
    name, radius = plan.target.key
    return RodPlanFile(
        target=name,
        target_radius=radius,
        testable_percent=100 * plan.testable,
        rod=plan.rod,
        detection=plan.detection,
        poses=_stops(plan.joints),
        strata=list(plan.strata),
        trials=[
            TrialModel(stratum=int(s), point=[round(float(x), _DIGITS) for x in p])
            for s, p in zip(plan.stratum, plan.point, strict=True)
        ],
    )


def write_rod_plan(path: Path, plan: RodPlan) -> None:
    """Write a plan of trials as TOML; raise UserError if that fails."""
    write_text(path, to_toml(rod_plan_model(plan)))


def rod_plan_of(file: RodPlanFile, scene: Scene) -> RodPlan:
    """Convert a file model to a plan of trials in a target of ``scene``, or in a named one.

    Raises:
        ValueError: if neither has the target's name.
    """
    return RodPlan(
        scene.target_named(file.target, file.target_radius),
        file.rod,
        file.detection,
        _joints(file.poses),
        tuple(file.strata),
        np.array([t.stratum for t in file.trials]),
        np.array([t.point for t in file.trials]),
        file.testable_percent / 100,
    )
