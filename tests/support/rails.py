"""Built-in arms on a rail: the same arm, carried by a prismatic joint."""

from dataclasses import replace

import numpy as np
from place_rings.coverage.robots.built_in import ROBOTS
from place_rings.coverage.robots.kinematics import Chain
from place_rings.coverage.robots.robot import Robot

RAIL = (-1.5, 2.0)  # m, limits


def carried(robot: Robot, axis=(0.0, 1.0, 0.0)) -> Robot:
    """``robot`` with its base on the carriage of the joint ``rail``, whose axis is ``axis`` in the
    base frame; at 0 it stands where it stood.
    """
    chain, unit = robot.chain, np.asarray(axis, float) / np.linalg.norm(axis)
    limits = robot.limits
    return replace(
        robot,
        name=f"{robot.name}_on_a_rail",
        chain=Chain(
            ("rail", *chain.joints),
            np.concatenate([np.eye(4)[None], chain.origin]),
            np.concatenate([unit[None], chain.axis]),
            (0,),
        ),
        mounts=tuple(replace(m, frame=m.frame + 1) for m in robot.mounts),
        bodies=tuple(replace(b, frame=b.frame + 1) for b in robot.bodies),
        limits=None if limits is None else np.concatenate([[RAIL], limits]),
        home=np.concatenate([[0.0], robot.rest]),
        tube_links=None,
        joint_links=None,
    )


def rail_ur10() -> Robot:
    """A UR10 for real rings, on a rail."""
    return carried(ROBOTS["ur10"].with_links(True))
