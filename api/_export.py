"""Export of a setup to files for other programs."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

from ._arguments import whole
from ._errors import InputError, input_errors, new_files
from ._scene import Scene
from ._validation import SetupLike, resolve_setup
from .coverage.definitions.errors import shown
from .coverage.electronics.controllers import CONTROLLERS
from .coverage.electronics.electronics import Bus, Electronics
from .formats.firmware.wiring import plan_setup
from .formats.writing import write_bytes
from .objectives.scene import Scene as CoreScene


def formats_of(to: str | Sequence[str]) -> tuple[str, ...]:
    """Return the requested formats without duplicates.

    Raises:
        InputError: for no format, or an unknown one.
    """
    from .reporting.export_formats import FORMATS

    kinds = (to,) if isinstance(to, str) else tuple(dict.fromkeys(to))
    unknown = next((kind for kind in kinds if kind not in FORMATS), None)
    if unknown is not None or not kinds:
        raise InputError(f"found {shown(unknown)}, allowed: {', '.join(FORMATS)}", "to")
    return kinds


def electronics_of(core: CoreScene, board: str | None, wiring: str | None) -> Electronics:
    """Return the electronics of a scene, with another board or bus if they are stated.

    Raises:
        InputError: for an unknown board or bus.
    """
    given = {"controller": (board, CONTROLLERS, "board"), "bus": (wiring, get_args(Bus), "wiring")}
    for value, known, name in given.values():
        if value is not None and value not in known:
            raise InputError(f"found {shown(value)}, allowed: {', '.join(known)}", name)
    changes: dict[str, Any] = {
        key: value for key, (value, *_) in given.items() if value is not None
    }
    return replace(core.electronics, **changes)


def export(
    setup: SetupLike,
    scene: Scene | CoreScene | None = None,
    *,
    to: str | Sequence[str],
    folder: str | Path = "place-rings-export",
    pose: int = 0,
    urdf: str | Path | None = None,
    packages: Sequence[str | Path] = (),
    package: Mapping[str, str | Path] | None = None,
    points: int = 0,
    board: str | None = None,
    wiring: Bus | None = None,
    keep: Sequence[str | Path] = (),
) -> tuple[Path, ...]:
    """Write a setup as files for other programs: robot models with a frame for each sensor, a 3D
    scene, tables and scripts.

    Args:
        setup, scene: as in ``verify``.
        to: one format or several: urdf, mjcf, glb, csv, json, coppeliasim, ros2, mcap, stl,
            firmware.
        folder: output folder; created if it does not exist.
        pose: index of the scene's pose, from 0.
        urdf: the robot's own URDF, to which the sensors are added.
        packages: folders with the meshes of that URDF.
        package: folders of its packages by the packages' names, where the folders have others.
        points: number of points of each target in a GLB.
        board: controller board of each ring, for firmware: esp32-s3-devkitc-1, esp32-devkit, pico;
            None: that of the scene.
        wiring: how the sensors of a ring share its bus, for firmware: ``direct``, each XSHUT on a
            pin; ``multiplexer``, each sensor on a channel; ``auto``, direct where the bus bears it;
            None: that of the scene.
        keep: files that must not be overwritten, because they were inputs.

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
    from .formats.export.placed import PlacedSetup
    from .formats.robots.urdf import read_urdf
    from .reporting.export_formats import FORMATS

    kinds = formats_of(to)
    _, placed, core = resolve_setup(setup, scene)
    whole("pose", pose, 0)
    whole("points", points, 0)
    if not 0 <= pose < len(core.poses):
        last = len(core.poses) - 1
        allowed = f"0 to {last}, the scene's poses" if last else "0, the scene's only pose"
        raise InputError(f"found {pose}, allowed: {allowed}", "pose")
    core = replace(core, electronics=electronics_of(core, board, wiring))
    if "firmware" in kinds:
        with input_errors("wiring"):
            plan_setup(placed, core.electronics)
    out = Path(folder)
    with input_errors():
        robot = None if urdf is None else read_urdf(Path(urdf))
        folders = tuple(Path(p) for p in packages)
        named = {name: Path(path) for name, path in (package or {}).items()}
        what = PlacedSetup(core, placed, pose, out, robot, folders, named, points)
        files = {name: data for kind in kinds for name, data in FORMATS[kind](what).items()}
    given = [setup] if isinstance(setup, str | Path) else []
    read = {Path(p).resolve() for p in (*keep, *given, *([urdf] if urdf else []))}
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
    return tuple(out / name for name in files)
