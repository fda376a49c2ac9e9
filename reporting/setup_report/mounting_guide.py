"""Where each ring is to be mounted, measured from a joint along the link's mount axis."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...coverage.rings.ring import Ring, Setup
from ...coverage.rings.ring_kinematics import sensor_cones
from ...coverage.robots.robot import Mount
from ...objectives.scene import Scene
from ..pages import table
from .directions import bearing, heading, plain

TCP = "TCP"  # where a mount rides on no joint's frame but on the tool's
_SHORT = 5e-4  # m, that is not worth a word


@dataclass(frozen=True)
class MountPlace:
    """A ring's place: the joint whose frame carries its link; along, m, from that joint's origin to
    the ring's centre along the mount axis, positive towards distal; aside, m, of the axis from the
    origin; look (3,): where the first sensor looks, base frame, in the scene's first pose."""

    ring: Ring
    joint: str
    along: float
    aside: float
    look: Float[np.ndarray, " 3"]


def seat_list(scene: Scene, setup: Setup) -> list[MountPlace]:
    """The seats of a setup's rings, in their order."""
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
    """The axis of the link's frame that phase 0 points along, like ``+x``; the nearest of them."""
    i = int(np.argmax(np.abs(m.zero)))
    return f"{'+' if m.zero[i] > 0 else '−'}{'xyz'[i]}"


def mounting(scene: Scene, setup: Setup) -> list[str]:
    """The table of mounting as lines of Markdown, and how to read it."""
    rows, seats = [], seat_list(scene, setup)
    for i, s in enumerate(seats):
        r, m = s.ring, scene.robot.mount(s.ring.link)
        place = (
            f"{1000 * s.along:.0f} mm from {plain(s.joint)}"
            if m.length > 0
            else f"fixed, {plain(s.joint)}"
        )
        aside = f", its axis {1000 * s.aside:.0f} mm beside it" if s.aside > _SHORT else ""
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
        table((*heads, "first sensor looks, in pose 0"), rows, right=(0, 3, 4, 6)),
        (
            "A length is measured from the joint's axis along the link's mount axis to the plane of"
            " the ring's sensors, positive towards the tool; position is the same as a share of the"
            " mount, 0 proximal to 1 distal. Radius is that of the circle of sensors. A positive"
            " tilt leans the sensors towards the distal end. Phase is the angle of the first sensor"
            " about the mount axis, from the named axis of the link's frame, right-handed from"
            " proximal to distal; the others follow the same way, evenly. Azimuth is counted from"
            " +x of the base frame towards +y, elevation from the horizontal."
        ),
        "",
    ]
