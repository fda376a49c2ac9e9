"""Packages of Universal Robots' Real-Time Data Exchange, version 2, on the server's side
(big-endian).
"""

import re
import struct
from collections.abc import Collection, Mapping, Sequence

from ..robot.rtde_requests import HEAD as HEAD

VERSION, CONTROLLER, TEXT, OUTPUTS, INPUTS, START, PAUSE, DATA = b"VvMOISPU"
_CODES = {"DOUBLE": "d", "INT32": "i", "UINT32": "I", "VECTOR6D": "6d"}
# of the variables that ur-rtde requests
_TYPES = {"timestamp": "DOUBLE", "robot_mode": "INT32"}
_TYPES |= dict.fromkeys(("runtime_state", "robot_status_bits", "safety_status_bits"), "UINT32")
_TYPES |= dict.fromkeys(("actual_q", "actual_qd", "external_force_torque"), "VECTOR6D")
_REGISTERS = re.compile(r"(?:in|out)put_(int|double)_register_\d+")


def package(kind: int, data: bytes) -> bytes:
    """Return a package with its header."""
    return HEAD.pack(HEAD.size + len(data), kind) + data


def kind_of(name: str) -> str:
    """Return the type of a variable by the protocol's tables; NOT_FOUND for an unknown name."""
    if register := _REGISTERS.fullmatch(name):
        return {"int": "INT32", "double": "DOUBLE"}[register[1]]
    return _TYPES.get(name, "NOT_FOUND")


def refused(names: Sequence[str], held: Collection[str]) -> bytes:
    """Return the answer to a request for a recipe of inputs some of which another client holds."""
    return b"\0" + ",".join("IN_USE" if n in held else kind_of(n) for n in names).encode()


class Recipe:
    """Names of the variables in a data package."""

    def __init__(self, number: int, names: Sequence[str]) -> None:
        self.number = number
        self.names = tuple(names)
        self.types = [kind_of(name) for name in names]
        self._layout = struct.Struct(">B" + "".join(_CODES.get(kind, "") for kind in self.types))

    @property
    def answer(self) -> bytes:
        """Return the answer to a request for the recipe."""
        return bytes([self.number]) + ",".join(self.types).encode()

    def pack(self, values: Mapping[str, float | int | Sequence[float]]) -> bytes:
        """Encode a package's data; variables without a value are 0."""
        flat: list[float | int] = []
        for name, kind in zip(self.names, self.types, strict=True):
            code = _CODES[kind]
            value = values.get(name, [0] * int(code[0]) if code[0].isdigit() else 0)
            flat += list(value) if isinstance(value, Sequence) else [value]
        return self._layout.pack(self.number, *flat)

    def unpack(self, data: bytes) -> dict[str, float | int]:
        """Decode a package of inputs, whose types are single numbers."""
        if len(data) != self._layout.size:
            return {}
        return dict(zip(self.names, self._layout.unpack(data)[1:], strict=True))
