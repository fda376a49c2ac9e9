"""OpenUSD: the robot as an articulation that physics can move, with its rings and sensors, and the
cell, for Isaac Sim, Isaac Lab and other programs."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...coverage.robots.robot import BASE
from ...coverage.sensors.effective_range import model_of
from ...objectives.feasibility.ring_envelopes import envelope
from ..optional_dependencies import require
from ..robots.urdf_matching import plain_names
from ..sensors.sensor_frames import SensorFrame
from .palette import OBSTACLE, ROBOT
from .placed import BASE_LINK, TCP_LINK, PlacedSetup
from .ring_bodies import ring_bodies
from .scene_parts import node_names, scene_parts
from .usd_prims import (
    add_capsule,
    add_collision,
    add_frame,
    add_joint,
    add_mass,
    add_mesh,
    state,
)

_CELL, _JOINTS = "cell", "joints"
_FLOOR = 10.0  # m, displayed side of the floor, which has no end
_LEAST = 0.001, np.zeros(3), 1e-6 * np.eye(3)  # kg, m, kg m², of a link without a body
_APERTURE = 20.955  # width of a camera's picture in the unit of its focal length
_BAND = 0.005  # m, beyond the tube that shows a ring
_TURNED = np.diag([-1.0, 1.0, -1.0, 1.0])  # a camera looks along -z


def usd(placed: PlacedSetup) -> dict[str, bytes]:
    """Return ``scene.usda``, in metres, with z up: the robot at the pose, which is the default
    prim, and ``/cell``. Sensors look along z, with ``up`` along y.

    Raises:
        UserError: if usd-core is missing, or the user's URDF lacks the robot's chain.
    """
    require("usd", "--to usd", "pxr")
    from pxr import Sdf, Usd, UsdGeom, UsdPhysics

    stage = Usd.Stage.CreateInMemory("scene.usda")
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdPhysics.SetStageKilogramsPerUnit(stage, 1.0)
    name = _prim_names([placed.robot_name], [_CELL])[0]
    links = _prim_names(node_names(placed)[:-1], [BASE_LINK, _JOINTS])
    made = _Made(placed, stage, name, (BASE_LINK, *links))
    robot = add_frame(stage, f"/{name}", placed.T_world_base)
    stage.SetDefaultPrim(robot)
    UsdPhysics.ArticulationRootAPI.Apply(robot)
    robot.AddAppliedSchema("PhysxArticulationAPI")
    collide = "physxArticulation:enabledSelfCollisions"  # capsules of neighbouring links overlap
    robot.CreateAttribute(collide, Sdf.ValueTypeNames.Bool, custom=False).Set(False)
    add_frame(stage, f"/{_CELL}", placed.T_world_base)
    _add_links(made)
    _add_joints(made)
    _add_parts(made)
    for sensor in placed.sensors:
        _add_sensor(made, sensor)
    _add_floors(made)
    return {"scene.usda": stage.GetRootLayer().ExportToString().encode()}


def _prim_names(names: Iterable[str], taken: Sequence[str]) -> tuple[str, ...]:
    """Return unique names of prims, which do not begin with a digit."""
    return plain_names((f"_{n}" if n[:1].isdigit() or not n else n for n in names), taken)


@dataclass(frozen=True)
class _Made:
    """A stage under construction."""

    placed: PlacedSetup
    """What it shows."""
    stage: Any
    """The stage of usd-core."""
    robot: str
    """Name of the robot's prim."""
    links: tuple[str, ...]
    """Names of the links: that of the base, and those that the joints move."""

    def path(self, joint: int) -> str:
        """Return the path of the link that a joint moves, or of the base's link for ``BASE``."""
        return f"/{self.robot}/{self.links[joint + 1]}"


def _add_links(made: _Made) -> None:
    """Add the links at the pose, with the robot's capsules, which are solid."""
    from pxr import Sdf, UsdGeom, UsdPhysics

    robot = made.placed.scene.robot
    for frame in range(BASE, len(robot.chain)):
        link = add_frame(made.stage, made.path(frame), made.placed.at_pose(frame))
        UsdPhysics.RigidBodyAPI.Apply(link)
        link.AddAppliedSchema("PhysxRigidBodyAPI")
        weightless = "physxRigidBody:disableGravity"  # masses are unknown
        link.CreateAttribute(weightless, Sdf.ValueTypeNames.Bool, custom=False).Set(True)
        if not any(body.frame == frame for body in robot.bodies):
            add_mass(link, *_LEAST)
    names = plain_names(f"collision_{body.name}" for body in robot.bodies)
    for body, name in zip(robot.bodies, names, strict=True):
        prim = add_capsule(made.stage, f"{made.path(body.frame)}/{name}", body.capsule, ROBOT)
        add_collision(prim)
        if made.placed.urdf is not None:  # whose meshes are shown
            UsdGeom.Imageable(prim).CreatePurposeAttr(UsdGeom.Tokens.guide)
    last, T = made.placed.in_chain(len(robot.chain), np.eye(4))
    add_frame(made.stage, f"{made.path(last)}/{TCP_LINK}", T)


def _add_joints(made: _Made) -> None:
    """Fix the base to the world, and join the links."""
    from pxr import UsdGeom, UsdPhysics

    robot, q = made.placed.scene.robot, made.placed.scene.poses[made.placed.pose].q
    joints = f"/{made.robot}/{_JOINTS}"
    UsdGeom.Scope.Define(made.stage, joints)
    taken = ["fixed_base"]
    fixed = UsdPhysics.FixedJoint.Define(made.stage, f"{joints}/{taken[0]}")
    fixed.CreateBody0Rel().SetTargets([f"/{made.robot}"])  # so that it moves with its prim
    fixed.CreateBody1Rel().SetTargets([made.path(BASE)])
    names = _prim_names(robot.chain.joints, taken)
    for j, name in enumerate(names):
        add_joint(
            made.stage,
            f"{joints}/{name}",
            (made.path(j - 1), made.path(j)),
            robot.chain.origin[j],
            robot.chain.axis[j],
            bool(robot.chain.slides[j]),
            None if robot.limits is None else robot.limits[j],
            float(q[j]),
        )


def _add_parts(made: _Made) -> None:
    """Add the meshes of the cell, of a user's robot, and of rings with their parameters."""
    from pxr import UsdGeom

    placed = made.placed
    rings = {f"ring_{i}": ring for i, ring in enumerate(placed.setup.rings)}
    bodies = {f"{body.name}_envelope": body for body in ring_bodies(placed)}
    for part in scene_parts(placed):
        if part.name.startswith("body_") and placed.urdf is None:
            continue  # these capsules are there already
        joint, T = placed.in_chain(part.frame, np.eye(4))
        holder = f"/{_CELL}" if part.colour == OBSTACLE else made.path(joint)
        mesh = part.on_frame(placed).apply_transform(T)
        prim = add_mesh(made.stage, f"{holder}/{part.name}", mesh, part.colour, part.opacity)
        if part.name.endswith("_sees"):
            UsdGeom.Imageable(prim).CreatePurposeAttr(UsdGeom.Tokens.guide)
        if part.solid:
            add_collision(prim, hull=True)
        if (body := bodies.get(part.name)) is not None and body.mass is not None:
            of_link = body.mass.moved(body.T_link_ring)
            add_mass(prim, of_link.mass, of_link.centre, of_link.inertia)
        if (group := rings.get(part.name)) is not None:
            state(
                prim,
                link=group.link,
                position=float(group.position),
                count=group.count,
                tilt_deg=math.degrees(group.tilt),
                phase_deg=math.degrees(group.phase),
                radius_m=float(group.radius),
            )


def _add_sensor(made: _Made, sensor: SensorFrame) -> None:
    """Add a sensor as a frame with its parameters, and a camera with its field of view."""
    from pxr import Gf, UsdGeom

    joint, T = made.placed.in_chain(sensor.frame, sensor.T_frame_sensor)
    unit, path = sensor.unit, f"{made.path(joint)}/{sensor.name}"
    model = None if unit.use is None else model_of(unit.use)
    prim = add_frame(made.stage, path, T)
    state(
        prim,
        model=None if model is None else model.title,
        shape=unit.shape,
        fov_deg=math.degrees(unit.fov),
        fov_up_deg=unit.fov_up and math.degrees(unit.fov_up),
        range_m=float(unit.range_m),
        near_m=float(unit.near_m),
        least_m=None if model is None else model.least_m,
        rate_hz=None if model is None else model.rate_hz,
        zones=(unit.rows, unit.zones),
    )
    if unit.outer_angle < math.pi / 2:
        camera = UsdGeom.Camera(add_frame(made.stage, f"{path}/view", _TURNED, "Camera"))
        half = unit.half_angle if unit.square else unit.outer_angle
        up = unit.half_angle_up if unit.square else half
        camera.CreateHorizontalApertureAttr(_APERTURE)
        camera.CreateVerticalApertureAttr(_APERTURE * math.tan(up) / math.tan(half))
        camera.CreateFocalLengthAttr(_APERTURE / 2 / math.tan(half))
        near = max(unit.near_m, _own_body(made.placed, sensor.ring))
        camera.CreateClippingRangeAttr(Gf.Vec2f(near, unit.range_m))


def _own_body(placed: PlacedSetup, number: int) -> float:
    """Return the distance from its apex, m, beyond which a sensor has left the body of its ring."""
    if not placed.scene.real or number >= len(placed.setup.rings):
        return _BAND
    ring = placed.setup.rings[number]
    around = envelope(placed.scene, ring)
    return math.hypot(around.outer - ring.radius, max(-around.low, around.high))


def _add_floors(made: _Made) -> None:
    """Add the floors of the cell as planes."""
    from pxr import UsdGeom

    for i, obstacle in enumerate(made.placed.scene.obstacles):
        if not np.size(obstacle.body.edges):
            plane = UsdGeom.Plane.Define(made.stage, f"/{_CELL}/obstacle_{i}")
            height = float(np.asarray(obstacle.body.offset)[0])
            plane.AddTranslateOp().Set((0.0, 0.0, height))
            plane.CreateWidthAttr(_FLOOR)
            plane.CreateLengthAttr(_FLOOR)
            add_collision(plane.GetPrim())
