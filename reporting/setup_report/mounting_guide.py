"""Mounting position of each ring, measured from a joint along the link's mount axis."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...coverage.rings.ring import Ring, Setup
from ...coverage.rings.ring_kinematics import sensor_cones
from ...coverage.robots.robot import Mount
from ...objectives.scene import CoreScene
from ..pages import escaped, table
from .directions import bearing, heading, plain

TCP = "TCP"  # for a mount on the tool's frame instead of a joint's
_SHORT = 5e-4  # m, shorter offsets are not mentioned


@dataclass(frozen=True)
class MountPlace:
    """Mounting position of a ring."""

    ring: Ring
    """The ring."""
    joint: str
    """Joint whose frame carries the link."""
    along: float
    """Distance from the joint's origin to the ring's centre along the mount axis, m, distal
    positive.
    """
    aside: float
    """Distance of the mount axis from the joint's origin, m."""
    look: Float[np.ndarray, " 3"]
    """Direction of the first sensor in the base frame, in the scene's first pose."""


def seat_list(scene: CoreScene, setup: Setup) -> list[MountPlace]:
    """Return the mounting positions of a setup's rings, in their order."""
    joints, axis = (
        (*scene.robot.chain.joints, TCP),
        sensor_cones(scene.robot, setup, scene.poses[0].q).axis,
    )
    first = np.cumsum([0, *(ring.count for ring in setup.rings)])
    found = []
    for ring, k in zip(setup.rings, first, strict=False):
        m = scene.robot.mount(ring.link)
        start = float(m.start @ m.axis)
        aside = float(np.linalg.norm(m.start - start * m.axis))
        found.append(
            MountPlace(
                ring, joints[m.frame], start + ring.position * m.length, aside, np.asarray(axis[k])
            )
        )
    return found


def zero_axis(m: Mount) -> str:
    """Return the axis of the link's frame nearest to phase 0, such as ``+x``."""
    i = int(np.argmax(np.abs(m.zero)))
    return f"{'+' if m.zero[i] > 0 else '−'}{'xyz'[i]}"


def mounting(scene: CoreScene, setup: Setup) -> list[str]:
    """Return the mounting tables of rings and single sensors, with their explanations, as lines of
    Markdown."""
    rings = _rings(scene, setup) if setup.rings else []
    return rings + (_singles(setup) if setup.singles else [])


def _singles(setup: Setup) -> list[str]:
    """Return the table of single sensors and its explanation as lines of Markdown."""

    def three(values: Iterable[float], factor: float, digits: int) -> str:
        return ", ".join(f"{round(factor * v, digits) + 0.0:.{digits}f}" for v in values)

    rows = [
        (
            str(i),
            escaped(one.name),
            plain(one.link),
            three(one.position, 1000.0, 1),
            three(one.T_link_sensor[:3, 2], 1.0, 4),
            three(one.T_link_sensor[:3, 1], 1.0, 4) if one.sensor.oriented else "–",
        )
        for i, one in enumerate(setup.singles, start=len(setup.rings))
    ]
    heads = ("sensor", "name", "link", "position x, y, z, mm", "direction x, y, z", "up x, y, z")
    return [
        table(heads, rows, right=(0,)),
        (
            "Position and direction of a single sensor are those of its beam, in the frame of its"
            " link."
        ),
        "",
    ]


def _rings(scene: CoreScene, setup: Setup) -> list[str]:
    """Return the table of rings and its explanation as lines of Markdown."""
    rows, seats = [], seat_list(scene, setup)
    for i, s in enumerate(seats):
        r, m = s.ring, scene.robot.mount(s.ring.link)
        place = (
            f"{1000 * s.along:.0f} mm from {plain(s.joint)}"
            if m.length > 0
            else f"fixed, {plain(s.joint)}"
        )
        aside = (
            f", with the axis {1000 * s.aside:.0f} mm off its origin" if s.aside > _SHORT else ""
        )
        phase = round(math.degrees(r.phase), 2) % 360
        rows.append(
            (
                *(
                    str(i),
                    plain(r.link),
                    place + aside,
                    f"{r.position:.3f}" if m.length > 0 else "–",
                ),
                *(
                    f"{1000 * r.radius:.1f}",
                    f"{r.count}, every {360 / max(r.count, 1):.2f}°",
                    f"{math.degrees(r.tilt) + 0.0:+.2f}",
                ),
                f"{phase:.2f} from {zero_axis(m)}",
                f"{heading(s.look)} ({bearing(s.look)})",
            )
        )
    heads = ("ring", "link", "where", "position", "radius, mm", "sensors", "tilt, °", "phase, °")
    return [
        table((*heads, "direction of the first sensor in pose 0"), rows, right=(0, 3, 4, 6)),
        (
            "Distances run from the joint's axis along the link's mount axis to the plane of the"
            " ring's sensors, positive towards the tool. Position is the same as a share of the"
            " mount: 0 is proximal, 1 is distal. Radius is that of the circle of sensors. A"
            " positive tilt leans the sensors towards the distal end. Phase is the angle of the"
            " first sensor about the mount axis, measured from the named axis of the link's frame,"
            " right-handed from proximal to distal. The other sensors follow at equal angles in"
            " the same direction. Azimuth is measured from +x of the base frame towards +y,"
            " elevation from the horizontal."
        ),
        "",
    ]
