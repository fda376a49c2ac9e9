"""Options of ``check``: which fit together, and the serial ports of the rings."""

import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from ...coverage.definitions.errors import UserError, shown
from ...coverage.rings.ring import Setup
from ...rig.check.options import CheckOptions, FileOptions, RigOptions
from ...rig.check.planned_check import ring_names
from ...rig.rings.firmware_decoders import DECODERS
from ...rig.rings.line_monitor import BAUD, Port

_RING = re.compile(r"(?P<name>[^=]+)=(?P<port>[^,]+)(,(?P<decoder>[^,]*))?(,(?P<baud>\d{2,8}))?")


_MOVES = {
    "--rig sim": "; a simulated robot moves without it",
    "--joints FILE": "; only ur-rtde moves a robot; files are only read",
}
_UNREAD = ("--plan-only", "--dry-run")
_EXTENT = ("wave", "seconds", "stops", "trials", "rod_mm")


def require_fit(
    rig: RigOptions,
    files: FileOptions,
    options: CheckOptions,
    where: Mapping[str, object],
    bag: bool,
) -> None:
    """Raise UserError unless a check has exactly one way to its data, and no option of another.

    Args:
        rig, files, options: the options.
        where: the options of the scene, by name; false where they are not given.
        bag: whether to write a bag.
    """
    ways = {
        "--rig sim": rig.rig is not None,
        "--robot-host HOST": rig.robot_host is not None,
        "--replay FILE": rig.replay is not None,
        "--joints FILE": files.joints is not None,
        "--plan-only": files.plan_only,
        "--dry-run": rig.dry_run,
    }
    given = [way for way, stated in ways.items() if stated]
    if len(given) != 1:
        raise UserError(f"check: give exactly one of {', '.join(ways)}")
    _require_needed(rig, files, options, given[0])
    if rig.robot_host == "":
        raise UserError('--robot-host: found "", allowed: a host name or an address')
    stated = [name for name, value in where.items() if value]
    if rig.replay is not None:
        stated += options.changed("seed", "voxel", "part", "scheduled", *_EXTENT)
        _refuse(stated, "--replay FILE, whose recording states it")
    if files.joints is not None:
        _refuse(
            options.changed(*_EXTENT), "--joints FILE: the files, or the plans of --plan, state it"
        )
    for name in options.changed("wave", "scheduled") if "self" not in options.parts else ():
        raise UserError(f"--{name}: allowed only with --part self, or without --part")
    if options.scheduled and given[0] in _UNREAD:
        raise UserError(f"--scheduled: not allowed with {given[0]}, which reads no ring")
    if options.injected == "late" and not options.scheduled:
        raise UserError("--injected late: allowed only with --scheduled")
    options.rod  # noqa: B018  (refuses a size that is none)
    if bag:
        from ...formats.export.ros2_bag import require_rosbags

        sources = ("--rig sim", "--robot-host HOST", "--replay FILE")
        if given[0] not in sources:
            raise UserError(
                "--bag: allowed only with --rig sim, --robot-host HOST or --replay FILE"
            )
        require_rosbags("--bag")


def _require_needed(rig: RigOptions, files: FileOptions, options: CheckOptions, way: str) -> None:
    """Raise UserError if an option is stated without the way, or the other option, that it
    needs."""
    moves = "--move" if options.move else ""
    for need, stated in (
        ("--robot-host HOST", {"ring": rig.ring, "move": options.move}),
        ("--joints FILE", {"readings": files.readings, "steps": files.steps, "map": files.names}),
        ("--joints FILE", {"plan": files.plan}),
        ("--rig sim", {"injected": options.injected != "random"}),
        ("--move", {"allow-reduced-near-stop": options.allow_reduced_near_stop}),
        ("--move", {"allow-differing-self-check": options.allow_differing_self_check}),
        ("--dry-run", {"no-browser": not rig.browser}),
    ):
        for option, value in stated.items() if need not in (way, moves) else ():
            if value:
                hint = _MOVES.get(way, "") * (option == "move")
                raise UserError(f"--{option}: allowed only with {need}{hint}")


def _refuse(names: Sequence[str], way: str) -> None:
    """Raise UserError about the first of the options that a way to the data excludes."""
    for name in names[:1]:
        raise UserError(f"--{name.replace('_', '-')}: not allowed with {way}")


def resolve_ports(setup: Setup, texts: Sequence[str]) -> list[Port]:
    """Return the ports of all rings from texts NAME=PORT[,DECODER[,BAUD]].

    Raises:
        UserError: if a ring is missing, named twice, or unknown.
    """
    names, ports = ring_names(setup), dict[str, Port]()
    for text in texts:
        match = _RING.fullmatch(text)
        if match is None:
            raise UserError(
                f"--ring: found {shown(text)}, allowed: NAME=PORT[,DECODER[,BAUD]], like"
                " tool=/dev/ttyUSB0"
            )
        name, decoder = match["name"], match["decoder"] or "place-rings"
        if name not in names and name.isdecimal() and int(name) < len(names):
            name = names[int(name)]
        if name not in names or name in ports:
            left = [n for n in names if n not in ports]
            raise UserError(
                f"--ring: found {shown(name)}, allowed: each ring once; still without a port:"
                f" {', '.join(left) or 'none'}"
            )
        if decoder not in DECODERS:
            raise UserError(
                f"--ring {text}: found decoder {shown(decoder)}, allowed: {', '.join(DECODERS)}"
            )
        count = setup.groups[names.index(name)].count
        ports[name] = Port(
            name=match["port"], count=count, decoder=decoder, baud=int(match["baud"] or BAUD)
        )
    if missing := [n for n in names if n not in ports]:
        raise UserError(
            f"--ring: no port for {', '.join(missing)}; add --ring NAME=PORT for each of them"
        )
    return [ports[n] for n in names]


def check_ports(setup: Setup, ports: Sequence[Port]) -> None:
    """Check that all ports exist, that the user may read and write them, and that each is given
    once, by whatever name.

    Raises:
        UserError: if not.
    """
    owners = dict[str, str]()
    for name, port in zip(ring_names(setup), ports, strict=True):
        if os.name == "posix" and not Path(port.name).exists():
            raise UserError(
                f"--ring {name}: port {shown(port.name)} does not exist; give one that does, like"
                " /dev/ttyUSB0"
            )
        if os.name == "posix" and not os.access(port.name, os.R_OK | os.W_OK):
            raise UserError(
                f"--ring {name}: no right to read and write port {shown(port.name)}; join the group"
                " that owns it"
            )
        other = owners.setdefault(os.path.realpath(port.name), name)
        if other != name:
            raise UserError(
                f"--ring {name}: port {shown(port.name)} is that of {other}; give each ring a port"
                " of its own"
            )
