"""Between the models of files and what they stand for in code."""

import math
from dataclasses import replace
from typing import Any

import numpy as np

from ...coverage.rings.ring import RING_RADIUS, Ring, Setup
from ...coverage.rings.rounding import degrees, phase_deg, position, tilt_deg
from ...coverage.robots.separation_distance import Safety
from ...coverage.sensors.board_packing import Printing
from ...coverage.sensors.boards import Board
from ...coverage.sensors.effective_range import effective
from ...coverage.sensors.sensor import Sensor
from ...coverage.targets import Shape, Target
from ...objectives.scene import Goal, Limits, Motion, Pose, Recorded, Rules, Scene
from ...objectives.trajectory import Thinning
from ..schema.mount_models import (
    BoardModel,
    MountModel,
    PrintingModel,
    RingModel,
    RulesModel,
    SensorModel,
)
from ..schema.robot_convert import robot_model, robot_of
from ..schema.scene_models import (
    CurveModel,
    MotionModel,
    PoseModel,
    RecordedModel,
    SafetyModel,
    SceneFile,
    TargetModel,
    TrajectoryModel,
)
from .obstacles import obstacle_models, obstacles_of


def sensor_of(model: SensorModel) -> Sensor:
    """The sensor that a file describes."""
    own = None if model.board is None else board_of(model.board)
    if model.use is not None:
        found = effective(model.use).sensor
        return replace(found, board=own or found.board)
    up = None if model.fov_up_deg is None else math.radians(model.fov_up_deg)
    return Sensor(math.radians(model.fov_deg), model.range_m, None, up, model.zones, own)


def board_of(model: BoardModel) -> Board:
    """The board that a file describes."""
    holes = tuple((x, y) for x, y in model.holes)
    lens = (model.lens[0], model.lens[1])
    return Board(
        model.width,
        model.height,
        model.thickness,
        lens,
        model.lens_height,
        holes,
        model.hole,
        model.source,
    )


def board_model(board: Board) -> BoardModel:
    """The same as a file holds it."""
    points = {"lens": list(board.lens), "holes": [list(at) for at in board.holes]}
    return BoardModel(**(vars(board) | points))


def printing_of(model: PrintingModel) -> Printing:
    """How rings are printed."""
    return Printing(
        **(model.model_dump() | {"bolt": int(model.bolt[1:]) / 1000, "nut": model.nut == "trap"})
    )


def printing_model(printing: Printing) -> PrintingModel:
    """The same as a file holds it."""
    words: dict[str, Any] = {
        "bolt": f"M{1000 * printing.bolt:.0f}",
        "nut": "trap" if printing.nut else "through",
    }
    return PrintingModel(**(vars(printing) | words))


def sensor_model(sensor: Sensor) -> SensorModel:
    """A sensor as a file holds it: of a model of the catalogue both the use and the beam that
    follows.
    """
    beam: dict[str, Any] = {"fov_deg": degrees(sensor.fov), "range_m": sensor.range_m}
    if sensor.fov_up is not None:
        beam |= {"fov_up_deg": degrees(sensor.fov_up), "zones": sensor.zones}
    u = sensor.use
    if sensor.board != (None if u is None else effective(u).sensor.board):
        beam["board"] = None if sensor.board is None else board_model(sensor.board)
    if u is None:
        return SensorModel(**beam)
    size = None if u.size is None else list(u.size)
    return SensorModel(
        model=u.model, ambient=u.ambient, reflectance=u.reflectance, target_size=size, **beam
    )


def scene_of(model: SceneFile) -> Scene:
    """The scene that a file describes."""
    return Scene(
        robot=robot_of(model.robot),
        poses=tuple(Pose(np.radians(p.q_deg), p.weight, p.time_s, _rate(p)) for p in model.poses),
        goals=tuple(
            Goal(Target(t.name, t.radius), t.weight, t.at_least / 100) for t in model.targets
        ),
        sensor=sensor_of(model.sensor),
        ring_radius=model.ring_radius or RING_RADIUS,
        radius_stated=model.ring_radius is not None,
        shape=Shape(**model.curve.model_dump()),
        limits={
            link: Limits(
                (m.position[0], m.position[1]),
                (math.radians(m.tilt_deg[0]), math.radians(m.tilt_deg[1])),
                tuple((low, high) for low, high in m.keep_out),
                sensor_of(m.sensor) if m.sensor else None,
                m.ring_radius,
            )
            for link, m in model.mounts.items()
        },
        rules=Rules(
            model.rules.spacing,
            model.rules.from_joints,
            (model.rules.sensors_per_ring[0], model.rules.sensors_per_ring[1]),
            model.rules.rings_per_link,
            model.rules.shared_tilt,
            setup_of(model.fixed, sensor_of(model.sensor), model.ring_radius or RING_RADIUS).rings,
            model.rules.mount,
            model.rules.standoff,
            (model.rules.ring_thickness, model.rules.ring_width),
        ),
        over_poses=model.over_poses,
        recorded=_recorded(model.recorded),
        occlusion=model.occlusion,
        obstacles=obstacles_of(model.obstacles),
        motion=motion_of(model.motion),
        printing=printing_of(model.printing),
        safety=Safety(
            model.safety.human_speed,
            model.safety.reaction_s,
            model.safety.stopping_s,
            model.safety.intrusion_m,
            model.safety.sensor_uncertainty_m,
            model.safety.robot_uncertainty_m,
            model.safety.robot_speed,
        ),
    )


def _rate(pose: PoseModel) -> Any:
    return None if pose.rate_deg_s is None else np.radians(pose.rate_deg_s)


_MOTION = ("near_share", "failed_share", "frozen_frames", "cell_complete", "rings_as_proposed")


def motion_of(model: MotionModel) -> Motion:
    """How a real robot may be moved."""
    speed, acceleration = math.radians(model.speed_deg_s), math.radians(model.acceleration_deg_s2)
    same = {key: getattr(model, key) for key in _MOTION}
    return Motion(speed, acceleration, model.near_m, model.self_m, model.cell_m, **same)


def motion_model(motion: Motion) -> MotionModel:
    """The same as a file holds it."""
    return MotionModel(
        speed_deg_s=degrees(motion.speed),
        acceleration_deg_s2=degrees(motion.acceleration),
        near_m=motion.near,
        self_m=motion.own,
        cell_m=motion.cell,
        **{key: getattr(motion, key) for key in _MOTION},
    )


def safety_model(safety: Safety) -> SafetyModel:
    """What protective distances are made of, as a file says it."""
    return SafetyModel(
        human_speed=safety.human,
        reaction_s=safety.reaction,
        stopping_s=safety.stopping,
        intrusion_m=safety.intrusion,
        sensor_uncertainty_m=safety.sensor,
        robot_uncertainty_m=safety.robot,
        robot_speed=safety.speed,
    )


def _recorded(model: RecordedModel | None) -> Recorded | None:
    if model is None:
        return None
    return Recorded(
        model.file, model.rows, model.seconds, math.radians(model.within_deg), model.speed_weight
    )


def recorded_model(found: Recorded | None) -> RecordedModel | None:
    """Where the poses come from, as a file says it."""
    if found is None:
        return None
    within = degrees(found.within)
    return RecordedModel(
        file=found.file,
        rows=found.rows,
        seconds=found.seconds,
        within_deg=within,
        speed_weight=found.speed_weight,
    )


def thinning(model: TrajectoryModel) -> Thinning:
    """How the record that a scene names becomes poses."""
    return Thinning(model.poses, math.radians(model.within_deg), model.speed_weight)


def scene_model(scene: Scene) -> SceneFile:
    """The file that describes a scene."""
    return SceneFile(
        robot=robot_model(scene.robot),
        ring_radius=scene.ring_radius
        if scene.radius_stated or scene.ring_radius != RING_RADIUS
        else None,
        sensor=sensor_model(scene.sensor),
        curve=CurveModel(**vars(scene.shape)),
        mounts={
            link: MountModel(
                position=list(m.position),
                tilt_deg=[degrees(t) for t in m.tilt],
                keep_out=[list(k) for k in m.keep_out],
                sensor=None if m.sensor is None else sensor_model(m.sensor),
                ring_radius=m.radius,
            )
            for link, m in scene.limits.items()
        },
        poses=[
            PoseModel(
                q_deg=[degrees(a) for a in p.q],
                weight=p.weight,
                time_s=p.time_s,
                rate_deg_s=None if p.rate is None else [degrees(a) for a in p.rate],
            )
            for p in scene.poses
        ],
        recorded=recorded_model(scene.recorded),
        over_poses=scene.over_poses,
        safety=safety_model(scene.safety),
        motion=motion_model(scene.motion),
        printing=printing_model(scene.printing),
        targets=[_target_model(goal) for goal in scene.goals],
        rules=RulesModel(
            spacing=scene.rules.spacing,
            from_joints=scene.rules.from_joints,
            sensors_per_ring=list(scene.rules.sensors),
            rings_per_link=scene.rules.rings_per_link,
            shared_tilt=scene.rules.shared_tilt,
            mount=scene.rules.mount,
            standoff=scene.rules.standoff,
            ring_thickness=scene.rules.band[0],
            ring_width=scene.rules.band[1],
        ),
        fixed=ring_models(Setup(scene.rules.fixed), scene.sensor),
        occlusion=scene.occlusion,
        obstacles=obstacle_models(scene.obstacles),
    )


def _target_model(goal: Goal) -> TargetModel:
    name: Any = goal.target.name
    return TargetModel(
        name=name,
        radius=goal.target.radius,
        weight=goal.weight,
        at_least=round(100 * goal.at_least, 9),
    )


def setup_of(rings: list[RingModel], sensor: Sensor, radius: float = RING_RADIUS) -> Setup:
    """The setup that a proposal's rings make; a ring that names no sensor or radius has the
    scene's.
    """
    return Setup(
        tuple(
            Ring(
                link=r.link,
                position=r.position,
                count=r.count,
                tilt=math.radians(r.tilt_deg),
                phase=math.radians(r.phase_deg),
                radius=radius if r.radius is None else r.radius,
                sensor=sensor_of(r.sensor) if r.sensor else sensor,
            )
            for r in rings
        )
    )


def ring_models(setup: Setup, sensor: Sensor) -> list[RingModel]:
    """The rings of a setup as a proposal lists them, rounded as files are; ``sensor`` is the
    scene's.
    """
    return [
        RingModel(
            link=r.link,
            position=position(r),
            count=r.count,
            tilt_deg=tilt_deg(r.tilt),
            phase_deg=phase_deg(r.phase),
            radius=r.radius,
            sensor=None if r.sensor == sensor else sensor_model(r.sensor),
        )
        for r in setup.rings
    ]
