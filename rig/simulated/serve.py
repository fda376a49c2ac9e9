"""Process of the simulated rig: controller, rings, and injected faults."""

import asyncio
import inspect
import json
import signal
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from ...coverage.robots.calibration import DhTable
from ...formats.firmware.ring_pace import RingPace
from ..robot.state import RobotMode
from .arm import Arm
from .controller import PERIOD, Controller
from .environment import Environment, Measured
from .frame_pace import FramePace
from .packet_faults import SPOILERS
from .ports import SimulatedRing

_CLOCK_RATE = 1 - 40e-6  # of the rings' clocks
_FLUSH = 0.002  # s between attempts to send the rest of a frame
_AT_ONCE = 1e-6  # s
_SERIAL = 0x51D0 << 48  # serial number of the first ring's board
# by messages: an attribute of the controller or, where the message states its value, of a ring
_FAULTS = {
    **{"stall": ("frozen", ""), "mute": ("mute", ""), "refuse": ("refusing", "")},
    **{"silent": ("silent", "on"), "garble": ("garble", "on")},
    **{"corrupt": ("corrupt", "share"), "disorder": ("disorder", "share")},
    **{"fail": ("failed", "share"), "freeze": ("frozen", "share")},
}


@dataclass(frozen=True)
class Rig:
    """Settings of a simulated rig."""

    world: Environment
    """Environment that the rings see."""
    q: Float[np.ndarray, " 6"]
    """Initial joint angles, rad."""
    folder: Path
    """Folder of the rings' ports, ring0, ring1, …"""
    address: str = "127.0.0.1"
    """Loopback address of the controller."""
    rate: float = 15.0
    """Frames per second."""
    encoding: str = "place-rings"
    """Encoding of the rings' firmware."""
    seed: int = 0
    """Seed of noise and faults."""
    kinematics: DhTable | None = None
    """What the controller states about its arm; None: nothing."""
    paces: tuple[RingPace, ...] = ()
    """When each ring sends frames, and when its sensors range; none: all at ``rate``, and at once.
    """
    late_s: tuple[float, ...] = ()
    """Time by which the cycles of each ring begin late, s; none: in step."""


class Simulation:
    """A running rig. Messages are objects with ``do`` and its arguments; each is answered with the
    time of its execution.
    """

    def __init__(self, rig: Rig) -> None:
        self._rig, rng = rig, np.random.default_rng(rig.seed)
        self._arm = Arm(rig.q, PERIOD)
        self._controller = Controller(self._arm, rig.address, kinematics=rig.kinematics)
        counts = rig.world.counts
        self._noise, self._spoiling, *own = rng.spawn(2 + len(counts))
        self._rings = [
            SimulatedRing(rig.folder / f"ring{i}", rig.encoding, own[i], _SERIAL + i)
            for i in range(len(counts))
        ]
        self._paces = [FramePace(p, n) for p, n in zip(rig.paces, counts, strict=False)]
        for paced, late in zip(self._paces, rig.late_s, strict=False):
            paced.late_s = late
        self._start, self._told, self._seen = time.monotonic(), False, asyncio.Event()

    async def run(self) -> None:
        """Serve until stdin ends."""
        await self._controller.open()
        print(json.dumps({"done": "open", "time": time.monotonic()}), flush=True)
        tasks = [
            asyncio.create_task(work)
            for work in (self._controller.run(), self._measure(), self._listen())
        ]
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        self._controller.close()
        for ring in self._rings:
            ring.unplug()
        for task in done:
            task.result()

    async def _measure(self) -> None:
        """Send frames. While the arm moves, readings are as old as their computation takes;
        while it stands, they belong to its pose.
        """
        loop = asyncio.get_running_loop()
        at = self._arm.q
        known = None
        seen = None
        last = list[Measured | None]([None] * len(self._paces))
        fresh = [np.ones(paced.count, bool) for paced in self._paces]
        looking: asyncio.Future[Any] | None = None
        for due, numbers in self._due():
            while True in {ring.flush() for ring in self._rings} and time.monotonic() < due:
                await asyncio.sleep(_FLUSH)
            await asyncio.sleep(due - time.monotonic())
            for i, number in numbers.items():
                fresh[i] |= self._paces[i].fresh(number)
            if looking is None and (self._told or known is None or (self._arm.q != known).any()):
                self._told, at = False, self._arm.q
                looking = loop.run_in_executor(None, self._rig.world.see, at)
            if looking is not None and (seen is None or looking.done() or not self._arm.moving):
                seen, known, looking = await looking, at, None
                if not self._told:
                    self._seen.set()
                if not self._arm.moving and (self._told or (self._arm.q != known).any()):
                    continue
            new = self._rig.world.measure(seen, self._noise)
            if not self._paces:
                clock = _CLOCK_RATE * (time.monotonic() - self._start)
                for ring, measured in zip(self._rings, new, strict=True):
                    ring.send(clock, *measured)
            for i in numbers:
                last[i] = sent = _renewed(last[i], new[i], fresh[i])
                self._rings[i].send(_CLOCK_RATE * (due - self._start), *sent)
                fresh[i][:] = False

    def _due(self) -> Iterator[tuple[float, dict[int, int]]]:
        """Yield when frames are due, s, and the number of the frame of each ring that keeps a pace
        and has one then. Frames that are more than a second late are left out.
        """
        due, begin = time.monotonic(), self._start
        while not self._paces:
            due = max(due + 1 / self._rig.rate, time.monotonic() - 1.0)
            yield due, {}
        number = [0] * len(self._paces)
        while True:
            for i, paced in enumerate(self._paces):
                if begin + paced.due(number[i]) < time.monotonic() - 1.0:
                    number[i] = max(number[i], paced.number(time.monotonic() - begin))
            each = [paced.due(n) for paced, n in zip(self._paces, number, strict=True)]
            now = {i: number[i] for i, at in enumerate(each) if at <= min(each) + _AT_ONCE}
            yield begin + min(each), now
            number = [n + (i in now) for i, n in enumerate(number)]

    async def _listen(self) -> None:
        reader = asyncio.StreamReader()
        await asyncio.get_running_loop().connect_read_pipe(
            lambda: asyncio.StreamReaderProtocol(reader), sys.stdin
        )
        while line := await reader.readline():
            message = json.loads(line)
            answer = self._do(message)
            if inspect.isawaitable(answer):
                answer = await answer
            print(
                json.dumps({"done": message["do"], "time": time.monotonic(), **(answer or {})}),
                flush=True,
            )

    def _do(self, message: dict[str, Any]) -> Any:
        controller = self._controller
        ring = self._rings[message.get("ring", 0)] if self._rings else None
        paced = self._paces[message.get("ring", 0)] if self._paces else None
        deeds: dict[str, Callable[[], Any]] = {
            "close": controller.close,
            "heal": controller.heal,
            "spoil": lambda: setattr(controller, "spoil", SPOILERS[message["how"]](self._spoiling)),
            "zero": lambda: controller.send_all(b"\0\0U"),
            "stop": lambda: controller.stop(message.get("how", "protective")),
            "pendant": controller.stop,
            "drop": controller.drop,
            "mode": lambda: controller.switch(RobotMode[message["how"]]),
            "slider": lambda: setattr(self._arm, "scaling", message["at"]),
            "hold": lambda: setattr(controller, "held", frozenset(message["inputs"])),
            "ignore": lambda: setattr(controller, message.get("how", "stubborn"), True),
            "world": lambda: self._tell(message),
            "counts": lambda: {
                "sent": [r.sent for r in self._rings],
                "dropped": [r.dropped for r in self._rings],
            },
            "state": lambda: {"q": self._arm.q.tolist(), "moving": self._arm.moving},
        }
        if ring is not None:
            deeds |= {
                "cure": ring.cure,
                "unplug": ring.unplug,
                "plug": ring.plug,
                "near": lambda: setattr(ring, "near", message.get("at", float("nan"))),
                "exchange": lambda: ring.exchange(message["serial"]),
            }
        if paced is not None:
            deeds |= {
                "late": lambda: setattr(paced, "late_s", message["by"]),
                "slower": lambda: setattr(paced, "slower", message["by"]),
            }
        if (do := message["do"]) in _FAULTS:
            name, value = _FAULTS[do]
            return setattr(ring if value else controller, name, message.get(value, True))
        return deeds[do]()

    async def _tell(self, message: dict[str, Any]) -> None:
        """Apply a message; readings change from the next frame after the answer on."""
        self._rig.world.tell(message)
        self._told = True
        self._seen.clear()
        await self._seen.wait()
        await asyncio.sleep(max((pace.oldest_s for pace in self._rig.paces), default=0.0))


def _renewed(last: Measured | None, new: Measured, fresh: Bool[np.ndarray, " n"]) -> Measured:
    """Return the last readings of a ring's sensors, or of their zones, with the new ones of those
    that are ``fresh``.
    """
    if last is None:
        return new
    mask = fresh.reshape(-1, *[1] * (new[0].ndim - 1))
    return np.where(mask, new[0], last[0]), np.where(mask, new[1], last[1])


def serve(rig: Rig) -> None:
    """Run a rig until stdin ends. Ctrl-C and a terminal that hangs up are left to the process that
    started it.
    """
    for ignored in (signal.SIGINT, signal.SIGHUP):
        signal.signal(ignored, signal.SIG_IGN)
    asyncio.run(Simulation(rig).run())
