"""The actors of a check: a robot that moves itself or is moved by a person, and a rod that is
simulated or placed by a person.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float

from ...coverage.rings.ring import Setup
from ...coverage.robots.joint_values import angles_apart
from ...formats.firmware.ring_slots import SETTLE_S
from ...objectives.scene import Scene
from ..poses.itinerary import Itinerary
from ..poses.near_stops import STEP, NearStops, joined
from ..robot.motion import (
    MotionLimits,
    MoveHeldError,
    Mover,
    MoveRefusedError,
    MoveStoppedError,
)
from ..robot.state import State
from ..robot.vetting import LinkFaultError
from ..rod.rod import Rod
from ..sensing.readings import WITHIN
from ..session.session import Session
from ..session.stop_conditions import StopConditions, StopRules
from ..simulated.process import SimulatedRig, SimulationError
from .planned_check import ring_names
from .procedure import EndedError

_LOOK = 0.1  # s
_STILL = 0.01  # rad/s
_LATE = 0.05  # m; a target may have come closer since a simulated ring saw it
_LEAVE = "; step out of the robot's reach: it may move next"
_PASSAGE = 0.15  # s that a simulated hand stays in front of a sensor

# show an instruction: True if done, False if skipped; raises EndedError
Ask = Callable[[str], bool]


class MovedRobot:
    """Moves the robot along an itinerary; the stop conditions stop it.

    Args:
        host: name or address of the robot.
        scene: with the limits of motions.
        session: robot and rings.
        itinerary: the paths to take.
        route: near stops along the whole itinerary.
        alarm: called at once if the robot is not seen to stand still.
        ask: a person whether a robot that was held on its way may go on; None: it does not.
        settle: time that the robot stands before readings count, s.
    """

    def __init__(
        self,
        host: str,
        scene: Scene,
        session: Session,
        itinerary: Itinerary,
        route: NearStops,
        alarm: Callable[[str], None],
        ask: Ask | None = None,
        settle: float = SETTLE_S,
    ) -> None:
        self._ask, self._settle = ask, settle
        limits, motion, setup = scene.robot.limits, scene.motion, itinerary.clearance.setup
        joints = (
            np.tile([-2 * np.pi, 2 * np.pi], (len(scene.robot.chain), 1))
            if limits is None
            else limits
        )
        self._itinerary, self._session, self._counts = itinerary, session, session.rings.sizes
        # a reading may be this old
        self._within = STEP + motion.speed * scene.link.oldest_reading * session.patience
        # Readings of a simulated ring may be old and from another path, and two of its sensors may
        # be swapped. So the near stops of the whole route apply, in any order of a ring's wires.
        # On a real rig those of the current path apply, from the robot's actual position.
        self._by_way = session.patience <= 1
        self._stops = (
            itinerary.near_stops_to(itinerary.at, session.link.latest().q)
            if self._by_way
            else route.wired_anyhow(setup).lowered(_LATE)
        )
        self._mover = Mover(
            host,
            session.link,
            MotionLimits(joints, motion.speed, motion.acceleration),
            itinerary.clearance.fault,
            StopConditions(
                session,
                self._near,
                StopRules(motion.failed_share, motion.frozen_frames),
                [setup.group_name(i) for i, _ in enumerate(setup.groups)],
            ),
            session.patience,
            alarm,
            scene.link,
        )

    def order(self, joints: Float[np.ndarray, "P J"]) -> Sequence[int]:
        return self._itinerary.order(joints)

    def stand(self, q: Float[np.ndarray, " J"], words: str) -> bool:
        for node in self._itinerary.next(q):
            try:
                self._reach(node)
            except (MoveRefusedError, MoveStoppedError, LinkFaultError) as error:
                raise EndedError(f"on the way to {words}: {error}") from error
            self._itinerary.at = node
        time.sleep(self._settle)
        return True

    def _reach(self, node: int) -> None:
        """Move to a node; where the robot was held on its way, ask before it goes on."""
        while True:
            try:
                return self._move(node)
            except MoveHeldError as held:
                self._session.say("held", why=str(held))
                if self._ask is None or not self._ask(f"{held}; it was stopped"):
                    raise

    def _move(self, node: int) -> None:
        """Move to a node, with the near stops of the path to it."""
        goal = self._itinerary.map.nodes[node]
        if not self._by_way:
            self._mover.move(goal)
            return
        way = self._itinerary.near_stops_to(node, self._session.link.latest().q)
        self._stops = joined(self._stops, way)  # a reading may still be from the previous path
        self._mover.move(goal)
        self._stops = way

    def _near(self, q: Float[np.ndarray, " J"]) -> list[Float[np.ndarray, " n"]]:
        """Return the near stops (n,) m of each ring at ``q`` (J,) rad."""
        return np.split(self._stops.near(q, self._within), np.cumsum(self._counts)[:-1])

    def close(self) -> None:
        """Stop the robot and release it."""
        self._mover.close()


class GuidedRobot:
    """A robot that a person brings to each pose with the pendant; nothing is sent to it. It then
    stands for ``settle`` s before readings count."""

    def __init__(self, session: Session, ask: Ask, settle: float = SETTLE_S) -> None:
        self._session, self._ask, self._settle = session, ask, settle

    def order(self, joints: Float[np.ndarray, "P J"]) -> Sequence[int]:
        return range(len(joints))

    def stand(self, q: Float[np.ndarray, " J"], words: str) -> bool:
        angles = ", ".join(f"{a:.1f}" for a in np.degrees(q))
        while self._off(q) > WITHIN:
            if not self._ask(
                f"{words}: bring the robot to joints {angles}° (farthest off:"
                f" {np.degrees(self._off(q)):.1f}°)"
            ):
                return False
        while np.abs(self._state().speed).max() > _STILL:
            time.sleep(_LOOK)
        time.sleep(self._settle)
        return True

    def _off(self, q: Float[np.ndarray, " J"]) -> float:
        return float(angles_apart(self._state().q, q).max())

    def _state(self) -> State:
        try:
            return self._session.link.latest()
        except LinkFaultError as fault:
            raise EndedError(str(fault)) from fault

    def close(self) -> None:
        """Do nothing: nothing is held."""


class SimulatedHelper:
    """Places the rod and waves the hand of a simulated rig."""

    def __init__(self, rig: SimulatedRig, setup: Setup, rod: Rod) -> None:
        self._rig, self._setup, self._rod = rig, setup, rod

    def put(self, point: Float[np.ndarray, " 3"] | None, words: str) -> bool:
        at = None if point is None else point.tolist()
        self._tell(rod=at, radius=self._rod.radius, length=self._rod.length)
        return True

    def wave(self, ring: int) -> bool:
        # a sensor's usual distance is its median, so that of a lone one needs most of the time
        for seat in [None, *range(self._setup.groups[ring].count), None]:
            self._tell(hand=None if seat is None else [ring, seat])
            time.sleep(_PASSAGE)
        return True

    def _tell(self, **words: Any) -> None:
        try:
            self._rig.do("world", **words)
        except (SimulationError, OSError) as error:
            raise EndedError(str(error)) from error


class Helper:
    """A person who places the rod and passes a hand over the sensors of a ring.

    Args:
        ask: shows an instruction and waits.
        setup: the rings and single sensors.
        moves: whether the robot may move by itself once this person is done.
    """

    def __init__(self, ask: Ask, setup: Setup, moves: bool) -> None:
        self._ask, self._setup, self._leave = ask, setup, _LEAVE if moves else ""
        self._names = ring_names(setup)

    def put(self, point: Float[np.ndarray, " 3"] | None, words: str) -> bool:
        return self._ask(words if point is not None else words + self._leave)

    def wave(self, ring: int) -> bool:
        if ring >= len(self._setup.rings):
            return self._ask(
                f"{self._setup.group_name(ring)}: pass a hand 10 to 20 cm in front of it for half a"
                " second, after one without it; then take the hand away" + self._leave
            )
        return self._ask(
            f"ring {self._names[ring]}: pass a hand 10 to 20 cm in front of its sensors, one by"
            " one, half a second each, starting at the first in the order of phase (right-handed"
            " about the link, toward its distal end); then take the hand away" + self._leave
        )


def hurried(scene: Scene) -> Scene:
    """Return ``scene`` with the fastest motion allowed, for a simulated robot, which can hurt
    nobody.
    """
    return replace(
        scene, motion=replace(scene.motion, speed=np.radians(60.0), acceleration=np.radians(120.0))
    )
