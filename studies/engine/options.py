"""The options of a study: defined once, for Python and the command."""

import re
from dataclasses import dataclass
from typing import Annotated, Literal

from ...coverage.definitions.errors import InputError
from ...coverage.definitions.options import Options, Seconds, Seed, Whole

StudyName = Literal[
    "benchmark", "bound", "convergence", "detection", "gap", "layouts", "paper", "pareto", "robots"
]
_ADDRESS = re.compile(r"(tcp|tls)://\S+:\d+")
_DRAWLESS = ("benchmark", "convergence")
_ONLY = {"pareto": ("targets", "sensors", "scene", "quick"), "layouts": ("layouts", "time")}


@dataclass(frozen=True, kw_only=True)
class StudyOptions(Options):
    """Options of a study."""

    sensors: Annotated[int | None, Whole(1, 2000)] = None
    """pareto: number of sensors whose front is computed most finely; those of 24, 48, 80 and 112
    follow with fewer points. Default: 80."""
    time: Seconds = None
    """layouts: processor time of each search in seconds. Default: 40."""
    quick: bool = False
    """pareto: only the front of ``sensors``, with few and short searches: about two minutes for
    24."""
    seed: Seed = 0
    """Random seed of searches and paths; the same seed gives the same figures. benchmark and
    convergence draw nothing."""
    workers: Annotated[int, Whole(1, 1024)] = 1
    """Number of processes on this machine; above 1 it needs the cluster extra."""
    scheduler: str | None = None
    """Address of a running dask scheduler that you trust (tcp://HOST:PORT), in place of
    ``workers``."""

    def __post_init__(self) -> None:
        """Raise InputError for values out of range, or processes of two kinds."""
        super().__post_init__()
        if self.scheduler is None:
            return
        if not _ADDRESS.fullmatch(str(self.scheduler)):
            allowed = "tcp://HOST:PORT or tls://HOST:PORT"
            raise InputError(f"found {self.scheduler!r}, allowed: {allowed}", "scheduler")
        if self.workers != 1:
            both = f"found {self.workers} with scheduler, allowed: one of the two"
            raise InputError(both, "workers", others=("scheduler",))

    def check(self, name: str) -> None:
        """Raise InputError for an option that the study of this name does not take."""
        for only, keys in _ONLY.items():
            for key in keys if name != only else ():
                if (value := getattr(self, key, None)) not in (None, False, ()):
                    stated = f"{value}" if isinstance(value, int | float) else "some"
                    line = f"found {stated} with study {name}, allowed: only with {only}"
                    raise InputError(line, key)
        if name in _DRAWLESS and self.seed:
            line = f"found {self.seed} with study {name}, allowed: none, because it draws"
            raise InputError(f"{line} nothing", "seed")
