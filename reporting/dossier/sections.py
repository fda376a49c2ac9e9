"""Sections of the dossier: separation distances, measured stops, and the floor."""

from collections.abc import Iterator

from ...simulation.dossier.dossier import Dossier
from ...simulation.dossier.records import ApproachDistance
from ..pages import escaped, table
from ..text import counted


def distance_section(d: Dossier) -> Iterator[str]:
    """Yield the separation distances, term by term, and whether the sensors reach them."""
    s = d.simulation.separation
    yield "---\n"
    yield "## Separation distance\n"
    yield (
        "S_p = S_h + S_r + S_s + C + Z_d + Z_r, with S_h = v_h (T_r + T_s), S_r = v_r T_r and S_s ="
        " v_r T_s / 2, at the fastest part of the robot. This is the form of ISO/TS 15066 as"
        " published by Marvel and Norcross (PMC5117641); ISO 10218-2:2025 took the TS in, and its"
        " own equation was not to hand. S = K T + D_DS + Z, at least 0.1 m, with T = T_r + T_s, is"
        " that of ISO 13855:2024 (secondary sources). S leaves out the robot's own path, so it"
        " applies to a hazard that stays in place. Taking D_DS = C and Z = Z_d + Z_r is our"
        " reading.\n"
    )
    rows = [
        (f"S_h, {one.approach} at {one.speed_m_s:g} m/s", f"{one.S_h:.3f} m", "K (T_r + T_s)")
        for one in d.distances
    ]
    rows += [
        ("S_r, the robot's path before it brakes", f"{s.S_r:.3f} m", "v_r T_r"),
        ("S_s, the robot's path while it brakes", f"{s.S_s:.3f} m", "v_r T_s / 2"),
        ("C, intrusion", f"{s.C:.3f} m", "input"),
        ("Z_d, position of the person", f"{s.Z_d:.3f} m", "input"),
        ("Z_r, position of the robot", f"{s.Z_r:.3f} m", "input"),
    ]
    yield table(("term", "value", "source"), rows)
    yield table(
        ("approach", "S_p", "S", "S, parallel approach", "sensors reach S_p"),
        [_row(one) for one in d.distances],
    )
    yield (
        "The parallel approach applies where people walk along a detection zone, such as a plane of"
        " beams above the floor: D_DS is then 1.2 m.\n"
    )
    yield _reach(d)
    yield from _path(d)


def _row(one: ApproachDistance) -> tuple[str, ...]:
    reach = "yes" if one.reached else "**some**" if one.some_reach else "**no**"
    return (
        f"{one.approach}, {one.speed_m_s:g} m/s",
        f"**{one.S_p_m:.3f} m**",
        f"{one.S_m:.3f} m",
        f"{one.S_parallel_m:.3f} m",
        reach,
    )


def _reach(d: Dossier) -> str:
    least, most = d.least_range_m, d.largest_range_m
    ranges = f"{least:.2f} m" if least == most else f"{least:.2f} to {most:.2f} m"
    short = [one for one in d.distances if not one.reached]
    if not short:
        return f"> **The sensors' range of {ranges} is at least S_p for both approach speeds.**\n"
    needs = " and ".join(f"{one.S_p_m:.2f} m ({one.approach})" for one in short)
    return (
        f"> **The sensors' range of {ranges} does not reach S_p: {needs}.** A sensor on the fastest"
        " part reports a person too late there, whatever the direction. Slow the robot down,"
        " shorten its stop, or choose sensors with a longer range.\n"
    )


def _path(d: Dossier) -> Iterator[str]:
    """Yield a warning where a measured path is longer than the law's."""
    law = d.simulation.separation.S_s
    longest = max((row.largest_m or 0.0 for row in d.simulation.stops), default=0.0)
    if longest > law:
        yield (
            f"**A measured stop took {longest:.3f} m, more than S_s = {law:.3f} m.** The law of"
            " constant deceleration, or the speed of the motion, does not fit that measurement.\n"
        )


def stop_section(d: Dossier) -> Iterator[str]:
    """Yield the measured stops by condition, or that there are none."""
    stops, used = d.simulation.stops, d.simulation.separation.stopping_s
    yield "## Stopping time and distance\n"
    if not stops:
        yield (
            "**Open: no stop of this robot was measured.** ISO 13855:2024 expects at least ten"
            " measurements. Pass them by joint, extension, load and speed with `--stop-times`."
            f" Until then T_s = {used:g} s is used.\n"
        )
        return
    count = sum(row.measurements for row in stops)
    yield (
        f"The user measured {counted(count, 'stop')} under {counted(len(stops), 'condition')}."
        f" T_s = {used:g} s is the largest. Nothing is interpolated: it counts at all extensions,"
        " loads and speeds.\n"
    )
    if few := [row for row in stops if not row.enough]:
        yield (
            f"**{counted(len(few), 'condition')} of {len(stops)} with fewer than ten measurements**"
            " (ISO 13855:2024 expects at least ten).\n"
        )
    rows = [
        (
            escaped(row.joint),
            f"{row.extension_percent:g} / {row.load_percent:g} / {row.speed_percent:g}",
            f"{row.measurements}" if row.enough else f"**{row.measurements}, too few**",
            f"{row.mean_s:.3f}",
            f"**{row.largest_s:.3f}**" if row.largest_s == used else f"{row.largest_s:.3f}",
            _distance(row.largest_rad, row.largest_m),
        )
        for row in stops
    ]
    heads = (
        "joint",
        "extension / load / speed, %",
        "measurements",
        "mean, s",
        "largest, s",
        "largest path",
    )
    yield table(heads, rows)


def _distance(rad: float | None, metres: float | None) -> str:
    values = [f"{v:.3f} {unit}" for v, unit in ((rad, "rad"), (metres, "m")) if v is not None]
    return ", ".join(values)


def floor_section(d: Dossier, picture: str) -> Iterator[str]:
    """Yield where a person can stand, and get close, unseen."""
    f = d.floor
    yield "## Undetected presence and rear access\n"
    yield (
        f"An upright person of {f.stature_m:.2f} m and a radius of {f.radius_m:g} m stands on each"
        f" square of {f.side_m:g} m on the floor at z = {f.floor_m:g} m, at"
        f" {counted(f.moments, 'moment')} of the motion. A path leads over squares that touch by an"
        " edge or a corner, from the edge of the grid or of the walkable areas. Sensors of the cell"
        " count here.\n"
    )
    yield f"![Plan view: where a person is seen, and within the separation distance]({picture})\n"
    rows = [
        ("room for a person, on the grid", f.room_m2),
        ("never seen", f.never_seen_m2),
        ("unseen at some moment", f.at_times_unseen_m2),
        ("within the separation distance", f.near_m2),
        ("within the separation distance and unseen at the same moment", f.near_unseen_m2),
        ("of the separation distance, reached through places never seen", f.access_m2),
        (
            "of the separation distance, reached through places unseen at some moment",
            f.possible_access_m2,
        ),
    ]
    yield table(("where", "area, m²"), [(name, f"{area:.2f}") for name, area in rows], {1})
    yield f"{_presence(d)} {_access(d)}\n"
    stated = d.stated.rear_access
    yield (
        "Measures against undetected access and presence:"
        f" {f'{escaped(stated)} (stated by the user)' if stated else '**open**'}.\n"
    )


def _presence(d: Dossier) -> str:
    f = d.floor
    if f.largest_radius_m is None or f.largest_at_m is None:
        return "On this grid nobody stands unseen within the separation distance."
    x, y = f.largest_at_m
    return (
        "**A person can stand unseen within the separation distance.** The largest upright cylinder"
        f" that fits there unseen has a radius of at least {f.largest_radius_m:.2f} m, at ({x:.2f},"
        f" {y:.2f}) m."
    )


def _access(d: Dossier) -> str:
    if d.floor.access_m2 > 0:
        return (
            "**Rear access: a person gets within the separation distance through places that no"
            " sensor sees.**"
        )
    if d.floor.possible_access_m2 > 0:
        return (
            "**Rear access is possible at times:** a path leads through places that are unseen at"
            " some moments."
        )
    return "No path on this grid leads unseen into the separation distance."
