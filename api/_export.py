"""Export of a setup to files for other programs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ._arguments import refuse_without_urdf
from ._errors import InputError, input_errors, new_files
from ._options import called_with
from ._validation import SetupCall, resolve_setup
from .coverage.definitions.errors import shown
from .coverage.robots.base_frame import check_base_frame
from .formats.export.options import ExportOptions
from .formats.firmware.wiring import plan_setup
from .formats.writing import write_bytes

_OF_KIND = {
    **{"points": "glb", "readings": "mcap"},
    **dict.fromkeys(("board", "wiring", "scheduled"), "firmware"),
}
"""Options that one format alone has."""


@dataclass(frozen=True)
class ExportCall(ExportOptions, SetupCall):
    """A call of ``export``."""

    to: str | Sequence[str] = field(kw_only=True)
    """One format or several: urdf, mjcf, usd, sdf, glb, csv, json, coppeliasim, ros2, mcap, stl,
    firmware."""
    folder: str | Path = field(default="place-rings-export", kw_only=True)
    """Output folder; created if it does not exist."""
    urdf: str | Path | None = field(default=None, kw_only=True)
    """The robot's own URDF or xacro file, to which the sensors are added; or its name in
    robot_descriptions."""
    packages: Sequence[str | Path] = field(default=(), kw_only=True)
    """Folders with the meshes of that URDF."""
    package: Mapping[str, str | Path] | None = field(default=None, kw_only=True)
    """Folders of its packages by the packages' names, where the folders have others."""
    xacro_args: Mapping[str, str] | None = field(default=None, kw_only=True)
    """Values of a xacro file's arguments by name."""
    keep: Sequence[str | Path] = field(default=(), kw_only=True)
    """Files that must not be overwritten, because they were inputs."""

    @property
    def kinds(self) -> tuple[str, ...]:
        """The formats without duplicates.

        Raises:
            InputError: for no format, an unknown one, or an option of another one.
        """
        from .reporting.export_formats import FORMATS

        kinds = (self.to,) if isinstance(self.to, str) else tuple(dict.fromkeys(self.to))
        unknown = next((kind for kind in kinds if kind not in FORMATS), None)
        if unknown is not None or not kinds:
            raise InputError(f"found {shown(unknown)}, allowed: {', '.join(FORMATS)}", "to")
        for name, kind in _OF_KIND.items():
            if kind not in kinds and (given := getattr(self, name)) not in (None, False, 0):
                line = f"found {shown(given)}, allowed: only with to {kind}"
                raise InputError(line, name, others=("to",))
        refuse_without_urdf(self, "xacro_args")
        return kinds


@called_with(ExportCall)
def export(call: ExportCall) -> tuple[Path, ...]:
    """Write a setup as files for other programs: robot models with a frame for each sensor, a 3D
    scene, tables and scripts.

    Returns:
        The paths of the files.

    Raises:
        InputError: for an unknown format or board, a pose that the scene does not have, a ring
            whose sensors no firmware reads or no bus bears, or a folder that cannot be written.

    Example:
        >>> import place_rings as pr, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     print([file.name for file in pr.export("n1_8_0", to="csv", folder=folder)])
        ['sensors.csv']
    """
    return exported(call)[0]


def exported(call: ExportCall) -> tuple[tuple[Path, ...], list[str]]:
    """Write the files of ``export``; return their paths, and notes."""
    from .formats.export.placed import PlacedSetup
    from .formats.robots.urdf_options import UrdfOptions
    from .reporting.export_formats import FORMATS, export_notes

    kinds, pose, urdf = call.kinds, call.pose, call.urdf
    _, placed, core = resolve_setup(call.setup, call.scene)
    if pose >= len(core.poses):
        last = len(core.poses) - 1
        allowed = f"0 to {last}, the scene's poses" if last else "0, the scene's only pose"
        raise InputError(f"found {pose}, allowed: {allowed}", "pose")
    chosen = {"controller": call.board, "bus": call.wiring}
    changes: dict[str, Any] = {key: value for key, value in chosen.items() if value is not None}
    core = replace(core, electronics=replace(core.electronics, **changes))
    notes = list[str]()
    if "firmware" in kinds:
        with input_errors("wiring"):
            notes = [ring.note for ring in plan_setup(placed, core.electronics) if ring.note]
    out = Path(call.folder)
    check_base_frame(core.robot, call.base_frame)
    with input_errors():
        reading = UrdfOptions(
            packages=call.packages, package=call.package or {}, xacro_args=call.xacro_args or {}
        )
        file = None
        if urdf is not None:
            file, reading = reading.located(urdf)
        robot = None if file is None else reading.read(file)
        folders = tuple(Path(p) for p in reading.packages)
        named = {name: Path(path) for name, path in reading.package.items()}
        given = folders, named, call.points, call.readings, call.base_frame, call.scheduled
        what = PlacedSetup(core, placed, pose, out, robot, *given)
        notes += export_notes(what, kinds)
        files = {name: data for kind in kinds for name, data in FORMATS[kind](what).items()}
    own = [call.setup] if isinstance(call.setup, str | Path) else []
    read = {Path(p).resolve() for p in (*call.keep, *own, *([file] if file else []))}
    for name in files:
        if (out / name).resolve() in read:
            raise InputError(
                f"found {shown(str(out / name))}, an input file; allowed: another folder",
                "folder",
            )
    with new_files(out, *files) as new:
        for name, data in files.items():
            (new / name).parent.mkdir(parents=True, exist_ok=True)
            write_bytes(new / name, data)
    return tuple(out / name for name in files), notes
