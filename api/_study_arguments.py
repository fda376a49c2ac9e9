"""Options of studies, and the checks of a user's arguments."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

from ._arguments import number, whole
from ._errors import InputError
from .coverage.targets import Target
from .formats.layouts.layout import PublishedLayout
from .formats.optional_dependencies import require
from .objectives.scene import CoreScene

StudyName = Literal["bound", "convergence", "gap", "layouts", "paper", "pareto", "robots"]
Told = Callable[[str, int, int], None]

_MOST_WORKERS = 1024


@dataclass(frozen=True)
class StudyOptions:
    """Options of a study, except for its folder and its machines."""

    seed: int
    """Random seed."""
    targets: tuple[Target, Target]
    """The two targets of ``pareto``."""
    sensors: int | None
    """Number of sensors of the front with most points in ``pareto``."""
    scene: CoreScene
    """Scene of ``pareto``."""
    layouts: tuple[PublishedLayout, ...]
    """The layouts of ``layouts``."""
    time_cap: float | None
    """Processor time of each search of ``layouts``, s; None for the study's own."""
    command: str
    """The command that the page quotes."""
    quick: bool = False
    """Whether ``pareto`` searches a single front, with few and short searches."""


def check_study(
    name: str,
    seed: Any,
    targets: Any,
    sensors: Any,
    scene: Any,
    layouts: Any = (),
    time_cap: Any = None,
    quick: bool = False,
) -> None:
    """Check the arguments of a study.

    Raises:
        InputError: for an unknown study, or arguments that it does not take.
    """
    if name not in get_args(StudyName):
        raise InputError(f"found {name!r}, allowed: {', '.join(get_args(StudyName))}", "name")
    given = {"targets": targets, "sensors": sensors, "scene": scene, "quick": quick or None}
    for key, value in given.items():
        if value is not None and name != "pareto":
            raise InputError(f"found {value!r} with study {name}, allowed: only with pareto", key)
    if len(layouts) and name != "layouts":
        raise InputError(f"found some with study {name}, allowed: only with layouts", "layout")
    if time_cap is not None:
        if name != "layouts":
            raise InputError(
                f"found {time_cap:g} with study {name}, allowed: only with layouts", "time"
            )
        number("time", time_cap, "s, above 0")
        if not time_cap > 0:
            raise InputError(f"found {time_cap:g}, allowed: s, above 0", "time")
    whole("seed", seed, 0)
    if name == "convergence" and seed:
        raise InputError(
            f"found {seed} with study convergence, allowed: none, because it draws nothing", "seed"
        )
    if sensors is not None:
        whole("sensors", sensors, 1, 2000)


def study_command(
    name: str, seed: int, layouts: Sequence[Path] = (), time_cap: float | None = None
) -> list[str]:
    """Return the command that runs a study, for its page; layouts without their folders."""
    return [
        *("place-rings", "study", name),
        *(["--seed", str(seed)] if seed else []),
        *(part for file in layouts for part in ("--layout", file.name)),
        *([] if time_cap is None else ["--time", f"{time_cap:g}"]),
    ]


def read_layouts(name: str, own: Sequence[Path]) -> tuple[PublishedLayout, ...]:
    """Return the layouts of the study ``layouts``: those of the package, and the user's own; none
    for another study.

    Raises:
        UserError: if a file is not usable.
    """
    if name != "layouts":
        return ()
    from .studies.layouts import study

    return tuple(study.layouts(own))


def check_machines(workers: int, scheduler: str | None) -> None:
    """Check where a study shall run.

    Args:
        workers: number of processes on this machine.
        scheduler: address of a dask scheduler, or None.

    Raises:
        InputError: for both, or for an address of another form.
        UserError: if the libraries for them are not installed.
    """
    whole("workers", workers, 1, _MOST_WORKERS)
    if scheduler is not None and not re.fullmatch(r"(tcp|tls)://\S+:\d+", str(scheduler)):
        raise InputError(
            f"found {scheduler!r}, allowed: tcp://HOST:PORT or tls://HOST:PORT", "scheduler"
        )
    if scheduler is not None and workers != 1:
        raise InputError(
            f"found {workers} with scheduler, allowed: one of the two",
            "workers",
            others=("scheduler",),
        )
    if scheduler is not None or workers != 1:
        option = "--workers" if scheduler is None else "--scheduler"
        require("cluster", option, "dask", "distributed", "cryptography")


def target_pair(targets: Any) -> tuple[Target, Target]:
    """Return the two targets of a front; raise InputError for anything else."""
    if targets is None:
        return Target("V_S", 0.5), Target("V_S", 1.5)
    try:
        first, second = (volume.target for volume in targets)
    except (AttributeError, TypeError, ValueError) as error:
        raise InputError("found other values, allowed: two target volumes", "targets") from error
    if first == second:
        raise InputError(f"found {first} twice, allowed: two different targets", "targets")
    return first, second
