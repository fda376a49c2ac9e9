"""Studies: one question for many inputs, measured once, with a page about all of them."""

import shlex
from collections.abc import Sequence
from pathlib import Path

from ._arguments import renamed
from ._errors import input_errors
from ._scene import Scene, core_scene
from ._study_arguments import (
    StudyName,
    StudyOptions,
    Told,
    check_machines,
    check_study,
    read_layouts,
    study_command,
    target_pair,
)
from ._study_runs import StudyReport, run_study
from ._targets import TargetVolume
from .objectives.scene import CoreScene


@renamed(time_cap="time")
def study(
    name: StudyName,
    *,
    folder: str | Path | None = None,
    seed: int = 0,
    targets: tuple[TargetVolume, TargetVolume] | None = None,
    sensors: int | None = None,
    scene: Scene | CoreScene | None = None,
    layouts: Sequence[str | Path] = (),
    time: float | None = None,
    quick: bool = False,
    workers: int = 1,
    scheduler: str | None = None,
    progress: Told | None = None,
) -> StudyReport:
    """Run a built-in study into a folder. It takes from minutes to hours.

    Each measurement is stored when it is done. A study that was interrupted resumes when it runs
    again with the same folder; Ctrl-C raises KeyboardInterrupt.

    Args:
        name: ``paper`` repeats the measurements of Kumar and Sahin (2019), ``pareto`` searches the
            front of two targets, ``bound`` computes upper bounds on any search's coverage,
            ``convergence`` measures ζ against the voxel, ``gap`` bounds every layout of a number of
            sensors, ``layouts`` scores published layouts, and ``robots`` measures the effect of
            self-occlusion on six robots.
        folder: output folder; by default ``results/NAME``.
        seed: random seed of searches and paths; ``convergence`` draws nothing.
        targets: the two targets of ``pareto``; by default V_S(0.5) and V_S(1.5). Weights do not
            matter.
        sensors: number of sensors of the front with most points in ``pareto``, 1 to 2000; 80 by
            default.
        scene: scene of ``pareto``; by default the reference scene.
        layouts: layout files (.csv, .toml) that ``layouts`` scores besides those of the package.
        time: processor time of each search of ``layouts``, s, above 0; 40 by default.
        quick: only the front of ``sensors`` in ``pareto``, with few and short searches: about two
            minutes for 24.
        workers: number of processes on this machine, 1 to 1024; 1 is this process.
        scheduler: address of a running dask scheduler that you trust (tcp://HOST:PORT), in place of
            ``workers``.
        progress: receives the heading of a part, the number of its finished measurements, and the
            number of all.

    Returns:
        The measurements and the folder.

    Raises:
        InfeasibleError: if the scene's rules admit no setup with these sensors.
        InputError: for an unknown study, or arguments that are out of range or cannot be combined.

    Example:
        >>> import place_rings as pr
        >>> try:
        ...     pr.study("paper", sensors=48)
        ... except pr.InputError as error:
        ...     print(error)
        sensors: found 48 with study paper, allowed: only with pareto
    """
    check_study(name, seed, targets, sensors, scene, layouts, time, quick)
    check_machines(workers, scheduler)
    core = CoreScene() if scene is None else core_scene(scene)
    own = [Path(file) for file in layouts]
    command = study_command(name, seed, own, time)
    if name == "pareto":
        command = [f"place_rings.study('pareto', ..., seed={seed})"]
    with input_errors():
        some = read_layouts(name, own)
    options = StudyOptions(
        *(seed, target_pair(targets), sensors, core, some, time, shlex.join(command)),
        quick=quick,
    )
    return run_study(name, folder, options, workers, scheduler, progress)
