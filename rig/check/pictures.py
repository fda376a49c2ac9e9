"""Pictures of a check's page: the rings with their verdicts, expected and read distances, and the
trials.
"""

from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Bool, Float

from ...coverage.rings.ring import Setup
from ...coverage.rings.ring_kinematics import sensor_cones
from ...coverage.robots.kinematics import forward
from ...formats.export.palette import COVERED_TWICE, OBSTACLE, UNCOVERED, WARNING
from ...objectives.scene import Scene
from ...reporting.plots import COLOURS, GREY, INK, plain
from ...reporting.rendering.canvas import Canvas
from ...reporting.rendering.colours import rgb
from ...reporting.rendering.figures import write_png
from ...reporting.rendering.meshes import band, body, faces_within, loops, tube
from ...reporting.rendering.robot import add_robot, draw_room
from ..mount.as_built import AsBuilt
from ..rod.coverage_estimate import RodCheck
from ..sensing.expected import CELL, expected
from ..sensing.readings import Stops
from .assessment import Assessment
from .planned_check import PlannedCheck

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_VERDICTS = {"as proposed": COLOURS[2], "differs": WARNING, "not determined": COLOURS[4]}
_VIEWS = (("oblique view", -58.0, 22.0), ("from behind", 122.0, 22.0))
_ABOVE = (_VIEWS[0], ("from above", -90.0, 89.99))
_MARGIN = 0.12  # m around what a picture shows
_SENSOR, _POINT = 0.008, 0.018  # m, radii of drawn sensors and trials
_AGREE = 0.03  # m: tolerance within which a reading is as expected, as for a zone
_COLUMNS, _PANEL = 4, 3.0  # panels of readings side by side, and their size in inches


def write_pictures(check: PlannedCheck, assessment: Assessment, folder: Path) -> dict[str, str]:
    """Write the pictures of a check into a folder; return the names of the files, each with what it
    shows."""
    scene, done, shown = check.scene, assessment.parts, dict[str, str]()
    verdicts = _verdicts(check.setup, assessment)
    if check.setup.rings and verdicts:
        shown["check-rings.png"] = "Rings on the robot, by their verdicts"
        write_png(folder / "check-rings.png", _rings(scene, check.setup, done.built, verdicts))
    if done.read is not None and check.setup.rings:
        shown["check-readings.png"] = "Expected and read distances at the stops, ring by ring"
        figure = _readings(scene, check.setup, done.read, done.built, verdicts)
        write_png(folder / "check-readings.png", figure)
    for k, rod in enumerate(done.rods):
        if rod.tested.any():
            name = f"check-trials-{k}.png"
            shown[name] = f"Trials in {rod.plan.named}: predicted and observed"
            write_png(folder / name, _trials(scene, check.setup, rod))
    return shown


def _verdicts(setup: Setup, assessment: Assessment) -> list[str]:
    """Return the verdict on each ring: of the mount check, else whether the self check found
    silent or surprising sensors; none without either."""
    mount, looks = assessment.result.mount, assessment.parts.self_check
    if mount is not None:
        return [ring.verdict for ring in mount.rings]
    if looks is None:
        return []
    wrong = {setup.labels[k][0] for k in (*looks.silent, *looks.surprising)}
    return ["differs" if i in wrong else "as proposed" for i in range(len(setup.rings))]


def _figure(title: str) -> "Figure":
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12, 6), dpi=120, facecolor="white")
    figure.text(0.5, 0.945, title, ha="center", fontsize=15, color=INK, weight="bold")
    return figure


def _canvas(figure: "Figure", left: float, view: tuple[str, float, float], box: Any) -> Canvas:
    """Return a canvas in a half of the figure, with floor and far walls."""
    caption, azimuth, elevation = view
    axes = figure.add_axes((left, 0.085, 0.48, 0.8), aspect="equal")
    canvas = Canvas(axes, box, azimuth, elevation)
    draw_room(canvas)
    axes.axis("off")
    axes.text(0, 1.0, caption, transform=axes.transAxes, fontsize=11, color=GREY, style="italic")
    return canvas


def _box(*points: Float[np.ndarray, "_ 3"]) -> Float[np.ndarray, "2 3"]:
    every = np.concatenate(points)
    return np.stack([every.min(axis=0) - _MARGIN, every.max(axis=0) + _MARGIN])


def _key(figure: "Figure", entries: list[tuple[str, str, str]]) -> None:
    """Add the key of texts, markers and colours."""
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], ls="", marker=marker, ms=9, color=c) for _, marker, c in entries]
    texts = [text for text, *_ in entries]
    figure.legend(handles, texts, loc="lower center", ncols=5, frameon=False, fontsize=11)


def _rings(scene: Scene, setup: Setup, built: AsBuilt | None, verdicts: list[str]) -> "Figure":
    """Draw the rings, as built where that is known, at the scene's first pose."""
    q = scene.poses[0].q
    frames, shown = forward(scene.robot.chain, q), setup if built is None else built.setup
    apex = np.asarray(sensor_cones(scene.robot, shown, q).apex)
    alive = np.ones(shown.sensors, bool) if built is None else built.alive
    figure = _figure("Rings by verdict" if built is None else "Rings as built, by verdict")
    box = _box(body(scene.robot, frames), apex)
    for left, view in zip((0.01, 0.51), _VIEWS, strict=True):
        canvas = _canvas(figure, left, view, box)
        add_robot(canvas, scene, frames, Setup(()), {}, bool(scene.robot.bodies))
        for ring, verdict in zip(shown.rings, verdicts, strict=True):
            rims = band(scene, frames, ring)
            canvas.mesh(tube(rims), _VERDICTS[verdict])
            canvas.lines(loops(rims), 0.75 * rgb(_VERDICTS[verdict]), 0.7)
        canvas.points(apex[alive], INK, _SENSOR, 0.02)
        canvas.points(apex[~alive], "#ffffff", 2.2 * _SENSOR, 0.02)
        canvas.points(apex[~alive], WARNING, 1.6 * _SENSOR, 0.021)
        canvas.draw()
        _numbers(canvas, frames, scene, shown, verdicts)
    some = [v for v in _VERDICTS if v in verdicts]
    entries = [(f"{verdicts.count(v)} {v}", "s", _VERDICTS[v]) for v in some]
    entries += [("dead sensor", "o", WARNING)] * (not alive.all())
    _key(figure, entries)
    return figure


def _numbers(canvas: Canvas, frames: Any, scene: Scene, setup: Setup, verdicts: list[str]) -> None:
    """Write the numbers of the rings in columns beside the robot."""
    middles = np.array([band(scene, frames, r).reshape(-1, 3).mean(axis=0) for r in setup.rings])
    at = canvas.project(middles)[0]
    left = at[:, 0] <= np.median(at[:, 0])
    beside, place = 0.16 * canvas.size, at.copy()
    place[:, 0] = np.where(left, at[:, 0].min() - beside, at[:, 0].max() + beside)
    for side in (left, ~left):
        order = np.flatnonzero(side)[np.argsort(at[side, 1], kind="stable")]
        for below, above in pairwise(order):  # one above the other
            least = place[below, 1] + 0.055 * canvas.size
            place[above, 1] = max(place[above, 1], least)
    for i, (verdict, xy, text) in enumerate(zip(verdicts, at, place, strict=True)):
        canvas.ax.annotate(
            str(i),
            xy,
            xytext=text,
            fontsize=11,
            color=INK,
            ha="center",
            va="center",
            zorder=6,
            arrowprops={"arrowstyle": "-", "color": _VERDICTS[verdict], "lw": 1.4},
            bbox={"boxstyle": "circle,pad=0.25", "fc": "white", "ec": _VERDICTS[verdict], "lw": 2},
        )


def _readings(
    scene: Scene, setup: Setup, read: Stops, built: AsBuilt | None, verdicts: list[str]
) -> "Figure":
    """Draw each sensor's reading at each stop over the expected one, of the ring as built where
    that is estimated."""
    from matplotlib.figure import Figure

    shown = setup if built is None else built.setup
    wanted = expected(scene, shown, read.joints)
    rows = -(-len(setup.rings) // _COLUMNS)
    figure = Figure(figsize=(12, 0.9 + _PANEL * rows), dpi=100, layout="constrained")
    panels = figure.subplots(rows, _COLUMNS, squeeze=False).ravel()
    for i, (ax, ring) in enumerate(zip(panels, setup.rings, strict=False)):
        k = setup.slices[i]
        fit = None if built is None else built.fits[i]
        seats = k if fit is None else k.start + fit.seat
        at = wanted.distance[:, seats] + (0.0 if fit is None else fit.offset)
        _panel(ax, at, read.distance[:, k], wanted.what[:, seats] == CELL)
        verdict = verdicts[i] if verdicts else ""
        ax.set_title(f"ring {i} ({ring.link}): {verdict}", fontsize=10, loc="left", color=INK)
        ax.spines[["left", "bottom"]].set_color(_VERDICTS.get(verdict, GREY))
        ax.spines[["left", "bottom"]].set_linewidth(2.5)
    for ax in panels[len(setup.rings) :]:
        ax.axis("off")
    figure.supxlabel("expected, m", fontsize=11)
    figure.supylabel("read, m", fontsize=11)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=4, frameon=False, fontsize=11)
    return figure


def _panel(
    ax: Any,
    wanted: Float[np.ndarray, "P n"],
    read: Float[np.ndarray, "P n"],
    cell: Bool[np.ndarray, "P n"],
) -> None:
    """Draw the readings of one ring; those without a target where another is expected stand below
    the axis, those without an expected one beside it."""
    plain(ax)
    there, has = np.isfinite(wanted), np.isfinite(read)
    most = max(float(np.max(wanted, initial=0.5, where=there)), 0.5)
    most = 1.05 * max(float(np.max(read, initial=most, where=has)), most)
    none = -0.06 * most
    x, y = np.where(there, wanted, none), np.where(has, read, none)
    with np.errstate(invalid="ignore"):
        off = (there != has) | (there & has & (np.abs(wanted - read) > _AGREE))
    ax.plot([0, most], [0, most], color=GREY, lw=0.8, zorder=1)
    good = there & has & ~off
    style: dict[str, Any] = {"s": 14, "lw": 0, "alpha": 0.75, "zorder": 2}
    ax.scatter(x[good & cell], y[good & cell], color=COVERED_TWICE, label="meets the cell", **style)
    ax.scatter(
        x[good & ~cell], y[good & ~cell], color=GREY, label="meets the robot itself", **style
    )
    label = f"more than {1000 * _AGREE:.0f} mm off, or a target on one side only"
    ax.scatter(x[off], y[off], color=WARNING, marker="x", s=20, lw=1.2, zorder=3, label=label)
    ax.set(xlim=(1.6 * none, most), ylim=(1.6 * none, most), aspect="equal")
    ax.axhline(0, color=GREY, lw=0.5)
    ax.axvline(0, color=GREY, lw=0.5)
    ax.tick_params(labelsize=8)


def _trials(scene: Scene, setup: Setup, rod: RodCheck) -> "Figure":
    """Draw the trials at the pose with most contradictions, of several the first."""
    plan = rod.plan
    wrong = rod.tested & (rod.seen != plan.covered)
    counts = np.bincount(plan.pose[wrong], minlength=len(plan.joints))
    with_trials = np.bincount(plan.pose[rod.tested], minlength=len(plan.joints)) > 0
    pose = int(np.argmax(np.where(with_trials, counts, -1)))
    here = rod.tested & (plan.pose == pose)
    frames = forward(scene.robot.chain, plan.joints[pose])
    of = f" at pose {pose} of {len(plan.joints)}" if len(plan.joints) > 1 else ""
    where = f" ({int((here & plan.beyond).sum())} beyond it)" * bool((here & plan.beyond).any())
    figure = _figure(f"{here.sum()} trials in {plan.named}{where}{of}")
    box = _box(body(scene.robot, frames), plan.point[here])
    kinds = {
        (True, True): ("seen as predicted", COVERED_TWICE),
        (False, False): ("unseen as predicted", UNCOVERED),
        (True, False): ("predicted seen, was not", WARNING),
        (False, True): ("predicted unseen, was seen", INK),
    }
    some = {(p, s): here & (plan.covered == p) & (rod.seen == s) for p, s in kinds}
    colours = dict.fromkeys(scene.robot.links, GREY)
    for left, view in zip((0.01, 0.51), _ABOVE, strict=True):
        canvas = _canvas(figure, left, view, box)
        for obstacle in scene.obstacles:
            canvas.faces(faces_within(obstacle.body, box), OBSTACLE, 0.3)
        add_robot(canvas, scene, frames, setup, colours, bool(scene.robot.bodies))
        for (predicted, was), (_, colour) in kinds.items():
            points = plan.point[some[predicted, was]]
            size = _POINT if predicted == was else 1.5 * _POINT
            canvas.points(points, "#ffffff", 1.25 * size, -0.001)
            canvas.points(points, colour, size)
        canvas.draw()
    _key(figure, [(f"{some[k].sum()} {text}", "o", colour) for k, (text, colour) in kinds.items()])
    return figure
