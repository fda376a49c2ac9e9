"""Write a robot from a URDF, or a built-in one, as files to edit with a picture to check."""

import math
import re
from pathlib import Path

import numpy as np
import tomli_w

from ...coverage.choices import Surface
from ...coverage.definitions.errors import UserError, shown
from ...coverage.definitions.escaping import printable
from ...coverage.robots.built_in import ROBOTS
from ...coverage.robots.joint_values import from_file_units, in_file_units, joint_keys
from ...coverage.robots.robot import Robot
from ...formats.robots.descriptions import is_robot_source
from ...formats.robots.robot_fit import RobotFit, outlines
from ...formats.schema.versions import RobotFile
from ...formats.writing import output_files, to_toml, write_text
from ...objectives.feasibility.clearance import MountClearance
from ...objectives.link_segments import segments
from ...objectives.mount_rules import Rules
from ...objectives.poses import Pose
from ...objectives.scene import Scene
from ...reporting.explained import Explained
from ...reporting.robot_picture import robot_picture
from ...reporting.terminal import Terminal
from ..options.reading import ReadingOptions
from ..options.urdf_robot import import_urdf

_LIST = re.compile(r"\[\n[-+.\deE,\s]+\]")  # of numbers, over several lines
_CLEARANCE = 0.02  # m, from what a ring surrounds to its sensors
_HEADING = """A robot for place-rings. You can edit it; a scene names it by robot = "{file}".
Lengths are in metres, angles in degrees. A mount is the axis of a link around which rings sit,
from start along axis (proximal to distal), in the frame of the joint that moves the link. A body
is a capsule (a cylinder with round ends) that contains a part of the robot. The reach (radius of
V_O) of a URDF is an estimate: replace it by the value of the datasheet."""


def ring_radii(robot: Robot) -> tuple[float, dict[str, float]]:
    """Return the radius of rings on the mounts that take one, m, rounded up to the next 5 mm: there
    rings clear all sections and can be closed; and the radius of each mount that takes none.

    If no mount takes a ring, all count.
    """
    real = Scene(robot=robot, poses=(Pose(robot.rest),), rules=Rules(mount="real"))
    clear = MountClearance(real)
    own = {link: clear.radius(link) for link in robot.links}
    taking = {segment.link for segment in segments(real, clear.rooms(own, ()))} or set(own)
    around = max(
        max(m.section + _CLEARANCE, real.least_radius(m.link))
        for m in robot.mounts
        if m.link in taking
    )
    none = {
        link: max(own[link], real.least_radius(link)) for link in robot.links if link not in taking
    }
    return math.ceil(200 * around - 1e-6) / 200, none


def scene_text(robot: Robot, file: str) -> str:
    """Return a scene that names the robot's file, as TOML."""
    exact = in_file_units(robot.chain, robot.rest)
    short = [round(v, 3) + 0.0 for v in exact]
    if robot.beyond(from_file_units(robot.chain, short)) is not None:  # rounded beyond a limit
        short = exact
    joints = dict(zip(joint_keys(robot.chain), short, strict=True))
    pose = f"q_deg = [{', '.join(f'{v:.12g}' for v in short)}]\n"
    if robot.chain.prismatic:
        pose = f"[poses.q]\n{tomli_w.dumps(joints)}"
    radius, none = ring_radii(robot)
    links = ""
    for link in robot.links:
        key = tomli_w.dumps({link: 0}).removesuffix(" = 0\n")
        links += f"\n[mounts.{key}]\nposition = [0.0, 1.0]\n"
        if link in none:
            links += f"ring_radius = {none[link]:g}  # m; at this pose no ring fits here\n"
    return (
        f"# A scene on {printable(robot.name)}. Edit it, then: place-rings --scene scene.toml\n"
        f'robot = "{file}"\nring_radius = {radius:g}  # m, clear of all mounts that take a ring\n\n'
        f"[[poses]]\n{pose}"
        f"{links}"
    )


def robot(
    what: str,
    reading: ReadingOptions,
    capsules: int,
    surface: Surface,
    name: str | None,
    out: Path,
) -> None:
    """Write ``robot.toml``, ``scene.toml`` and ``robot.png`` of a built-in robot or a URDF."""
    described = is_robot_source(what)
    reading.refuse_without(what if described else None)
    if what in ROBOTS:
        fit = RobotFit(ROBOTS[what].with_links(True), ())
    elif described:
        fit = import_urdf(what, reading.resolve(), capsules, surface, name)
    else:
        raise UserError(
            f"robot: found {shown(what)}, allowed: a URDF (.urdf), xacro (.xacro), MJCF (.xml), a"
            f" name such as ur5e_description, or one of {', '.join(ROBOTS)}"
        )
    fitted = fit.robot
    files = ("robot.toml", "scene.toml", "robot.png")
    with output_files(out, *files, keep=True) as new:
        text = to_toml(fitted, _HEADING.format(file=files[0]), RobotFile)
        write_text(
            new / files[0],
            _LIST.sub(lambda m: "[" + ", ".join(m[0][1:-1].replace(",", " ").split()) + "]", text),
        )
        write_text(new / files[1], scene_text(fitted, files[0]))
        robot_picture(new / files[2], fitted, fit.links)
    console = Terminal()
    console.print(_mount_table(fitted))
    if fit.links:
        console.print(_body_table(fit))
        console.print(outlines(fit.links) + ".", highlight=False)
    console.lines(*(f"  {out / file}" for file in files))


def _mount_table(robot: Robot) -> Explained:
    names = (*robot.chain.joints, "tcp")
    rows = [
        (
            m.link,
            names[m.frame],
            f"{1000 * m.length:.0f}",
            f"{m.usable[0]:.2f} … {m.usable[1]:.2f}" if m.length > 0 else "",
            f"{1000 * m.section:.1f}",
            ": ".join(filter(None, (m.confidence, m.basis))),
        )
        for m in robot.mounts
    ]
    return Explained.of(
        f"{robot.name}: where rings can sit",
        ("link", "moved by", "length, mm", "usable", "section, mm", "confidence"),
        rows,
        "length: of the axis along which rings sit; usable: the part of it around which a ring can"
        " be closed (0 proximal, 1 distal); section: largest radius of the link there.",
        left=("link", "moved by", "confidence"),
    )


def _body_table(fit: RobotFit) -> Explained:
    rows = [
        (
            link.name,
            str(len(link.capsules)),
            ", ".join(f"{1000 * c.radius:.0f}" for c in link.capsules),
            f"{link.ratio:.2f}" if np.isfinite(link.ratio) else "flat",
        )
        for link in fit.links
    ]
    return Explained.of(
        "Capsules that contain each link",
        ("link", "capsules", "radii, mm", "volume ratio"),
        rows,
        "volume ratio: volume of the capsules divided by that of the link; 1 is a perfect fit.",
        left=("link",),
    )
