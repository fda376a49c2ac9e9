"""What a user sets on the controller before a first move: the payload, and limits of its safety
functions that bound what a check presumes.
"""

import math
from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from ...coverage.rings.ring import Setup
from ...formats.printing.payload import BOARD, PLASTIC, STEEL, Payload, payload
from ...objectives.scene import Scene
from .dry_run import DryRun, fastest
from .planned_check import ring_names

_NEAR = 1e-9  # rad; no rotation


HEADING = "Before a first move, set or check on the controller:"


def before_move(scene: Scene, setup: Setup, run: DryRun) -> list[str]:
    """Return the list of what to set and to check on the controller, a line for each.

    Args:
        scene: robot, cell and limits of the check.
        setup: the rings as proposed.
        run: the check's motion.
    """
    lines = list(_payload(payload(scene, setup), ring_names(setup)))
    if run.time[-1] > 0:  # else nothing that a limit could be taken from
        lines += _limits(scene, setup, run)
    return [*lines, *_planes(scene)]


def _payload(load: Payload, names: list[str]) -> Iterator[str]:
    known = [
        f"{name} {1000 * ring.mass:.0f} g"
        for name, ring in zip(names, load.rings, strict=False)
        if ring.mass is not None
    ]
    unknown = [n for n, ring in zip(names, load.rings, strict=False) if ring.mass is None]
    body, x = load.flange, np.round(1000 * load.flange.centre, 1) + 0.0
    if body.mass > 0:
        J = np.round(1e6 * body.inertia) + 0.0
        yield (
            f"Payload of the rings: {body.mass:.3f} kg; centre of mass ({x[0]:.1f}, {x[1]:.1f},"
            f" {x[2]:.1f}) mm in the {load.frame} frame; inertia Ixx {J[0, 0]:.0f}, Iyy"
            f" {J[1, 1]:.0f}, Izz {J[2, 2]:.0f}, Ixy {J[0, 1]:.0f}, Ixz {J[0, 2]:.0f}, Iyz"
            f" {J[1, 2]:.0f} kg mm² about it. Add your tool, your cables and the ring's controller."
        )
    elif not any(ring.at_flange and ring.mass is None for ring in load.rings):
        yield "Payload: no ring sits at the flange; set that of your tool only."
    if known:
        yield (
            f"Masses: {', '.join(known)} (solid plastic of {PLASTIC:g} kg/m³, boards of {BOARD:g}"
            f" kg/m³, bolts of {STEEL:g} kg/m³). The controller takes no payload on other links:"
            " compare with your robot's rated payload."
        )
    if unknown:
        reason = next(ring.reason for ring in load.rings if ring.mass is None)
        yield f"Weigh these rings yourself: {', '.join(unknown)}; they cannot be printed: {reason}."
    yield _tcp(load)


def _tcp(load: Payload) -> str:
    """Return the line about the TCP, with its orientation as a rotation vector."""
    place, turn = 1000 * load.T_frame_tcp[:3, 3], _rotation_vector(load.T_frame_tcp[:3, :3])
    if load.frame == "tcp":
        return "TCP: rings do not change it; the check moves by joint angles and does not use it."
    x, y, z, a, b, c = (round(v, 3) + 0.0 for v in (*place, *turn))
    return (
        f"TCP: rings do not change it. The scene's is at ({x:g}, {y:g}, {z:g}) mm, rotation vector"
        f" ({a:g}, {b:g}, {c:g}) rad; the check moves by joint angles and does not use it."
    )


def _rotation_vector(R: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, " 3"]:
    from scipy.spatial.transform import Rotation

    vector: np.ndarray = Rotation.from_matrix(R).as_rotvec()
    return np.where(np.abs(vector) < _NEAR, 0.0, vector)


def _limits(scene: Scene, setup: Setup, run: DryRun) -> Iterator[str]:
    speed = math.degrees(scene.motion.speed)
    yield (
        f"Joint speed limit of the safety functions: the check needs {speed:.0f}°/s and no joint"
        f" faster. Tool speed limit: nothing on the plan moves faster than"
        f" {fastest(scene, setup, run):.2f} m/s."
    )
    ranges = ", ".join(
        f"{name} {math.degrees(low):.0f} to {math.degrees(high):.0f}"
        for name, (low, high) in zip(scene.robot.chain.joints, run.ranges, strict=True)
    )
    yield f"Joint position limits: the plan uses, in degrees, {ranges}."


def _planes(scene: Scene) -> Iterator[str]:
    floors = [f"{o.floor:g} m" for o in scene.obstacles if o.floor is not None]
    if floors:
        yield (
            f"Safety plane: z above {', '.join(floors)} in the base frame; bodies keep"
            f" {1000 * scene.motion.cell:.0f} mm from the floor."
        )
    others = [o.name for o in scene.obstacles if o.floor is None]
    if others:
        yield (
            f"Safety planes where one can separate the robot from: {', '.join(others)}. The check"
            " knows the cell by the scene only; the controller knows it by these planes only."
        )
    yield (
        "Mounting: set it as the base really stands, since gravity acts along it. Try the near stop"
        " and the emergency stop by hand first."
    )
