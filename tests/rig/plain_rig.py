"""A controller and two rings, written from the tables of their protocols; it shares no code with
the package.

The controller has the interfaces that ur-rtde 1.6 uses: data exchange (RTDE, version 2; the guide
of Universal Robots), dashboard, script and primary port. Of the script it runs only what ur-rtde
asks by its registers: joint motions, stops and the watchdog. The arm follows trapezoidal profiles.
The rings send frames as in docs/rig.md. Their distances are made up: they follow the joint angles
smoothly and show no cell.

Run: python plain_rig.py ADDRESS FOLDER RING,... JOINT,...
     for example 127.0.0.9 rings 8,6 0,-1.57,1.57,0,0,0

It prints "open" once it listens; the rings are the links FOLDER/ring0, FOLDER/ring1, ...
"""

import asyncio
import math
import os
import pty
import random
import struct
import sys
import time
import tty
import zlib
from contextlib import suppress
from pathlib import Path

from plain_arm import PERIOD, Arm

FRAMES = 15  # a second
# Denavit-Hartenberg parameters of a UR10, as Universal Robots publishes them: m and rad
D, A = (0.1273, 0, 0, 0.163941, 0.1157, 0.0922), (0, -0.612, -0.5723, 0, 0, 0)
ALPHA = (math.pi / 2, 0, 0, math.pi / 2, -math.pi / 2, 0)
ANSWERS = {
    "polyscopeversion": "URSoftware 3.15.8.106339 (Dec 21 2021)",
    "get robot model": "UR10",
    "get serial number": "2016300001",
    "robotmode": "Robotmode: RUNNING",
    "safetymode": "Safetymode: NORMAL",
    "is in remote control": "true",
}
KINDS = {"timestamp": "DOUBLE", "speed_scaling": "DOUBLE", "robot_mode": "INT32"}
KINDS |= dict.fromkeys(("runtime_state", "robot_status_bits", "safety_status_bits"), "UINT32")
KINDS |= dict.fromkeys(("actual_q", "actual_qd", "external_force_torque"), "VECTOR6D")
FORMAT = {"DOUBLE": "d", "INT32": "i", "UINT32": "I", "VECTOR6D": "6d", "NOT_FOUND": ""}


async def every(period: float):
    """Yield when each period was due, s; periods that were missed are made up for, up to 50 ms."""
    due = time.monotonic()
    while True:
        due = max(due + period, time.monotonic() - 0.05)
        await asyncio.sleep(max(0.0, due - time.monotonic()))
        yield due


def kinds(names: list[str]) -> list[str]:
    registers = {"double": "DOUBLE", "int_re": "INT32"}
    of = [next((k for part, k in registers.items() if part in n), "NOT_FOUND") for n in names]
    return [KINDS.get(name, kind) for name, kind in zip(names, of, strict=True)]


def names_in(data: bytes) -> list[str]:
    return data.decode().strip(",").split(",")


def packed(kind: str, data: bytes) -> bytes:
    return struct.pack(">HB", 3 + len(data), ord(kind)) + data


def form(names: list[str]) -> str:
    return ">B" + "".join(FORMAT[kind] for kind in kinds(names))


async def exchange(arm: Arm, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """Serve one client of the data exchange."""
    outputs, inputs, task = [], [], None

    async def stream(period: float) -> None:
        async for _ in every(period):
            numbers = [x for name in outputs for x in arm.value(name)]
            writer.write(packed("U", struct.pack(form(outputs), 1, *numbers)))

    try:
        while True:
            size, code = struct.unpack(">HB", await reader.readexactly(3))
            data, kind, answer = await reader.readexactly(size - 3), chr(code), b"\1"
            if kind == "U":
                names = inputs[data[0] - 1]
                arm.registers |= zip(names, struct.unpack(form(names), data)[1:], strict=True)
                arm.fed = time.monotonic()
                continue
            if kind == "v":
                answer = struct.pack(">4I", 3, 15, 8, 0)
            elif kind == "O":
                period, outputs = 1 / struct.unpack_from(">d", data)[0], names_in(data[8:])
                answer += ",".join(kinds(outputs)).encode()
            elif kind == "I":
                inputs.append(names_in(data))
                answer = bytes([len(inputs)]) + ",".join(kinds(inputs[-1])).encode()
            elif kind == "S":
                task = asyncio.create_task(stream(period))
            elif kind == "P" and task:
                task.cancel()
            writer.write(packed(kind, answer))
    except (asyncio.IncompleteReadError, ConnectionError):
        pass  # the client left
    finally:
        if task:
            task.cancel()
        writer.close()


async def dashboard(arm: Arm, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    writer.write(b"Connected: Universal Robots Dashboard Server\n")
    while asked := (await reader.readline()).decode().strip().lower():
        if asked == "stop":
            arm.end()
        writer.write(ANSWERS.get(asked, f"found no answer to {asked}").encode() + b"\n")


async def script(arm: Arm, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """Take programs: each ends with a line ``end`` that is not indented."""
    text = b""
    while data := await reader.read(1 << 16):
        text += data
        if text.rstrip(b"\n").endswith(b"\nend"):
            text = b""
            arm.play()


async def primary(arm: Arm, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """State the kinematics of the arm, once."""
    table = struct.pack(">6I24dI", *range(1, 7), *[0.0] * 6, *A, *D, *ALPHA, 2)
    part = struct.pack(">iB", 5 + len(table), 5) + table
    writer.write(struct.pack(">iB", 5 + len(part), 16) + part)
    await reader.read()


async def ring(arm: Arm, link: Path, number: int, count: int) -> None:
    """Send frames of ``count`` sensors on a serial line; what nobody reads is lost."""
    line, end = pty.openpty()
    tty.setraw(end)
    os.set_blocking(line, False)
    link.unlink(missing_ok=True)
    link.symlink_to(os.ttyname(end))
    noise, frame = random.Random(number), 0
    async for _ in every(1 / FRAMES):
        clock = int(1e6 * time.monotonic())
        data = struct.pack("<2sBBBHQ", b"\xa5\xc3", 1, count, 255 - count, frame % 65536, clock)
        for sensor in range(count):
            metres = 1 + 0.2 * math.sin(sum(arm.q) + sensor) + noise.gauss(0, 0.004)
            data += struct.pack("<HB", int(1000 * metres), 0)
        data, frame = data + struct.pack("<I", zlib.crc32(data)), frame + 1
        with suppress(BlockingIOError):
            os.write(line, data)


async def main(address: str, folder: str, rings: str, joints: str) -> None:
    arm = Arm([float(x) for x in joints.split(",")])
    for port, serve in {30004: exchange, 29999: dashboard, 30003: script, 30001: primary}.items():
        await asyncio.start_server(lambda r, w, s=serve: s(arm, r, w), address, port)
    lines = [
        asyncio.create_task(ring(arm, Path(folder) / f"ring{i}", i, int(count)))
        for i, count in enumerate(rings.split(","))
    ]
    await asyncio.sleep(0)
    print("open", flush=True)
    async for clock in every(PERIOD):
        arm.step(clock)
        if gone := [line for line in lines if line.done()]:
            gone[0].result()


if __name__ == "__main__":
    asyncio.run(main(*sys.argv[1:]))
