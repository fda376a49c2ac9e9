"""Mounting position of each ring, measured from a joint along the link's mount axis."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...coverage.rings.ring import Ring, Setup
from ...coverage.rings.ring_kinematics import sensor_cones
from ...coverage.robots.joint_values import joint_text
from ...objectives.robustness import RingSensitivity
from ...objectives.scene import Scene
from ..pages import escaped, table
from .directions import axis_name, bearing, heading, plain
from .mounting_drawing import drawing_name, ringed_links

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


def seat_list(scene: Scene, setup: Setup) -> list[MountPlace]:
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


def mounting(scene: Scene, setup: Setup, sensitivity: Sequence[RingSensitivity]) -> list[str]:
    """Return the mounting tables of rings and single sensors, with their explanations, as lines of
    Markdown.

    Args:
        scene: the scene.
        setup: the setup.
        sensitivity: what errors of each ring cost.
    """
    rings = [*_rings(scene, setup), *_costs(sensitivity)] if setup.rings else []
    return rings + (_singles(setup) if setup.singles else [])


def _costs(sensitivity: Sequence[RingSensitivity]) -> list[str]:
    """Return the table of what errors of each ring cost, as lines of Markdown."""
    rows = [
        (str(i), plain(one.link), f"{100 * one.per_mm:.3f}", f"{100 * one.per_degree:.3f}")
        for i, one in enumerate(sensitivity)
    ]
    most = max(range(len(rows)), key=lambda i: sensitivity[i].per_mm + sensitivity[i].per_degree)
    return [
        (
            "Coverage that is lost where a ring is mounted off its place along the link, or is off"
            " in tilt or phase, in percentage points by mm and by degree. Mount ring"
            f" {most} most carefully."
        ),
        "",
        table(("ring", "link", "points by mm", "points by degree"), rows, right=(0, 2, 3)),
        "",
    ]


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


def _rings(scene: Scene, setup: Setup) -> list[str]:
    """Return the table of rings, its explanation and the drawings as lines of Markdown."""
    rows, origins = [], dict[str, str]()
    for i, s in enumerate(seat_list(scene, setup)):
        r, m = s.ring, scene.robot.mount(s.ring.link)
        phase = round(math.degrees(r.phase), 2) % 360
        lengths = (1000 * v * m.length for v in (r.position, 1 - r.position))
        where = [f"{v:.1f}" for v in (*lengths, 1000 * s.along)] if m.length > 0 else ["–"] * 3
        angles = (360 / max(r.count, 1), math.degrees(r.tilt) + 0.0, phase)
        rows.append(
            (
                *(str(i), plain(r.link), *where, f"{1000 * r.radius:.1f}", f"{r.count}"),
                *(f"{angles[0]:.2f}", f"{angles[1]:+.2f}", f"{angles[2]:.2f}"),
            )
        )
        beside = f", {1000 * s.aside:.0f} mm beside the mount axis" if s.aside > _SHORT else ""
        fixed = "" if m.length > 0 else ", place fixed"
        zero = f", angles from {axis_name(m.zero)}"
        origins[r.link] = f"{plain(r.link)}: {plain(s.joint)}{beside}{zero}{fixed}"
    heads = (
        *("ring", "link", "from the proximal end, mm", "from the distal end, mm"),
        *("from the joint, mm", "radius, mm", "sensors", "every, °", "tilt, °"),
        "sensor 0 at, °",
    )
    return [
        table(heads, rows, right=range(2, 10)),
        (
            "Lengths run along the link's mount axis to the plane of the ring's sensors; the"
            " proximal end is the one nearer to the base. Of each link, the joint from whose origin"
            " the third length counts and the axis of the joint's frame from which angles count:"
            f" {'; '.join(origins.values())}. Radius is that of the circle of sensors. A positive"
            " tilt leans the sensors towards the distal end. Angles count right-handed about the"
            " mount axis from proximal to distal; the other sensors follow sensor 0 at equal angles"
            " in the same direction. In the drawings, the arrows of the side view are the beams,"
            " the circles are seen from the distal end, and sensor 0 is orange."
        ),
        "",
        *_first_sensors(scene, setup),
        *(
            f"![Rings on the {plain(link)} with their dimensions]({drawing_name(n)})\n"
            for n, link in enumerate(ringed_links(setup))
        ),
    ]


def _first_sensors(scene: Scene, setup: Setup) -> list[str]:
    """Return the table of the directions of all sensors 0 as lines of Markdown."""
    rows = [
        (str(i), plain(s.ring.link), heading(s.look), bearing(s.look))
        for i, s in enumerate(seat_list(scene, setup))
    ]
    pose = escaped(joint_text(scene.robot.chain, scene.poses[0].q))
    return [
        (
            f"To check the mounting, move the robot to pose 0 ({pose}). Sensor 0 of each ring then"
            " points as follows; azimuth counts from +x of the base frame towards +y, elevation"
            " from the horizontal."
        ),
        "",
        table(("ring", "link", "sensor 0 points", "exactly"), rows, right=(0,)),
    ]
