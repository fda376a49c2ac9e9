"""Print the coverage of a setup."""

from contextlib import ExitStack
from pathlib import Path
from typing import Any

from place_rings._validation import ResolvedSetup
from place_rings._verify import Coverage, VerifyCall, counted, proof_of

from ...coverage.definitions.definition import json_of
from ...coverage.definitions.errors import UserError
from ...coverage.detection.detection import Detection
from ...coverage.voxels.volume_tally import Bracket
from ...formats.writing import output_files, require_place, write_bytes
from ...objectives.options import VerifyOptions
from ...objectives.pose_workers import PoseWorkers
from ...objectives.scene import Scene
from ...objectives.verified import IntervalProof, Verified
from ...objectives.verify import VOXEL
from ...reporting.lines.detection import detection_lines, detection_table
from ...reporting.lines.occlusion import part_lines, print_sight, record_line, unmounted_lines
from ...reporting.lines.results import (
    calibration_lines,
    object_lines,
    protective_lines,
    record_lines,
    sensor_lines,
    worst_line,
)
from ...reporting.tables import (
    count_error_line,
    coverage_tables,
    percent,
    target_label,
)
from ...reporting.terminal import Terminal, say_json

_SHOWN = 16  # largest number of poses of which each is printed


def verify(
    subject: ResolvedSetup,
    options: VerifyOptions,
    question: Detection | None,
    certificate: Path | None,
    by_pose: Path | None,
    as_json: bool,
) -> None:
    """Print the coverage of a setup for the targets of its scene and, with a question of detection,
    its answer, and write the files, all of them or none."""
    if by_pose is not None and len(subject.scene.poses) < 2:
        raise UserError("--plot-by-pose: found one pose, allowed: several; add --trajectory FILE")
    if certificate and by_pose and certificate.resolve() == by_pose.resolve():
        raise UserError(
            f"--plot-by-pose: found {by_pose}, the file of --certificate, allowed: another"
        )
    for path in filter(None, (certificate, by_pose)):
        require_place(path.parent, path.name)  # before the work
    coverage = _counted(subject, options, question, certificate)
    results, new = list(coverage.records), dict[Path, bytes]()
    if certificate is not None:
        new[certificate] = proof_of(coverage)
    if by_pose is not None:
        new[by_pose] = coverage.plot_by_pose().png
    with ExitStack() as files:
        for path, data in new.items():
            folder = files.enter_context(output_files(path.parent, path.name, argument=""))
            write_bytes(folder / path.name, data)
    if as_json:
        say_json(json_of(results if len(results) > 1 else results[0]))
    else:
        _show(subject, options, results, certificate, by_pose)


def _show(
    subject: ResolvedSetup,
    options: VerifyOptions,
    results: list[Verified],
    certificate: Path | None,
    by_pose: Path | None,
) -> None:
    """Print the records as tables, and lines on what they mean."""
    console = Terminal()
    scene, setup, name = subject.scene, subject.setup, subject.name
    sensors, where = {name: setup.sensors}, f"{_place(scene)}, {_how(options)}"
    for table in coverage_tables(results, sensors, where):
        console.print(table)
    if (shares := detection_table(results)) is not None:
        console.print(shares)
    if options.rule == "sampled":
        console.lines(count_error_line(options.voxel or VOXEL))
    print_sight(console, results, results[0].unseeing, scene, unmounted_lines(results[:1]))
    console.lines(*part_lines(results))
    for r in results:
        if r.proof is not None:
            console.print(_proof_line(r, r.proof), soft_wrap=True)
        if 1 < len(scene.poses) <= _SHOWN:
            each = ", ".join(percent(p, r.rule) for p in r.poses)
            console.print(f"{target_label(r)} at each pose, in percent: {each}")
        console.lines(worst_line(r))
    effects = [r.calibration for r in results if r.calibration is not None]
    more = [*calibration_lines(results, effects), *sensor_lines(results[0].sensors)]
    more += [*record_lines(results), *object_lines(results)]
    more += detection_lines(results, scene, setup)
    if certificate is not None:
        more.append(f"Certificate: {certificate}; examples/certificate/check.py checks it.")
    if by_pose is not None:
        more.append(f"Coverage at each pose: {by_pose}")
    console.lines(record_line(scene), *protective_lines(results, setup), *more)


def _proof_line(result: Verified, proof: IntervalProof) -> str:
    """Return a line on the width and the cost of a certified interval."""
    width = 100 * (result.high - result.low)
    if proof.reached or proof.width == 0:
        verdict = f"guaranteed: width {width:.2g} points"
    else:
        verdict = f"guaranteed, but {width:.2g} points wide instead of {100 * proof.width:g}"
    return (
        f"{target_label(result)} {verdict}; {proof.passes} passes, {proof.cells:,} cells down to"
        f" {1000 * proof.smallest:.3g} mm, {result.seconds:.1f} s"
    )


def _counted(
    subject: ResolvedSetup,
    options: VerifyOptions,
    question: Detection | None,
    certificate: Path | None,
) -> Coverage:
    """Return the coverage and its records; a spinner on stderr shows the progress."""
    poses = len(subject.scene.poses)
    workers = PoseWorkers.of_motion(poses, options.workers)
    with Terminal(stderr=True).status("counting") as status, workers:

        def progress(there: Bracket | int) -> None:
            if isinstance(there, Bracket):
                share = f"{100 * there.low:.3f} … {100 * there.high:.3f} %"
                status.update(f"pass {there.passes}: {share}, {there.cells:,} cells")
            elif poses > 1:
                status.update(f"counting pose {there + 1} of {poses}")

        more: dict[str, Any] = {"detect": question, "certificate": certificate}
        coverage = counted(VerifyCall(subject, progress=progress, **more, **vars(options)))
        coverage.records  # noqa: B018  (counts under the other models of occlusion)
    return coverage


def _place(scene: Scene) -> str:
    """Return the robot and the occlusion model as text."""
    return f"robot {scene.robot.name}, occlusion {scene.occlusion}"


def _how(options: VerifyOptions) -> str:
    """Return the rule and the size of the voxels as text."""
    voxel = options.voxel or (None if options.certified else VOXEL)
    size = "" if voxel is None else f", voxels of {voxel:g} m"
    return f"rule {options.rule}{size}"
