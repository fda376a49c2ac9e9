"""Comparison of setups: a scene's own and the paper's layouts, by the scene's targets and the
paper's.
"""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import replace
from typing import Any

from ..coverage.occlusion.occlusion_mode import OCCLUSIONS
from ..coverage.rings.ring import Setup, named_setup
from ..coverage.targets.named import ReachAndToolSpheres, ReachSphere, Shell, ToolSphere
from ..coverage.targets.target import Target
from ..objectives.criterion import Criterion, judge
from ..objectives.dark_clothing import verify_dark
from ..objectives.feasibility.clearance import MountClearance
from ..objectives.feasibility.violations import mount_faults
from ..objectives.named_layouts import layout_in
from ..objectives.occlusion import unseeing
from ..objectives.reach import beyond_sensors
from ..objectives.scene import Scene
from ..objectives.verified import Verified
from ..objectives.verify import Verifier
from ..objectives.verify_breakdown import by_occlusion, by_part, where_people_are
from ..objectives.verify_targets import verify_targets

PAPER_SETUPS = ("n1_8_0", "n1_16_0", "n2_16_25", "n2_16_55", "n3_16_55")
PAPER_TARGETS = (
    ReachSphere(),
    ToolSphere(),
    ReachAndToolSpheres(),
    Shell(0.5),
    Shell(1.5),
)
# at most this many poses: compare by all of the paper's targets, else by the goals
_FEW_POSES = 4


def comparable(scene: Scene) -> tuple[str, ...]:
    """Return the names of the paper's layouts that fit the scene's robot; empty if it lacks one of
    their links.
    """
    links = {ring.link for ring in named_setup(PAPER_SETUPS[0]).rings}
    return tuple(PAPER_SETUPS) if links <= set(scene.robot.links) else ()


def papers(scene: Scene) -> dict[str, Setup]:
    """Return these layouts by name, with the scene's sensors."""
    return {name: layout_in(scene, name) for name in comparable(scene)}


def counted(
    verifier: Verifier,
    setups: Mapping[str, Setup],
    targets: Sequence[Target],
    sighted: Collection[Target],
    known: Mapping[tuple[str, Target], Verified],
    brief: Collection[str] = (),
) -> Iterator[Verified]:
    """Count ζ of each target for each setup.

    Args:
        verifier: counts voxels of the scene.
        setups: setups by name.
        targets: targets to count.
        sighted: targets for which ζ is counted under several models of occlusion.
        known: counts that exist already, by the setup's name and the target.
        brief: setups that are counted only under the scene's model and with a transparent robot,
            and whose blocked sensors are not sought.

    Yields:
        One result for each target and setup: goals target by target, then the others setup by
        setup.
    """
    scene, goals = verifier.scene, [g.target for g in verifier.scene.targets]
    clear = MountClearance(scene) if scene.real else None
    few = [model for model in OCCLUSIONS if model in (scene.occlusion, "ignore")]
    others = [target for target in targets if target not in goals]
    for some in [[target] for target in targets if target in goals] + [others] * bool(others):
        if some is others:  # their voxels are not needed any more after the comparison
            verifier = Verifier(scene, verifier.voxel, at=verifier.at)
        for name, one in setups.items():
            new = [target for target in some if (name, target) not in known]
            counts = dict(zip(new, verify_targets(verifier, one, new), strict=True))
            for target in some:
                verified = known.get((name, target)) or counts[target]
                result, more = verified.in_scene(name, scene), dict[str, Any]()
                if target in goals:
                    dark = verify_dark(verifier, one, target)
                    more["dark_clothing"] = None if dark is None else dark.zeta
                    if name not in brief:
                        more["by_part"] = by_part(verifier, one, verified)
                if target in sighted:
                    models = few if name in brief else OCCLUSIONS
                    counted = by_occlusion(verifier, one, verified, models).items()
                    more["by_occlusion"] = {m: v.zeta for m, v in counted}
                    more["by_occlusion_error"] = {
                        m: v.error for m, v in counted if v.error is not None
                    }
                    more["unseeing"] = () if name in brief else unseeing(scene, one)
                    result = result.with_mounting(mount_faults(scene, one, clear))
                if target in goals and name == next(iter(setups)):  # the others are for comparison
                    more["people"] = where_people_are(verifier, one, verified)
                    more["beyond"] = beyond_sensors(scene, target, besides=one)
                yield replace(result, **more)


def counted_beside_papers(
    verifier: Verifier,
    name: str,
    setup: Setup,
    counts: Sequence[Verified],
    progress: Callable[[int, int], None] | None,
) -> list[Verified]:
    """Count ζ of a setup and of the paper's layouts for the scene's targets; Ctrl-C ends the
    comparison and returns the finished counts.

    Args:
        verifier: counts voxels of the scene.
        name: name of the setup.
        setup: the setup, counted under all models of occlusion.
        counts: counts of the setup that exist already.
        progress: receives the number of counted poses, from 0, and the number of all.

    Returns:
        One record for each setup and target, target by target.
    """
    scene, verifier = verifier.scene, copy(verifier)
    targets, layouts = [goal.target for goal in scene.targets], papers(scene)
    setups = {name: setup} | layouts
    known = {(name, v.target): v for v in counts}
    records: list[Verified] = []
    done, total = 0, len(targets) * len(setups) * len(scene.poses)

    def tell(poses: int) -> None:
        nonlocal done
        done = poses
        if progress is not None:
            progress(done, total)

    verifier.at = lambda _: tell(min(done + 1, total))
    try:
        tell(0)
        for one in counted(verifier, setups, targets, targets, known, layouts):
            records.append(one)
            tell(len(records) * len(scene.poses))
    except KeyboardInterrupt:
        pass
    order = {t.key: i for i, t in enumerate(targets)}
    return sorted(records, key=lambda r: order[r.key])


def judged_beside_papers(
    scene: Scene, voxel: float | None, criterion: Criterion, own: Mapping[str, float]
) -> dict[str, float]:
    """Return a criterion in percent for the paper's layouts, after the values in [0, 1] of ``own``
    by name; Ctrl-C returns the finished values."""
    values = {name: 100 * value for name, value in own.items()}
    verifier = Verifier(scene, voxel)
    try:
        for name, one in papers(scene).items():
            values[name] = 100 * judge(verifier, one, criterion)[1]
    except KeyboardInterrupt:
        pass
    return values


def compared(scene: Scene) -> list[Target]:
    """Return the targets of a comparison: the goals and, for a few poses, the paper's targets."""
    goals = [g.target for g in scene.targets]
    common = [t for t in PAPER_TARGETS if all(r > scene.curve.robot_radius for r in t.radii)]
    return list(dict.fromkeys([*goals, *common] if len(scene.poses) <= _FEW_POSES else goals))
