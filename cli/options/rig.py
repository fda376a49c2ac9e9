"""Options of ``check``: serial ports of the rings, and size of the test rod."""

import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from ...coverage.rings.ring import Setup
from ...formats.errors import UserError, shown
from ...formats.optional_dependencies import require
from ...rig.check.models import PortModel
from ...rig.check.planned_check import ring_names
from ...rig.rings.firmware_decoders import DECODERS
from ...rig.rings.line_monitor import BAUD
from ...rig.rod.rod import Rod

_RING = re.compile(r"(?P<name>[^=]+)=(?P<port>[^,]+)(,(?P<decoder>[^,]*))?(,(?P<baud>\d{2,8}))?")
_ROD = re.compile(r"(?P<thick>\d+(\.\d+)?)x(?P<long>\d+(\.\d+)?)")


def check_way(ways: Mapping[str, object], needs: Mapping[str, Mapping[str, object]]) -> None:
    """Check that a check has one way to its data, and no option of another way.

    Args:
        ways: the value of each way's option, None where it is not given.
        needs: the values of further options by the way that they need.

    Raises:
        UserError: if not.
    """
    given = [way for way, value in ways.items() if value is not None]
    if len(given) != 1:
        raise UserError(f"check: give exactly one of {', '.join(ways)}")
    for way, options in needs.items():
        for option, value in options.items() if way != given[0] else ():
            if value:
                hint = ""
                if option == "move":
                    moves = {
                        "--rig sim": "a simulated robot moves without it",
                        "--joints FILE": "only ur-rtde moves a robot; files are only read",
                    }
                    hint = f"; {moves[given[0]]}" if given[0] in moves else ""
                raise UserError(f"--{option}: allowed only with {way}{hint}")


def resolve_ports(setup: Setup, texts: Sequence[str]) -> list[PortModel]:
    """Return the ports of all rings from texts NAME=PORT[,DECODER[,BAUD]].

    Raises:
        UserError: if a ring is missing, named twice, or unknown.
    """
    names, ports = ring_names(setup), dict[str, PortModel]()
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
        ports[name] = PortModel(
            name=match["port"], count=count, decoder=decoder, baud=int(match["baud"] or BAUD)
        )
    if missing := [n for n in names if n not in ports]:
        raise UserError(
            f"--ring: no port for {', '.join(missing)}; add --ring NAME=PORT for each of them"
        )
    return [ports[n] for n in names]


def check_ports(setup: Setup, ports: Sequence[PortModel]) -> None:
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


def resolve_rod(text: str) -> Rod:
    """Return the rod of a text THICKNESSxLENGTH in mm, such as 70x370."""
    match = _ROD.fullmatch(text)
    thick, long = (float(match["thick"]), float(match["long"])) if match else (0.0, 0.0)
    if not 1 <= thick <= long <= 5000:
        raise UserError(
            f"--rod-mm: found {shown(text)}, allowed: THICKNESSxLENGTH in mm, 1 to 5000, like"
            " 70x370"
        )
    return Rod(thick / 2000, (long - thick) / 1000)


def check_installed() -> None:
    """Check that the libraries of the rig are installed.

    Raises:
        UserError: if not; the message says how to install them.
    """
    require("rig", "check", "rtde_receive", "rtde_control", "serial")
