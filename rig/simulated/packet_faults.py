"""Fault injection into the robot's data packages."""

import struct
from collections.abc import Callable

import numpy as np

from .rtde import HEAD

Spoiler = Callable[[np.random.Generator], Callable[[bytes], bytes]]
_FIRST = HEAD.size + 1  # first byte of the joints, with which the toolkit's recipe begins


def _resized(data: bytes) -> bytes:
    return HEAD.pack(len(data), data[HEAD.size - 1]) + data[HEAD.size :]


def _short(rng: np.random.Generator) -> Callable[[bytes], bytes]:
    """Truncate packages, with a matching length in their header."""
    return lambda data: _resized(data[: int(rng.integers(HEAD.size + 1, len(data)))])


def _once_short(rng: np.random.Generator) -> Callable[[bytes], bytes]:
    """Truncate one package."""
    shorten = iter([_short(rng)])
    return lambda data: next(shorten, bytes)(data)


def _with_joint(data: bytes, joint: int, value: float) -> bytes:
    place = _FIRST + 8 * joint
    return data[:place] + struct.pack(">d", value) + data[place + 8 :]


def _garbage(rng: np.random.Generator) -> Callable[[bytes], bytes]:
    """Replace joints by random bytes."""
    return lambda data: data[:_FIRST] + rng.bytes(48) + data[_FIRST + 48 :]


def _jump(rng: np.random.Generator) -> Callable[[bytes], bytes]:
    """Let a joint jump by 2 to 60 degrees."""
    joint, by = int(rng.integers(6)), float(np.radians(rng.uniform(2, 60)) * rng.choice([-1, 1]))
    return lambda data: _with_joint(
        data, joint, struct.unpack_from(">d", data, _FIRST + 8 * joint)[0] + by
    )


def _nan(rng: np.random.Generator) -> Callable[[bytes], bytes]:
    """Replace a joint by nan."""
    joint = int(rng.integers(6))
    return lambda data: _with_joint(data, joint, float("nan"))


def _frozen_clock(rng: np.random.Generator) -> Callable[[bytes], bytes]:
    """Repeat the same package forever."""
    kept = dict[str, bytes]()
    return lambda data: kept.setdefault("first", data)


def _late(rng: np.random.Generator) -> Callable[[bytes], bytes]:
    """Delay packages more and more: of three due packages, one is sent, the oldest."""
    queue = list[bytes]()

    def spoil(data: bytes) -> bytes:
        queue.append(data)
        return b"" if len(queue) % 3 else queue[len(queue) // 3 - 1]

    return spoil


SPOILERS: dict[str, Spoiler] = {
    "short": _short,
    "once short": _once_short,
    "garbage": _garbage,
    "jump": _jump,
    "nan": _nan,
    "frozen clock": _frozen_clock,
    "late": _late,
}
