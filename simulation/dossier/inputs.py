"""The inputs of a dossier: each value with its unit, state and source."""

from collections.abc import Iterator

from ...coverage.electronics.electronics import unknown_reason
from ...coverage.person_reach import SHOULDER, Person
from ...coverage.rings.ring import Setup
from ...coverage.rings.sensor_records import sensor_records
from ...coverage.robots.separation_distance import (
    LEAST_DISTANCE,
    PARALLEL,
    STOPPING,
    UPPER_LIMB,
    WALKING,
    Safety,
)
from ...objectives.scene import Scene
from ..safety import SafetyResult
from ..safety_options import SafetyOptions
from .records import Input, State
from .statements import Statements

_EXAMPLE = "worked example in the literature, as quoted by secondary sources; not of this cell"
_13855 = "ISO 13855, by secondary sources"
_SCENE = "[safety] of the scene"
_DEFAULTS = Safety()


def inputs_of(
    setup: Setup, scene: Scene, options: SafetyOptions, r: SafetyResult, stated: Statements
) -> tuple[Input, ...]:
    """Return all inputs of a dossier.

    Args:
        setup: the setup.
        scene: its scene.
        options: options of the simulation.
        r: result of the simulation.
        stated: what the user states.
    """
    return (
        *_speeds(scene, r),
        *_times(setup, scene, options, r, stated),
        *_lengths(scene),
        *_ranges(setup),
        *_detection(scene, stated),
    )


def _speeds(scene: Scene, r: SafetyResult) -> Iterator[Input]:
    for name, value in (("walking", WALKING), ("upper limb", UPPER_LIMB)):
        yield Input(
            name=f"approach speed, {name}",
            symbol="K",
            value=value,
            unit="m/s",
            state="standard",
            source=_13855,
        )
    own = scene.safety.human == WALKING
    yield Input(
        name="speed of the simulated person",
        symbol="v_h",
        value=scene.safety.human,
        unit="m/s",
        state="standard" if own else "stated by the user",
        source=f"{_13855}: walking" if own else f"{_SCENE}, human_speed",
    )
    if r.separation.speeds_known:
        state: State = "computed"
        source = "joint speeds of the motion; upper bound over the parts of the robot"
    elif scene.safety.speed == _DEFAULTS.speed:
        state, source = "assumed", "no joint speeds are known: the robot counts as standing still"
    else:
        state, source = "stated by the user", f"{_SCENE}, robot_speed, for all parts"
    yield Input(
        name="speed of the robot's fastest part",
        symbol="v_r",
        value=r.separation.fastest_m_s,
        unit="m/s",
        state=state,
        source=source,
    )


def _times(
    setup: Setup, scene: Scene, options: SafetyOptions, r: SafetyResult, stated: Statements
) -> Iterator[Input]:
    late = r.period_s + r.latency_s
    longer = scene.safety.reaction < late
    state, source = _stated(scene.safety.reaction, _DEFAULTS.reaction, "reaction_s")
    yield Input(
        name="reaction time",
        symbol="T_r",
        value=r.separation.reaction_s,
        unit="s",
        state="computed" if longer else state,
        source=f"period plus latency, longer than reaction_s = {scene.safety.reaction:g} s"
        if longer
        else source,
    )
    yield _period(setup, scene, options, r)
    own = options.latency == SafetyOptions().latency
    yield Input(
        name="latency from a reading to its report",
        value=r.latency_s,
        unit="s",
        state="assumed" if own else "stated by the user",
        source="default of place-rings, not measured" if own else "--latency",
    )
    yield _text("reaction time measured on the rig", stated.reaction_time)
    state, source = _stopping(scene, r)
    yield Input(
        name="stopping time",
        symbol="T_s",
        value=r.separation.stopping_s,
        unit="s",
        state=state,
        source=source,
    )


def _period(setup: Setup, scene: Scene, options: SafetyOptions, r: SafetyResult) -> Input:
    state: State = "computed"
    source = "bus, driver and rate of each ring; the slowest ring"
    if options.rate is not None:
        state, source = "stated by the user", "--rate"
    elif r.scheduled:
        source = "firing schedule without mutual interference, with the bus; the slowest ring"
    elif r.rate_assumed:
        state, source = "assumed", "20 readings per second: no rate is known"
    elif any(unknown_reason(scene.electronics, group.sensor) for group in setup.groups):
        state, source = "maker's", "highest rate of the sensor's mode; no limit of a bus is known"
    return Input(
        name="period of the readings", value=r.period_s, unit="s", state=state, source=source
    )


def _stopping(scene: Scene, r: SafetyResult) -> tuple[State, str]:
    if r.stops:
        count = sum(row.measurements for row in r.stops)
        few = sum(not row.enough for row in r.stops)
        doubt = f"; {few} of {len(r.stops)} conditions have fewer than 10" if few else ""
        return "measured by the user", f"largest of {count} measured stops{doubt}"
    if scene.safety.stopping is not None:
        return "stated by the user", f"{_SCENE}, stopping_s"
    if scene.robot.name in STOPPING:
        return "maker's", "UR10 CB3 manual, section 1.6.2, at the next higher speed limit"
    return "open", "none"


def _lengths(scene: Scene) -> Iterator[Input]:
    for name, symbol, field in (
        ("intrusion distance, also taken as D_DS", "C", "intrusion"),
        ("uncertainty of the person's position", "Z_d", "sensor"),
        ("uncertainty of the robot's position", "Z_r", "robot"),
    ):
        key = {"intrusion": "intrusion_m"}.get(field, f"{field}_uncertainty_m")
        value: float = getattr(scene.safety, field)
        state, source = _stated(value, getattr(_DEFAULTS, field), key)
        yield Input(name=name, symbol=symbol, value=value, unit="m", state=state, source=source)
    for name, symbol, value in (
        ("reaching distance, approach parallel to the zone", "D_DS", PARALLEL),
        ("least separation distance", "S", LEAST_DISTANCE),
    ):
        yield Input(
            name=name,
            symbol=symbol,
            value=value,
            unit="m",
            state="standard",
            source="ISO 13855:2024, by secondary sources",
        )


def _stated(value: float, default: float, key: str) -> tuple[State, str]:
    if value == default:
        return "default", _EXAMPLE
    return "stated by the user", f"{_SCENE}, {key}"


def _ranges(setup: Setup) -> Iterator[Input]:
    for one in sensor_records(setup):
        light = "light not stated: best case" if one.ambient is None else f"light {one.ambient}"
        cloth = (
            "reflectance not stated: best case"
            if one.reflectance is None
            else f"reflectance {100 * one.reflectance:g} %"
        )
        laws = not all(rule.measured for rule in one.rules)
        yield Input(
            name=f"range of {one.title} ({light}, {cloth})",
            value=one.range_m,
            unit="m",
            state="computed" if laws else "maker's",
            source=f"{one.source}{'; reduced by laws, see its derivation' if laws else ''}",
        )
    nominal = {g.sensor.range_m for g in setup.groups if g.sensor.use is None}
    for range_m in sorted(nominal):
        yield Input(
            name="nominal range of a sensor that is not in the catalogue",
            value=range_m,
            unit="m",
            state="assumed",
            source="the setup states it for any target and light",
        )


def _detection(scene: Scene, stated: Statements) -> Iterator[Input]:
    yield _text("effective detection capability d_e and test piece", stated.detection_capability)
    person = scene.person or Person()
    own = scene.person is None
    yield Input(
        name="stature of the smallest person on the floor",
        value=person.shoulder / SHOULDER,
        unit="m",
        state="default" if own else "stated by the user",
        source="shoulders at 1.2 m; a default of place-rings" if own else "[person] of the scene",
    )
    yield _text("measures against undetected access and presence", stated.rear_access)


def _text(name: str, text: str) -> Input:
    return Input(
        name=name,
        text=text,
        state="stated by the user" if text else "open",
        source="statements of the user" if text else "none",
    )
