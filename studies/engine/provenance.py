"""Provenance of a results page: the code that measured it, the machine, and the machine's load.

A record lies beside each page as JSON. It holds a digest of each module that the measurement can
reach (its import closure) and of each data file that these modules name, so that anyone can list
later what has changed since. Reading and comparing records imports no numerical library.
"""

import hashlib
import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, datetime
from importlib.metadata import packages_distributions, version
from pathlib import Path
from typing import Any, Literal, get_args

import psutil

from .digest import library_versions
from .import_closure import ImportGraph, read_code, sha256

BUSY = 0.3  # load per core above which a page says that the machine was busy
FILE = "provenance.json"  # beside the README.md of a study
_DIGITS = 12  # of the digest of a file
_FORMAT = 1

Kind = Literal["measured", "reconstructed", "unrecorded"]


class ProvenanceError(ValueError):
    """Raised for a record that is broken."""


@dataclass(frozen=True)
class MeasurementRun:
    """One run that contributed measurements to a page."""

    ended: str
    """Day and time of its end, UTC."""
    commit: str | None
    """Commit of the checkout; None outside one."""
    changed: list[str]
    """Files that differed from the commit among those that the measurement can reach."""
    machine: str
    """Processor, cores, Python."""
    libraries: dict[str, str]
    """Version of each library that the code imports."""
    seconds: float
    """Wall time, s."""
    load_before: float
    """Load average of the last minute per core before the run."""
    load_after: float
    """The same after the run, which includes the run itself."""
    others: float
    """Mean share of each core that other processes used during the run, 0 to 1."""
    reused: int = 0
    """Number of measurements that earlier runs of the same code had stored."""

    @property
    def busy(self) -> bool:
        """Whether other work kept the machine busy before or during the run."""
        return max(self.load_before, self.others) > BUSY


@dataclass(frozen=True)
class Provenance:
    """How a page was measured, and the code that measured it."""

    command: str
    """Command that measures the page again."""
    sources: list[str]
    """Files whose import closure measures the page."""
    kind: Kind = "measured"
    """``measured``: written by the measurement; ``reconstructed``: computed later from the tree of
    ``commit``, the last at which the figures changed, so they are not newer than it;
    ``unrecorded``: measured before records were kept."""
    commit: str | None = None
    """The commit of a reconstructed record."""
    files: dict[str, str] = field(default_factory=dict)
    """Digest of each module, without comments and docstrings, and of each data file."""
    inputs: list[str] = field(default_factory=list)
    """Files that the command names, which count as the code does."""
    runs: list[MeasurementRun] = field(default_factory=list)
    """The runs that measured the page; several if it was resumed."""

    @property
    def digest(self) -> str:
        """Digest of all files."""
        return sha256("\n".join(f"{k} {v}" for k, v in sorted(self.files.items())))[:16]

    def changes(self, files: Mapping[str, str]) -> list[str]:
        """Return the names of files that are different, new or gone in ``files``."""
        names = sorted({*self.files, *files})
        return [name for name in names if self.files.get(name) != files.get(name)]

    def to_json(self) -> str:
        """Return the record as text."""
        record = {"format": _FORMAT, "digest": self.digest, **asdict(self)}
        return json.dumps(record, indent=1, ensure_ascii=False) + "\n"


def from_json(text: str) -> Provenance:
    """Read a record.

    Raises:
        ProvenanceError: if it is broken.
    """
    try:
        data: dict[str, Any] = json.loads(text)
        if (found := data.pop("format", None)) != _FORMAT:
            raise ProvenanceError(f"format: found {found!r}, allowed: {_FORMAT}")
        digest, runs = data.pop("digest", None), [MeasurementRun(**run) for run in data.pop("runs")]
        record = Provenance(**data, runs=runs)
    except (json.JSONDecodeError, AttributeError, KeyError, TypeError) as error:
        raise ProvenanceError(f"found no record of a measurement ({error})") from error
    if record.kind not in get_args(Kind):
        raise ProvenanceError(f"kind: found {record.kind!r}, allowed: {', '.join(get_args(Kind))}")
    if digest != record.digest:
        raise ProvenanceError(f"digest: found {digest}, its files have {record.digest}")
    if (record.kind != "unrecorded") != bool(record.files and record.sources):
        raise ProvenanceError("files and sources: found none, allowed: those of the measurement")
    if (record.kind == "measured") != bool(record.runs):
        raise ProvenanceError("runs: only a measured page has them, and at least one")
    return record


def digests(
    sources: Iterable[Path], graph: ImportGraph, inputs: Iterable[Path] = ()
) -> dict[str, str]:
    """Return the digest of each file that ``sources`` can reach, and of ``inputs``, by its name."""
    closure = graph.closure(sources)
    found = {graph.name(file): read_code(file.read_bytes()).form[:_DIGITS] for file in closure}
    for file in (*graph.inputs(closure), *inputs):
        found[graph.name(file)] = hashlib.sha256(file.read_bytes()).hexdigest()[:_DIGITS]
    return dict(sorted(found.items()))


class OtherWork:
    """The work of other processes since the object was made."""

    def __init__(self, cores: Sequence[int] | None = None) -> None:
        """Watch these cores, on which this process stays; by default all."""
        self._cores = cores
        self._start, self._used = time.monotonic(), _used(cores) - _own()

    @property
    def seconds(self) -> float:
        """Wall time since then, s."""
        return time.monotonic() - self._start

    def share(self) -> float:
        """Return the mean share of each core that other processes used, 0 to 1. A child of this
        process counts as another one until it has ended.
        """
        used = max(_used(self._cores) - _own() - self._used, 0.0)
        cores = _cores() if self._cores is None else len(self._cores)
        return min(used / max(self.seconds, 1e-3) / cores, 1.0)


class MeasurementRecorder:
    """A running measurement: create it before, and call ``record`` after."""

    def __init__(self, command: str, sources: Sequence[Path], inputs: Sequence[Path] = ()) -> None:
        """Read load and clocks, and the code, which may change while it runs.

        Args:
            command: command that measures the page again.
            sources: files whose import closure measures the page.
            inputs: data files that the command names.
        """
        self.command, self._graph = command, ImportGraph()
        self._sources = [file.resolve() for file in sources]
        self._load, self._other = _load_per_core(), OtherWork()
        self._inputs = [file.resolve() for file in inputs]
        self._files = digests(self._sources, self._graph, self._inputs)
        self.measured, self.reused = 0, 0

    def count(self, measured: int, reused: int) -> None:
        """Count measurements of this run, and those that earlier runs had stored."""
        self.measured, self.reused = self.measured + measured, self.reused + reused

    def record(self, earlier: Path | None = None) -> Provenance:
        """Return the record of the measurement.

        Args:
            earlier: record of earlier runs; its runs are kept if the code is the same. This run
                joins them unless it measured nothing.
        """
        closure = self._graph.closure(self._sources)
        commit, changed = _commit(self._graph.root, self._files, self._graph, closure)
        run = MeasurementRun(
            datetime.now(UTC).strftime("%Y-%m-%d %H:%M"),
            commit,
            changed,
            machine(),
            _distributions(closure),
            round(self._other.seconds, 1),
            round(self._load, 2),
            round(_load_per_core(), 2),
            round(self._other.share(), 2),
            self.reused,
        )
        names, given = (
            [self._graph.name(file) for file in some] for some in (self._sources, self._inputs)
        )
        record = Provenance(self.command, names, files=self._files, inputs=given, runs=[run])
        before = _runs_of(earlier, record.digest) if earlier is not None else []
        idle = before and self.reused and not self.measured
        return replace(record, runs=before if idle else [*before, run])


def machine() -> str:
    """Return processor, cores and Python version."""
    return (
        f"{platform.system()} {platform.machine()}, {_cores()} cores,"
        f" Python {platform.python_version()}"
    )


def sentences(record: Provenance, file: str) -> str:
    """Return how a page was measured, for readers.

    Args:
        record: its record.
        file: file with the record, as the page names it.
    """
    if record.kind == "unrecorded":
        return "Measured before records of code, machine and load were kept."
    code = f"{len(record.files)} files with the digest `{record.digest}` ([record]({file}))"
    if record.kind == "reconstructed":
        return (
            f"Measured before records were kept; its figures are not newer than commit"
            f" `{str(record.commit)[:12]}`, whose code can reach {code}. The machine's load was"
            " not recorded."
        )
    runs, last = record.runs, record.runs[-1]
    libraries = ", ".join(f"{name} {number}" for name, number in last.libraries.items())
    before = max(run.load_before for run in runs)
    after, others = max(run.load_after for run in runs), max(run.others for run in runs)
    commit = "outside a checkout" if last.commit is None else f"at commit `{last.commit[:12]}`"
    dirty = f" with changes to {len(last.changed)} files" if last.changed else ""
    several = "" if len(runs) == 1 else f" in {len(runs)} runs (largest loads given)"
    text = (
        f"Measured {commit}{dirty}, {last.ended} UTC{several}, on {last.machine}; {libraries}. The"
        f" code that it can reach is {code}. Load per core: {before:.2f} before, {after:.2f} after"
        f" (this run included); other processes used {100 * others:.0f} % of each core meanwhile."
    )
    if len(runs) == 1 and last.reused:
        text += f" {last.reused} measurements were stored by earlier runs of the same code."
    if any(run.busy for run in runs):
        text += (
            f" **The machine was busy** (load per core above {BUSY:g}): times on this page are too"
            " long, and ratios of times uncertain."
        )
    return text


def _runs_of(earlier: Path, digest: str) -> list[MeasurementRun]:
    """Return the runs of a record with this digest; none without such a record."""
    try:
        record = from_json(earlier.read_text("utf-8"))
    except (OSError, ProvenanceError):
        return []
    return record.runs if record.digest == digest else []


def _cores() -> int:
    return os.cpu_count() or 1


def _load_per_core() -> float:
    one_minute: float = psutil.getloadavg()[0]
    return one_minute / _cores()


def _used(cores: Sequence[int] | None) -> float:
    """Return the processor seconds that all processes have used, on some cores or on all."""
    each = psutil.cpu_times(percpu=True)
    some = each if cores is None else [each[core] for core in cores]
    return sum(float(now.user + now.system + getattr(now, "nice", 0.0)) for now in some)


def _own() -> float:
    """Return the processor seconds of this process and its ended children."""
    return sum(os.times()[:4])


def _commit(
    root: Path, files: Mapping[str, str], graph: ImportGraph, closure: Iterable[Path]
) -> tuple[str | None, list[str]]:
    """Return the checkout's commit, and the files of the closure that differ from it."""
    git = ["git", "-C", str(root)]
    try:
        head = subprocess.run(
            [*git, "rev-parse", "HEAD"], capture_output=True, text=True, check=True
        ).stdout.strip()
        status = subprocess.run(
            [*git, "status", "--porcelain", "--no-renames"],
            capture_output=True,
            text=True,
            check=True,
        ).stdout
    except (OSError, subprocess.CalledProcessError):
        return None, []
    if not (root / ".git").exists():  # an installation below another project's checkout
        return None, []
    changed = {root / line[3:].strip('"') for line in status.splitlines()}
    reached = {*closure, *graph.inputs(closure)}
    return head, sorted(graph.name(file) for file in reached & changed)


def _distributions(closure: Iterable[Path]) -> dict[str, str]:
    """Return the versions of place-rings and of all libraries that the code imports."""
    found = {"place-rings": version("place-rings")}
    owners = packages_distributions()
    for name, number in library_versions(closure):
        if number is None and (owner := owners.get(name)):
            name, number = owner[0], version(owner[0])
        if number is not None and name not in sys.stdlib_module_names:
            found[name] = number
    return found
