"""Sections of a report on coverage: as counted, of V_P, and after losses and mounting errors."""

from collections.abc import Iterator

from ...coverage.occlusion.occlusion_mode import OCCLUSIONS, Occlusion
from ..lines.occlusion import ASSUMPTIONS, part_lines, scene_lines, unseeing_lines
from ..lines.results import protective_lines, record_lines
from ..pages import escaped, table
from ..tables import (
    DARK,
    count_error_line,
    dark_columns,
    losses_line,
    percent,
    percent_under,
    robustness_rows,
    target_label,
)
from ..text import counted, listed
from .facts import Facts


def answer(f: Facts) -> str:
    """Return the coverage of the setup in one sentence."""
    what = f"{counted(f.setup.sensors, 'sensor')} on {counted(len(f.setup.rings), 'ring')}"
    if f.setup.singles:
        what += f" and as {counted(len(f.setup.singles), 'single sensor')}"
    if f.scene.cell_sensors:
        what += f" with {counted(len(f.scene.cell_sensors), 'sensor')} of the cell"
    each = []
    for r in f.own:
        others = [m for m in OCCLUSIONS if m != f.scene.occlusion and m in r.by_occlusion]
        beyond = [f"{percent_under(r, m)} % under `{m}`" for m in others]
        if r.dark_clothing is not None:
            beyond.insert(0, f"**{100 * r.dark_clothing:.2f} % of dark clothing**")
        each.append(
            f"**{percent(r, r.rule)} % of {target_label(r)}**"
            + (f" ({', '.join(beyond)})" if beyond else "")
        )
    alone = [one for one in part_lines(f.own) if f.scene.cell_sensors]
    return " ".join([f"{what} cover {listed(each)}.", *alone])


def coverage_section(f: Facts) -> Iterator[str]:
    """Yield ζ of the setup and of the paper's layouts under each model of occlusion."""
    yield "## Coverage\n"
    many = f", the mean over {len(f.scene.poses)} poses" if len(f.scene.poses) > 1 else ""
    yield (
        f"ζ, the covered share of each target, in percent{many}, counted at one point in"
        f" each voxel of {f.voxel:g} m; the paper's layouts use this scene's sensor."
    )
    yield f"{count_error_line(f.voxel)}\n"
    labels = list(dict.fromkeys(target_label(r) for r in f.zetas))
    models: list[Occlusion] = [m for m in OCCLUSIONS if any(m in r.by_occlusion for r in f.zetas)]
    models.sort(key=lambda model: model != f.scene.occlusion)
    for model in models or [f.scene.occlusion]:
        asked = " (the scene's model)" if model == f.scene.occlusion else ""
        yield f"### {model}: {ASSUMPTIONS[model]}{asked}\n"
        rows = []
        for name, sensors in f.sensors.items():
            mine = {
                target_label(r): (
                    percent_under(r, model) if model in r.by_occlusion else percent(r, r.rule)
                )
                for r in f.zetas
                if r.setup == name
            }
            mark = "**" if name == f.name else ""
            cells = [f"{mark}{mine[label]}{mark}" for label in labels]
            rows.append(
                [f"{mark}{'this setup' if mark else escaped(name)}{mark}", str(sensors), *cells]
            )
        yield table(["setup", "sensors", *labels], rows, right=range(1, len(labels) + 2))
    if dark := dark_columns(f.zetas):
        yield f"### {DARK}\n"
        rows = [
            ["this setup" if name == f.name else escaped(name), str(sensors)]
            + [of_setup.get(name, "") for of_setup in dark.values()]
            for name, sensors in f.sensors.items()
        ]
        yield table(["setup", "sensors", *dark], rows, right=range(1, len(dark) + 2))
    for r in f.own:
        if r.worst is not None:
            yield (
                f"{target_label(r)} in the worst pose, {r.worst.pose}: {percent(r.worst, r.rule)}"
                " %.\n"
            )
    told = [
        *part_lines(f.own),
        *unseeing_lines(f.own[0].unseeing),
        *scene_lines(f.scene),
        *record_lines(f.own),
    ]
    if told:
        yield "\n".join(f"- {escaped(line)}" for line in told) + "\n"


def separation_section(f: Facts) -> Iterator[str]:
    """Yield the section on V_P, if it is a target."""
    s = next((r.separation for r in f.own if r.separation is not None), None)
    if s is None:
        return
    yield "## Protective volume and separation distances\n"
    yield "\n".join(f"- {escaped(line)}" for line in protective_lines(f.own, f.setup)) + "\n"
    terms = (
        ("S_h", "way of the person during reaction and stopping", s.S_h),
        ("S_r", "way of the robot during the reaction", s.S_r),
        ("S_s", "stopping distance of the robot", s.S_s),
        ("C", "intrusion distance", s.C),
        ("Z_d", "uncertainty of the person's position", s.Z_d),
        ("Z_r", "uncertainty of the robot's position", s.Z_r),
    )
    rows = [(name, text, f"{value:.3f}") for name, text, value in terms]
    rows += [
        ("**S**", "**separation distance of the fastest part**", f"**{s.largest_m:.3f}**"),
        ("", "mean over the parts and poses", f"{s.mean_m:.3f}"),
        ("", "smallest", f"{s.least_m:.3f}"),
    ]
    yield table(("term", "meaning", "m"), rows, right=(2,))


def robustness_section(f: Facts) -> Iterator[str]:
    """Yield k-coverage, losses of a ring or sensor, and coverage under mounting errors."""
    yield "## Redundancy, losses and tolerance\n"
    over = (
        ""
        if f.robust_poses == len(f.scene.poses)
        else f" over {f.robust_poses} representative poses"
    )
    yield f"In percent of each target{over}, under `{f.scene.occlusion}`.\n"
    labels = [target_label(r) for r in f.robust]
    yield table(["", *labels], robustness_rows(f.robust), right=range(1, len(labels) + 1))
    for r in f.robust:
        told, _, _ = losses_line(r).rpartition(";")
        yield f"- {target_label(r)}: {escaped(told)}."
    yield ""
