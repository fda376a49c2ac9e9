"""Packages of Universal Robots' Real-Time Data Exchange, version 2, on the server's side
(big-endian).
"""

import re
import struct
from collections.abc import Collection, Mapping, Sequence

from ..robot.rtde_requests import HEAD as HEAD

VERSION, CONTROLLER, TEXT, OUTPUTS, INPUTS, START, PAUSE, DATA = b"VvMOISPU"
_CODES = {
    "DOUBLE": "d",
    "INT32": "i",
    "UINT32": "I",
    "UINT8": "B",
    "UINT64": "Q",
    "BOOL": "?",
    "VECTOR6D": "6d",
    "VECTOR3D": "3d",
}
_CODES |= {"VECTOR6INT32": "6i", "VECTOR6UINT32": "6I"}
_TYPES = (
    (
        r"timestamp|.*_double_register_\d+|speed_scaling|(target_speed|speed_slider)_fraction|.*_analog_output_\d",
        "DOUBLE",
    ),
    (
        r"actual_(momentum|(main|robot)_voltage|robot_current|execution_time)|standard_analog_(in|out)put\d|payload",
        "DOUBLE",
    ),
    (
        r"(actual|target)_(q|qd|qdd|current|moment|TCP_pose|TCP_speed|TCP_force)|joint_control_output",
        "VECTOR6D",
    ),
    (
        r"joint_temperatures|actual_joint_voltage|ft_raw_wrench|external_force_torque|payload_inertia",
        "VECTOR6D",
    ),
    (r"actual_tool_accelerometer|payload_cog", "VECTOR3D"),
    (r"robot_mode|safety_mode|.*_int_register_\d+", "INT32"),
    (r"joint_mode", "VECTOR6INT32"),
    (r"runtime_state|robot_status_bits|safety_status_bits|speed_slider_mask", "UINT32"),
    (r"actual_digital_(input|output)_bits", "UINT64"),
    (r".*_(mask|output)|standard_analog_output_type", "UINT8"),
)


def package(kind: int, data: bytes) -> bytes:
    """Return a package with its header."""
    return HEAD.pack(HEAD.size + len(data), kind) + data


def kind_of(name: str) -> str:
    """Return the type of a variable by the protocol's tables; NOT_FOUND for an unknown name."""
    return next((kind for names, kind in _TYPES if re.fullmatch(names, name)), "NOT_FOUND")


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
