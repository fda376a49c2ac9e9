"""An arm of six joints and the program that ur-rtde uploads; see plain_rig.py."""

import math
import time
from dataclasses import dataclass, field

PERIOD = 0.008  # s, of a controller of the CB3 series
READY, DONE = 1, 2  # states of the program in the first output register
MOVE, STOP, WATCHDOG, LEAVE = 1, 34, 35, 255  # commands in the first input register
SAFE = 8.0  # rad/s², of a stop that no program asked for


@dataclass
class Arm:
    """Six joints that follow one profile together, and the program that commands them."""

    q: list[float]
    speed: list[float] = field(default_factory=lambda: [0.0] * 6)
    way: tuple[list[float], list[float], float, float] | None = None  # start, turn, speed, acc.
    spent: float = 0.0  # s on the way
    braking: float = 0.0  # rad/s²; 0: not
    registers: dict[str, float] = field(default_factory=dict)
    plays: bool = False
    waits: bool = False  # the answer of a command waits for the end of its motion
    patience: float = math.inf  # s of the watchdog
    fed: float = 0.0
    clock: float = 0.0  # s, of the controller

    def step(self, clock: float) -> None:
        """Go on for one period, which ends at ``clock`` s."""
        self.clock = clock
        if self.braking:
            fastest = max(map(abs, self.speed))
            left = max(0.0, 1 - self.braking * PERIOD / fastest) if fastest else 0.0
            self.speed = [left * v for v in self.speed]
            self.q = [q + PERIOD * v for q, v in zip(self.q, self.speed, strict=True)]
            self.braking = self.braking if left else 0.0
        elif self.way:
            self.spent += PERIOD
            start, turn, v, a = self.way
            share, rate = profile(max(map(abs, turn)), v, a, self.spent)
            self.q = [s + share * d for s, d in zip(start, turn, strict=True)]
            self.speed = [rate * d for d in turn]
            self.way = self.way if share < 1 else None
        self.program()

    def program(self) -> None:
        """Do what the registers ask, as the program that ur-rtde uploads."""
        if not self.plays:
            return
        if time.monotonic() - self.fed > self.patience:
            print("watchdog", flush=True)
            self.end()
            return
        command, state = (self.registers.get(f"{d}put_int_register_0", 0) for d in ("in", "out"))
        if command == 0:
            self.registers["output_int_register_0"], self.waits = READY, False
        elif self.waits:
            self.waits = bool(self.way or self.braking)
            self.registers["output_int_register_0"] = 0 if self.waits else DONE
        elif state == READY:
            self.do(int(command))
            self.registers["output_int_register_0"] = 0 if self.waits else DONE

    def do(self, command: int) -> None:
        """Begin a command of the client."""
        value = [self.registers.get(f"input_double_register_{i}", 0.0) for i in range(8)]
        self.waits = command in (MOVE, STOP) and not self.registers.get("input_int_register_1")
        if command == MOVE:
            turn = [b - a for a, b in zip(self.q, value, strict=False)]
            self.way, self.spent, self.braking = (list(self.q), turn, *value[6:8]), 0.0, 0.0
        elif command == STOP:
            self.brake(value[0])
        elif command == WATCHDOG:
            self.patience, self.fed = 1 / value[0], time.monotonic()
        elif command == LEAVE:
            self.end()

    def play(self) -> None:
        """Begin a program that was uploaded."""
        self.registers, self.plays = {"output_int_register_0": READY}, True
        self.waits, self.patience = False, math.inf

    def brake(self, deceleration: float) -> None:
        """Begin to stop, by ``deceleration`` rad/s²."""
        self.way, self.braking = None, deceleration

    def end(self) -> None:
        """End the program; the arm stops."""
        self.plays, self.patience = False, math.inf
        self.brake(SAFE)

    def value(self, name: str) -> list[float]:
        """Return an output of the data exchange, as numbers."""
        whole = {"actual_q": self.q, "actual_qd": self.speed, "external_force_torque": [0.0] * 6}
        one = {"timestamp": self.clock, "robot_mode": 7, "safety_status_bits": 1}
        one |= {"runtime_state": 1 + self.plays, "robot_status_bits": 3, "speed_scaling": 1.0}
        return whole.get(name) or [one.get(name, self.registers.get(name, 0))]


def profile(length: float, v: float, a: float, t: float) -> tuple[float, float]:
    """Return share and rate, 1/s, of a way of ``length`` rad after ``t`` s."""
    v = min(v, math.sqrt(length * a))
    ramp, whole = (v / a, length / v + v / a) if v else (0.0, 0.0)
    if t >= whole:
        return 1.0, 0.0
    if t < ramp:
        return a * t * t / 2 / length, a * t / length
    if t < whole - ramp:
        return v * (t - ramp / 2) / length, v / length
    return 1 - a * (whole - t) ** 2 / 2 / length, a * (whole - t) / length
