"""SRDF, MoveIt's description beside a URDF: the arm, its pose, and pairs of links that need no
collision check."""

import itertools
import xml.etree.ElementTree as ET

from ...coverage.robots.robot import BASE
from .link_contacts import LinkSolid, contacts, link_solids, ring_solid, sampled_frames
from .markup import document, words
from .placed import TCP_LINK, PlacedSetup
from .ring_bodies import ring_bodies
from .urdf import attached_name

_GROUP = "arm"


def srdf(placed: PlacedSetup) -> dict[str, bytes]:
    """Return ``robot.srdf`` for ``robot.urdf``.

    It excludes each ring from checks against its own link, and against what it touches in all or in
    no sampled poses. For a robot made of the chain it does the same for the links, and excludes
    links with a common joint. The links of a user's own URDF are left to the user's own SRDF.

    Raises:
        UserError: if the user's URDF lacks the robot's chain.
    """
    own, picked = placed.urdf, placed.picked
    root = ET.Element("robot", name=placed.robot_name if own is None else own.name)
    group = ET.SubElement(root, "group", name=_GROUP)
    tip = TCP_LINK if own is None else placed.links[-1]
    ET.SubElement(group, "chain", base_link=placed.carrier(BASE), tip_link=tip)
    state = ET.SubElement(root, "group_state", name="pose", group=_GROUP)
    follows = {m.joint for m in placed.scene.robot.chain.mimics}
    names = placed.joint_names if picked is None else picked.chain.joints
    for j, name in enumerate(names):
        if j not in follows:
            value = words([placed.scene.poses[placed.pose].q[j]])
            ET.SubElement(state, "joint", name=name, value=value)
    for (one, other), reason in _pairs(placed).items():
        ET.SubElement(root, "disable_collisions", link1=one, link2=other, reason=reason)
    return {"robot.srdf": document(root)}


def _pairs(placed: PlacedSetup) -> dict[tuple[str, str], str]:
    """Return pairs of links and rings by their names, each with the reason to leave it out."""
    rings = {ring.name: ring_solid(ring) for ring in ring_bodies(placed)}
    links = {str(joint): solid for joint, solid in link_solids(placed).items()}
    bare = {joint: LinkSolid(joint, ()) for joint in {r.joint for r in rings.values()}}
    links |= {str(j): solid for j, solid in bare.items() if str(j) not in links}
    pairs = dict[tuple[str, str], str]()
    for (one, other), reason in contacts(links | rings, sampled_frames(placed.scene.robot)).items():
        if one in rings or other in rings:
            for a in _names(placed, one):
                pairs |= {(a, b): reason for b in _names(placed, other)}
        elif placed.urdf is None:
            pairs[placed.carrier(int(one)), placed.carrier(int(other))] = reason
    if placed.urdf is None:
        for low, high in itertools.pairwise(sorted(map(int, links))):
            if high - low == 1:
                pairs[placed.carrier(low), placed.carrier(high)] = "Adjacent"
    return pairs


def _names(placed: PlacedSetup, solid: str) -> list[str]:
    """Return the names of the links that a solid stands for: a ring's own, or those that are fixed
    to the link which a joint moves."""
    if solid.startswith("ring_"):
        return [solid]
    joint = int(solid)
    if placed.picked is None:
        return [placed.carrier(joint)]
    robot = placed.scene.robot
    moved, last = placed.picked.carried, len(robot.chain) - 1
    there = [c.link.name for c in moved if min(c.frame, last) == joint and c.link.collision]
    own = robot.bodies[len(robot.unladen.bodies) :] if robot.unladen is not None else ()
    attached = {b.frame for b in own} | {c.frame for c in robot.carried}
    there += [attached_name(f) for f in sorted(attached) if min(f, last) == joint]
    return there
