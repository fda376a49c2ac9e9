"""Simulated controller of the robot: RTDE, dashboard and script ports on loopback, as ur-rtde's
clients use them, and the primary interface, which states the arm's kinematics.
"""

import asyncio
import re
import struct
import time
from collections.abc import Callable, Coroutine
from contextlib import suppress
from typing import Any

import numpy as np

from ...coverage.robots.calibration import DhTable
from ..robot import primary_interface as primary
from ..robot.state import RobotMode
from . import rtde
from .arm import Arm

RTDE_PORT, DASHBOARD_PORT, SCRIPT_PORT = 30004, 29999, 30003
PERIOD = 0.008  # s, time step of the arm and period of the fastest stream
_CLOCK_START, _CLOCK_RATE = 1000.0, 1 + 30e-6  # s, of the robot's own clock, and its rate
_MOVE, _STOP, _WATCHDOG, _STOP_SCRIPT = 1, 34, 35, 255
_READY, _DONE = 1, 2
_MESSAGE, _MODE, _PRIMARY = 20, 0, 0.1  # kinds of package and part; s between states
_NORMAL = 1  # safety status bits
SAFETY_STOPS = {
    "protective": 1 | 1 << 2,
    "safeguard": 1 | 1 << 4,
    "emergency": 1 << 6 | 1 << 7 | 1 << 10,
}
_RUNNING = 0b1011  # robot status bits: power on, program running, power button
_SAFE_DECELERATION = 8.0  # rad/s², of a stop that no program requested
_ANSWERS = {
    "polyscopeversion": "URSoftware 5.11.0.108249 (simulated)",
    "get serial number": "20200000001",
    "is in remote control": "true",
    "programstate": "PLAYING simulated.urp",
    "running": "Program running: true",
    "robotmode": "Robotmode: RUNNING",
    "safetystatus": "Safetystatus: NORMAL",
    "stop": "Stopped",
}
Server = Callable[[asyncio.StreamReader, asyncio.StreamWriter], Coroutine[Any, Any, None]]


def _framed(kind: int, data: bytes) -> bytes:
    """Return a package of the primary interface, or a part of one, with its header."""
    return primary.HEAD.pack(primary.HEAD.size + len(data), kind) + data


class Client:
    """A client connected to the RTDE port."""

    def __init__(self, writer: asyncio.StreamWriter) -> None:
        self.writer, self.period, self.due, self.started = writer, PERIOD, 0.0, False
        self.outputs: rtde.Recipe | None = None
        self.inputs: dict[int, rtde.Recipe] = {}


class Controller:
    """Serves an arm at a loopback address.

    Attributes for fault injection: each function in ``spoil`` changes the bytes of a data package
    before they are sent; ``mute`` suppresses answers, ``frozen`` suppresses sending, ``deaf``
    ignores all input; ``refusing`` refuses the version of the protocol but serves it; ``stubborn``
    moves on whatever should stop it, ``unwilling`` whatever its program should do; ``held`` names
    inputs that another client holds; ``mode`` is the robot mode, in which it moves only if running.

    Args:
        arm: the arm to move.
        address: of loopback.
        kinematics: what it states about its arm; None: the primary interface states nothing.
    """

    def __init__(self, arm: Arm, address: str, kinematics: DhTable | None = None) -> None:
        self.arm, self.address, self._kinematics = arm, address, kinematics
        self._cure()
        self._start = time.monotonic()
        self._now = self._start  # nominal time of the arm's last step, which may run late
        self._clients: set[Client] = set()
        self._servers: list[asyncio.Server] = []
        self._writers: set[asyncio.StreamWriter] = set()
        self._registers: dict[str, float | int] = {}
        self._playing, self._waiting = False, False
        self._watchdog, self._fed = 0.0, 0.0

    async def open(self) -> None:
        """Listen on all ports."""
        ports = (
            (RTDE_PORT, self._rtde),
            (DASHBOARD_PORT, self._dashboard),
            (SCRIPT_PORT, self._script),
            (primary.PORT, self._primary),
        )
        for port, serve in ports:
            self._servers.append(await asyncio.start_server(self._kept(serve), self.address, port))

    def close(self) -> None:
        """Stop listening, and close all connections."""
        for server in self._servers:
            server.close()
        for writer in self._writers:
            writer.transport.abort()
        self._servers = []

    def _kept(self, serve: Server) -> Server:
        async def served(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            self._writers.add(writer)
            try:
                with suppress(ConnectionError, asyncio.IncompleteReadError):
                    await serve(reader, writer)
            finally:
                self._writers.discard(writer)
                writer.close()

        return served

    async def run(self) -> None:
        """Step the arm and send its state, forever."""
        due = time.monotonic()
        while True:
            due = max(due + PERIOD, time.monotonic() - 10 * PERIOD)
            await asyncio.sleep(due - time.monotonic())
            self.arm.tick()
            self._now = due
            self._command()
            for client in self._clients:
                self._send_state(client, due)

    async def heal(self) -> None:
        """Remove all injected faults."""
        self.close()
        self._cure()
        self.arm.scaling = 1.0
        self.stop()
        await self.open()

    def _cure(self) -> None:
        self.mute = self.frozen = self.deaf = self.stubborn = self.unwilling = False
        self.refusing = False
        self.spoil: Callable[[bytes], bytes] | None = None
        self.safety, self.mode, self.held = _NORMAL, RobotMode.RUNNING, frozenset[str]()

    def stop(self, safety: str = "") -> None:
        """End the program; a stop by ``safety``, one of ``SAFETY_STOPS``, appears in the safety
        status.
        """
        self._playing = self._waiting = False
        self._watchdog = 0.0
        self._stop_arm(_SAFE_DECELERATION)
        self.safety = SAFETY_STOPS.get(safety, self.safety)

    def switch(self, mode: RobotMode) -> None:
        """Change the robot mode; in any but RUNNING the arm does not move."""
        self.mode = mode
        if mode != RobotMode.RUNNING:
            self.stop()

    def drop(self) -> None:
        """Simulate a lost cable: nothing is sent, received or closed."""
        self.frozen = self.deaf = self.mute = True

    def _stop_arm(self, deceleration: float) -> None:
        if not self.stubborn:
            self.arm.stop(deceleration)

    def send_all(self, data: bytes) -> None:
        """Send raw bytes to all clients of the stream."""
        for client in self._clients:
            client.writer.write(data)

    def values(self) -> dict[str, Any]:
        """Return the robot's variables."""
        return {
            "timestamp": _CLOCK_START + _CLOCK_RATE * (self._now - self._start),
            "actual_q": self.arm.q.tolist(),
            "actual_qd": self.arm.speed.tolist(),
            "robot_mode": self.mode,
            "safety_status_bits": self.safety,
            "robot_status_bits": _RUNNING,
            "runtime_state": 2 if self._playing else 1,
            **self._registers,
        }

    def _send_state(self, client: Client, now: float) -> None:
        if not client.started or client.outputs is None or self.frozen or now < client.due:
            return
        client.due = max(client.due + client.period, now)
        data = rtde.package(rtde.DATA, client.outputs.pack(self.values()))
        client.writer.write(self.spoil(data) if self.spoil else data)

    async def _rtde(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        client = Client(writer)
        self._clients.add(client)
        try:
            while True:
                size, kind = rtde.HEAD.unpack(await reader.readexactly(rtde.HEAD.size))
                data = await reader.readexactly(size - rtde.HEAD.size)
                if self.deaf:
                    continue
                answer = self._answer(client, kind, data)
                if answer is not None and not self.mute:
                    writer.write(rtde.package(kind, answer))
        finally:
            self._clients.discard(client)

    def _answer(self, client: Client, kind: int, data: bytes) -> bytes | None:
        match kind:
            case rtde.VERSION:
                return b"\0" if self.refusing else b"\1"
            case rtde.CONTROLLER:
                return struct.pack(">4I", 5, 11, 0, 0)
            case rtde.OUTPUTS:
                client.period = 1 / struct.unpack_from(">d", data)[0]
                client.outputs = rtde.Recipe(1, data[8:].decode().strip(",").split(","))
                return client.outputs.answer
            case rtde.INPUTS:
                names = data.decode().strip(",").split(",")
                if self.held & set(names):
                    return rtde.refused(names, self.held)
                recipe = rtde.Recipe(len(client.inputs) + 1, names)
                client.inputs[recipe.number] = recipe
                return recipe.answer
            case rtde.START | rtde.PAUSE:
                client.started = kind == rtde.START
                return b"\1"
            case rtde.DATA if data and data[0] in client.inputs:
                self._registers |= client.inputs[data[0]].unpack(data)
                self._fed = time.monotonic()
        return None

    def _command(self) -> None:
        """Execute the command in the registers, as the uploaded program does."""
        if not self._playing:
            return
        if self._watchdog and time.monotonic() - self._fed > self._watchdog:
            self.stop()
            return
        command = self._registers.get("input_int_register_0", 0)
        ready = self._registers.get("output_int_register_0", 0)
        if command == 0:
            self._registers["output_int_register_0"], self._waiting = _READY, False
        elif self._waiting:
            if not self.arm.moving:
                self._registers["output_int_register_0"], self._waiting = _DONE, False
        elif ready == _READY:
            self._waiting = self._execute(int(command))
            self._registers["output_int_register_0"] = 0 if self._waiting else _DONE

    def _execute(self, command: int) -> bool:
        """Execute a command; return whether the client must wait until the arm stands still."""
        doubles = [float(self._registers.get(f"input_double_register_{i}", 0.0)) for i in range(8)]
        asynchronous = bool(self._registers.get("input_int_register_1", 0))
        if command == _MOVE:
            self.arm.move(np.array(doubles[:6]), doubles[6], doubles[7])
        elif command == _STOP and not self.unwilling:
            self._stop_arm(doubles[0])
        elif command == _WATCHDOG:
            self._watchdog, self._fed = 1 / doubles[0], time.monotonic()
        elif command == _STOP_SCRIPT:
            self.stop()
        return command in (_MOVE, _STOP) and not asynchronous

    async def _dashboard(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.write(b"Connected: Universal Robots Dashboard Server\n")
        while line := (await reader.readline()).decode(errors="replace").strip():
            if line == "stop" and not self.deaf:
                self.stop()
            if not self.mute:
                writer.write(_ANSWERS.get(line.lower(), "could not understand").encode() + b"\n")

    async def _primary(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Send a message of another kind, then states until the client leaves; the first states
        the kinematics, after a part that the client does not know."""
        writer.write(_framed(_MESSAGE, b"simulated"))
        known = b"" if self._kinematics is None else primary.packed(self._kinematics)
        parts = _framed(_MODE, bytes(8)) + (_framed(primary.KINEMATICS, known) if known else b"")
        while not reader.at_eof():
            if not self.mute:
                writer.write(_framed(primary.STATE, parts))
                parts = _framed(_MODE, bytes(8))
            await writer.drain()
            await asyncio.sleep(_PRIMARY)

    async def _script(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        script = b""
        while data := await reader.read(1 << 16):
            script += data
            if self.mode == RobotMode.RUNNING and re.search(rb"^end\s*\Z", script, re.MULTILINE):
                script, self._playing, self._waiting = b"", True, False
                self._registers = {"output_int_register_0": _READY}
                self.arm.stop(_SAFE_DECELERATION)
