"""The dossier: one record of separation distances, stops, access, elements, and open points."""

from collections.abc import Iterator
from dataclasses import replace

from ...coverage.definitions.definition import definition
from ...coverage.definitions.field_types import Items
from ...coverage.definitions.records import FileRecord
from ...coverage.rings.ring import Setup
from ...coverage.rings.sensor_records import title, used
from ...coverage.robots.separation_distance import (
    PARALLEL,
    UPPER_LIMB,
    WALKING,
    Safety,
    approach_distance,
    separation,
)
from ...objectives.scene import Scene
from ..safety import DISCLAIMER, SafetyResult
from ..safety_options import SafetyOptions
from .capability import Capability
from .floor import FloorRecord
from .inputs import inputs_of
from .records import ApproachDistance, Element, Input
from .statements import ElementStatement, Statements


@definition(kw_only=True)
class Dossier(FileRecord):
    """Output of ``safety --dossier``: what is known, assumed and open. It confers no safety
    rating."""

    setup: str
    """Name or file of the setup."""
    robot: str
    """Name of the robot."""
    disclaimer: str = DISCLAIMER
    """Statement that the dossier is no safety rating."""
    does_not_prove: Items[str]
    """What the dossier does not prove."""
    stated: Statements
    """What the user states."""
    inputs: Items[Input]
    """All inputs with state and source."""
    distances: Items[ApproachDistance]
    """Separation distances for each approach speed."""
    least_range_m: float
    """Smallest range of the setup's sensors, m."""
    largest_range_m: float
    """Largest range of the setup's sensors, m."""
    simulation: SafetyResult
    """Simulated approaches, with the terms of the separation distance and the measured stops."""
    floor: FloorRecord
    """Where a person can stand, and get close, unseen."""
    capability: Capability
    """What the sensors can detect, as far as the user asked."""
    elements: Items[Element]
    """Performance levels."""


def dossier_of(
    setup: Setup,
    scene: Scene,
    options: SafetyOptions,
    r: SafetyResult,
    safety: Safety,
    floor: FloorRecord,
    capability: Capability,
    stated: Statements,
) -> Dossier:
    """Return the dossier of a simulated setup.

    Args:
        setup: the setup.
        scene: its scene.
        options: options of the simulation.
        r: result of the simulation.
        safety: terms of the whole separation distances.
        floor: what sensors see on the floor.
        capability: what they can detect.
        stated: what the user states.
    """
    ranges = [group.sensor.range_m for group in setup.groups]
    return Dossier(
        setup=r.setup,
        robot=scene.robot.name,
        does_not_prove=tuple(_does_not_prove(r, floor)),
        stated=stated,
        inputs=inputs_of(setup, scene, options, r, capability, stated),
        distances=distances(safety, r.separation.fastest_m_s, r.separation.stopping_s, ranges),
        least_range_m=min(ranges),
        largest_range_m=max(ranges),
        simulation=r,
        floor=floor,
        capability=capability,
        elements=tuple(_elements(setup, scene, stated)),
    )


def distances(
    safety: Safety, speed: float, stopping: float, ranges: list[float]
) -> tuple[ApproachDistance, ...]:
    """Return the separation distances for each approach speed.

    Args:
        safety: terms of the distance; its speed of a person is replaced.
        speed: speed of the robot's fastest part, m/s.
        stopping: T_s, s.
        ranges: ranges of the sensors, m.
    """
    rows, supplement = [], safety.sensor + safety.robot
    total = safety.reaction + stopping
    for approach, human in (("walking", WALKING), ("upper limb", UPPER_LIMB)):
        terms = separation(replace(safety, human=human), speed, stopping)
        rows.append(
            ApproachDistance(
                approach=approach,
                speed_m_s=human,
                S_h=terms.S_h,
                S_p_m=terms.total,
                S_m=approach_distance(human, total, safety.intrusion, supplement),
                S_parallel_m=approach_distance(human, total, PARALLEL, supplement),
                reached=min(ranges) >= terms.total,
                some_reach=max(ranges) >= terms.total,
            )
        )
    return tuple(rows)


def _does_not_prove(r: SafetyResult, floor: FloorRecord) -> Iterator[str]:
    """Yield sentences whose first names what is not proved."""
    yield (
        "Conformity with a standard. Terms of ISO 10218-2:2025 and ISO 13855:2024 come from"
        " secondary sources; the standards' own text was not to hand. The form of S_p is that of"
        " ISO/TS 15066, as published by Marvel and Norcross (PMC5117641)."
    )
    yield (
        "Detection. The figures are geometry: any part of a person within a sensor's nominal beam"
        " and range counts as seen. No sensor was tested on a person or test piece here. An"
        " expected share with detection, if listed, follows from a law between the makers' figures."
    )
    yield (
        "A performance level. This page rates no element. The user's entries are printed as stated,"
        " unchecked."
    )
    yield (
        "That a report stops the robot. The path from a reading to standstill was neither run nor"
        " measured; reaction and stopping times count as listed."
    )
    yield (
        "Freedom from faults. Failed, dirty, covered, misaligned or mutually disturbed sensors,"
        " loss of a bus, and errors of firmware or software are not modelled."
    )
    yield (
        "Protection of every person. One upright person is modelled: nobody who runs, crawls,"
        " kneels, climbs, lies or leans, no child, no second person, no outstretched arm."
    )
    yield (
        f"Other motions. {floor.moments} of {floor.of_moments} moments were examined on the floor,"
        f" and {r.approaches} approaches were simulated. Other programs, tools, payloads and speeds"
        " need a new dossier."
    )
    yield (
        "Other hazards. Only contact with the robot's moving parts counts: no workpiece, no tool's"
        " edge, no clamping, no other machine. Obstacles count as stated, the robot as capsules."
    )


def _elements(setup: Setup, scene: Scene, stated: Statements) -> Iterator[Element]:
    ratings = {e.model.title: (e.model.safety, e.model.source) for e in used(setup)}
    for name in dict.fromkeys(title(group.sensor) for group in setup.groups):
        rating, source = ratings.get(name, ("", ""))
        yield _element(f"sensor: {name}", stated.sensor, rating, source)
    board = scene.electronics.board.title
    own = scene.electronics.bus == "own"
    yield _element(
        "electronics: " + ("the user's own" if own else f"{board} on each ring"), stated.electronics
    )
    yield _element("bus between sensors and electronics", stated.bus)
    yield _element(
        "software from reading to command",
        stated.software,
        "none",
        "firmware and programs of place-rings have no rating",
    )
    yield _element("robot's stop input", stated.stop_input)
    yield _element("robot's controller, stop function and brakes", stated.controller)


def _element(name: str, stated: ElementStatement, rating: str = "", source: str = "") -> Element:
    """Return an element with the user's statement, or the rating in the catalogue."""
    known = bool(stated.rating or rating)
    return Element(
        element=name,
        default=stated.default,
        default_state="stated by the user" if stated.default else "open",
        rating=stated.rating or rating or "none stated",
        state="stated by the user" if stated.rating else "maker's" if known else "open",
        source="statements of the user" if stated.rating else source,
    )
