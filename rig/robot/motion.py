"""Move the robot slowly between poses. Each motion is checked before it starts, supervised on its
way, and stopped on any fault.

This is not a safety function. It is ordinary software on an ordinary computer: the robot's own
safety functions protect people near the robot, and nothing here does.
"""

import math
import socket
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...objectives.link_limits import USUAL_LIMITS, LinkLimits
from ..closing import Closing
from ..recording.records import Kind
from .dashboard import PORT as DASHBOARD
from .link import Link
from .motion_control import MotionControl, NoAnswerError
from .motion_process import DECELERATION
from .noted_signals import noted_signals
from .state import JOINTS, State, pack_move
from .vetting import LinkFaultError

# rad/s and rad/s²; upper bounds on any request
MOST_SPEED, MOST_ACCELERATION = math.radians(60), math.radians(120)
_READY = 20.0  # s until the controller accepts the program
_TOLD = 0.5  # s until an answer: the process confirms a motion at once
_STILL = 0.3  # s until the robot is seen to stand still, in addition to its deceleration
BOUND = 1.0  # s; a standstill after this time is reported as late
LOOK = 0.01  # s
_STEP = math.radians(2)  # rad between checked poses of a path
_THERE = 2e-3  # rad of every joint
STANDS = 2e-3  # rad/s; a robot whose joints are slower stands still
_FIRM = 0.1  # s of the robot's clock for which it must be seen to stand still
HELD = 1.0  # s without motion on the way, after which the robot is held by somebody or something
_AGAIN = 3.0  # s until a lost robot answers again
_PATIENCE = 2.0  # s, in addition to the duration of a motion
UNSEEN = "the robot was not seen to stand still: press its emergency stop"


@dataclass(frozen=True)
class MotionLimits:
    """Limits of a motion."""

    joints: Float[np.ndarray, "6 2"]
    """Lowest and highest angle of each joint, rad."""
    speed: float = math.radians(15)
    """Speed of the leading joint, rad/s."""
    acceleration: float = math.radians(30)
    """Acceleration of the leading joint, rad/s²."""

    def __post_init__(self) -> None:
        for name, most in (("speed", MOST_SPEED), ("acceleration", MOST_ACCELERATION)):
            if not 0 < getattr(self, name) <= most:
                raise ValueError(
                    f"{name}: found {getattr(self, name):g}, allowed: above 0 to {most:.3g} rad"
                )


class MoveRefusedError(Exception):
    """The motion did not start; the text says why."""


class MoveStoppedError(Exception):
    """The robot was stopped on its way; the text says why."""


class MoveHeldError(MoveStoppedError):
    """The robot stood still on its way, held by its speed slider or a pause, and was stopped."""


class Mover(Closing):
    """Moves the robot at ``host`` through a process of its own, which ends with this object.

    Args:
        host: name or address.
        link: reports where the robot is. Without a state there is no motion.
        limits: of all motions.
        fault_at: returns what is wrong at joint angles (6,) rad on the way, such as links that come
            too close to each other; None if nothing is.
        danger: returns the reason to stop right now, such as a near reading, or None; called a
            hundred times a second.
        patience: factor on all time limits; 1 for a real robot.
        alarm: called at once if the robot is not seen to stand still.
        signs: of life between this program, the process and the robot.
        command: starts the process; for tests.

    Raises:
        MoveRefusedError: if the robot cannot be controlled.
    """

    def __init__(
        self,
        host: str,
        link: Link,
        limits: MotionLimits,
        fault_at: Callable[[Float[np.ndarray, " 6"]], str | None] = lambda q: None,
        danger: Callable[[], str | None] = lambda: None,
        patience: float = 1.0,
        alarm: Callable[[str], None] = lambda text: None,
        signs: LinkLimits = USUAL_LIMITS,
        command: tuple[str, ...] = (sys.executable, "-m", f"{__package__}.motion_process"),
    ) -> None:
        self._host, self._link, self._limits = host, link, limits
        self._fault_at, self._danger = fault_at, danger
        self._patience, self._alarm, self._signs = patience, alarm, signs
        times = map(str, (patience, signs.sign_of_life, signs.watchdog))
        self._control = MotionControl([*command, host, *times])
        try:
            self._control.expect("ready", _READY * patience)
        except BaseException as error:
            self._control.kill()
            self._control.close(0.0)
            if isinstance(error, NoAnswerError):
                raise MoveRefusedError(
                    f"the robot at {host} cannot be controlled: {error}"
                ) from None
            raise

    def refusal(self, q: Float[np.ndarray, "*n"]) -> str | None:
        """Return why the robot may not move from where it is to joint angles ``q`` (6,) rad, or
        None.
        """
        q = np.asarray(q, float)
        if q.shape != (JOINTS,):
            return f"found {q.size} joint angles, allowed: {JOINTS}"
        if not np.isfinite(q).all():
            return "found a joint angle that is not finite"
        low, high = self._limits.joints.T
        if len(over := np.flatnonzero((q < low) | (q > high))):
            joint = int(over[0])
            found, least, most = np.degrees([q[joint], low[joint], high[joint]])
            return f"joint {joint}: found {found:.4g}°, allowed: {least:.4g}° to {most:.4g}°"
        try:
            start = self._link.latest().q
        except LinkFaultError as fault:
            return str(fault)
        for share in np.linspace(0, 1, 2 + int(np.abs(q - start).max() / _STEP)):
            if wrong := self._fault_at(start + share * (q - start)):
                return f"after {100 * share:.0f} % of the way: {wrong}"
        return self._danger()

    def move(self, q: Float[np.ndarray, "..."]) -> None:
        """Move to joint angles ``q`` (6,) rad, all joints together, and stand still there.

        Anything that ends the motion early, including Ctrl-C, stops the robot first.

        Raises:
            MoveRefusedError: if the motion is not allowed; nothing moves.
            MoveHeldError: if something held it on its way for more than ``HELD`` s: it may go on
                only if a person says so.
            MoveStoppedError: if the robot was stopped on its way.
        """
        if wrong := self.refusal(q):
            raise MoveRefusedError(wrong)
        q, speed, acceleration = np.asarray(q, float), self._limits.speed, self._limits.acceleration
        way = float(np.abs(q - self._link.latest().q).max())
        most = 1.5 * (way / speed + speed / acceleration) + _PATIENCE * self._patience
        with noted_signals() as signals:
            try:
                self._control.tell(Kind.MOVE, pack_move(q, speed, acceleration))
                self._control.expect("moving", _TOLD * self._patience)
                self._watch(q, time.monotonic() + most, signals)
                self._halt()  # what is left of it, where something holds the robot there
            except BaseException as error:
                began = time.monotonic()
                still = self.stop()
                why, took = self._why(error), time.monotonic() - began
                if not still:
                    self._alarm(f"{why}; {UNSEEN}")
                    raise MoveStoppedError(f"{why}; {UNSEEN}") from None
                if took > BOUND * self._patience:
                    raise MoveStoppedError(
                        f"{why}; it was seen to stand still only after {took:.1f} s"
                    ) from None
                if isinstance(error, LinkFaultError | NoAnswerError):
                    raise MoveStoppedError(why) from None
                raise

    def _why(self, error: BaseException) -> str:
        """Return why the robot was stopped. A fault of the link takes precedence over a complaint
        of its client.
        """
        fault = self._link.fault
        if isinstance(error, NoAnswerError) and fault is not None:
            return f"{fault} ({error})"
        return str(error) or "interrupted"

    def _watch(
        self, q: Float[np.ndarray, " 6"], until: float, signals: list[Callable[[], object]]
    ) -> None:
        """Wait until the robot stands at ``q`` (6,) rad; raise MoveStoppedError if it must be
        stopped.
        """
        self._control.heard = turn = time.monotonic()
        most = self._signs.sign_of_life * self._patience
        stands = _Standstill(turn)
        while True:
            before, turn = turn, time.monotonic()
            if turn - before > most:
                raise MoveStoppedError(
                    f"this program was held up for {turn - before:.2f} s, allowed: {most:g} s"
                )
            if signals:
                signals.pop(0)()  # raises
            if self._there(q):
                return
            if wrong := self._danger():
                raise MoveStoppedError(wrong)
            if (held := stands.seconds(self._link.latest(), turn)) > HELD * self._patience:
                raise MoveHeldError(
                    f"it stood still on its way for {held:.1f} s, as if held by its speed slider, a"
                    " pause or an enabling device"
                )
            if turn > until:
                raise MoveStoppedError("it did not arrive in time")
            self._control.tell(Kind.ALIVE)
            self._control.hear(LOOK)
            if (silent := time.monotonic() - self._control.heard) > most:
                raise MoveStoppedError(
                    f"the process that moves it gave no sign of life for {silent:.2f} s"
                )

    def stop(self) -> bool:
        """Stop the robot; return whether it was seen to stand still.

        The robot first decelerates on command. If it is not seen to stand still, the process that
        moves it is killed, so that the robot's watchdog ends its program, and the dashboard is told
        to stop it as well.
        """
        with suppress(NoAnswerError):
            self._halt()
            if self._stands(self._link):
                return True
        self._control.kill()
        with (
            suppress(OSError),
            socket.create_connection((self._host, DASHBOARD), timeout=_TOLD) as dashboard,
        ):
            dashboard.settimeout(_TOLD)
            dashboard.sendall(b"stop\n")
            dashboard.recv(1 << 10)
        return (
            self._stands(self._link) if self._link.fault is None else self._stands_by_another_link()
        )

    def _halt(self) -> None:
        """Let the controller end its motion."""
        self._control.tell(Kind.STOP)
        self._control.expect("stopping", _TOLD * self._patience)

    def close(self) -> None:
        """Stop the robot and end the process."""
        self._control.close(BOUND * self._patience)

    def _there(self, q: Float[np.ndarray, " 6"]) -> bool:
        state = self._link.latest()
        return bool(np.abs(state.q - q).max() < _THERE and np.abs(state.speed).max() < STANDS)

    def _stands(self, link: Link) -> bool:
        """Whether the robot is seen to stand still in time: at one place for ``_FIRM`` s, in states
        that arrive from now on.
        """
        begin, first = time.monotonic(), None
        until = begin + (self._limits.speed / DECELERATION + _STILL) * self._patience
        with suppress(LinkFaultError):
            while time.monotonic() < until:
                state = link.latest()
                if np.abs(state.speed).max() >= STANDS or (
                    first and np.abs(state.q - first.q).max() > _THERE
                ):
                    first = None
                elif first is None and state.time > begin:
                    first = state
                elif first and state.clock - first.clock >= _FIRM:
                    return True
                time.sleep(LOOK)
        return False

    def _stands_by_another_link(self) -> bool:
        """The same after the link has ended, through a new link: the robot may still answer."""
        with (
            suppress(LinkFaultError),
            Link(
                self._host,
                start=_AGAIN,
                patience=self._patience,
                through_stops=True,
                robot=self._link.robot,
            ) as link,
        ):
            link.wait(_AGAIN * self._patience)
            return self._stands(link)
        return False


class _Standstill:
    """Measures for how long a robot has not moved, from ``now`` s on."""

    def __init__(self, now: float) -> None:
        self._since, self._at = now, np.full(JOINTS, np.inf)

    def seconds(self, state: State, now: float) -> float:
        """Return for how long it has stood where it is, s."""
        if np.abs(state.speed).max() >= STANDS or np.abs(state.q - self._at).max() > _THERE:
            self._since, self._at = now, state.q
        return now - self._since
