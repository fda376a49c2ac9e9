"""What must hold before a check moves a robot: its rings have begun, their ports and the self check
agree with the proposal, the way is planned, and a person has confirmed it.
"""

import time
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from ...coverage.definitions.errors import UserError
from ..poses.itinerary import Itinerary
from ..poses.routes import SLACK, Clearance
from ..robot.motion import MoveRefusedError
from ..robot.vetting import LinkFaultError
from ..session.session import Session
from .actors import Ask, MovedRobot, hurried
from .attendant import Attendant
from .findings import differences
from .options import CheckOptions
from .part_results import PartResults
from .planned_check import PlannedCheck, ring_names
from .preconditions import (
    least_near_share,
    require_boards,
    require_free_inputs,
    require_near_stop,
    require_ports,
    require_running,
)
from .procedure import EndedError
from .records import lines_of
from .stopping import bounds_of_route

_FIRST = 3.0  # s for the first frames of all rings
_STARTING = 20.0  # s for those of a ring that starts: seconds for each of its sensors
_ANSWER = 1.0  # s, for the inputs that another client holds
_HELLO, _LOOK = 2.5, 0.02  # s for the first hello of all rings; s between looks at it


@dataclass(frozen=True)
class Readiness:
    """A connected rig before its robot moves."""

    session: Session
    """Robot and rings."""
    check: PlannedCheck
    """The planned check."""
    options: CheckOptions
    """What the robot may do."""
    attendant: Attendant
    """The person at the rig."""
    address: str
    """Address of the robot's controller."""
    real: bool
    """Whether the rig is a real one."""

    def await_rings(self) -> None:
        """Wait for the first frames of all rings, longer for those that are starting; raise
        UserError if ports are swapped.
        """
        session = self.session
        session.rings.wait(_FIRST * session.patience)
        if self.real and (starting := session.rings.starting):
            names = [ring_names(self.check.setup)[ring] for ring in starting]
            self.attendant.note(
                f"{', '.join(names)}: starting, no frame in {_FIRST * session.patience:g} s;"
                f" waiting for up to {_STARTING * session.patience:g} s"
            )
            session.say("starting", rings=starting)
            until = time.monotonic() + (_STARTING - _FIRST) * session.patience
            while session.rings.starting and time.monotonic() < until:
                time.sleep(_LOOK)
        if self.real:
            self._require_ports()

    def _require_ports(self) -> None:
        """Raise UserError if ports are swapped, once the known boards had time to say hello."""
        setup, rings, until = self.check.setup, self.session.rings, time.monotonic() + _HELLO
        while time.monotonic() < until and any(
            ring.serial and not c.serials
            for ring, c in zip(setup.rings, rings.counts, strict=False)
        ):
            time.sleep(_LOOK)
        require_ports(setup, rings.counts, [port.name for port in self.check.ports])

    def require_controllable(self, mode: int | None) -> None:
        """Raise UserError if a real robot, in its ``mode``, can not be controlled, or a ring's
        board is another one than proposed.
        """
        if self.real:
            require_boards(self.check.setup, self.session.rings.counts)
            require_running(mode)
            require_free_inputs(self.address, _ANSWER * self.session.patience)

    def require_self_check(self) -> None:
        """Raise EndedError if the self check of a real rig differs and the robot may not move
        nevertheless.
        """
        if not self.real:
            return
        session, check = self.session, self.check
        gathered = session.gathered.snapshot(session.rings.counts)
        only = replace(check, stops=None, trials=())
        done, lines = PartResults(only, gathered), lines_of(check.setup, check.ports, gathered)
        if differs := [*done.failures, *differences(done, None, (), lines)]:
            if not self.options.allow_differing_self_check:
                raise EndedError(
                    f"the self check differs, so the robot was not moved: {'; '.join(differs)};"
                    " --allow-differing-self-check moves it anyway"
                )
            session.say(
                "warning",
                text="the robot moved although the self check differs"
                " (--allow-differing-self-check)",
            )

    def moved_robot(self, start: Float[np.ndarray, " J"], resume: Ask) -> MovedRobot:
        """Return the robot, which stands at ``start`` (J,) rad, ready to move, once a person has
        confirmed; raise UserError if it may not move.
        """
        session, check, attendant = self.session, self.check, self.attendant
        setup, scene = check.setup, check.scene if self.real else hurried(check.scene)
        if wrong := Clearance(scene, setup).fault(start, SLACK):
            raise UserError(
                f"--move: the robot cannot start from its present pose: {wrong}; move it to a"
                " clear pose with the pendant"
            )
        with attendant.working("planning the route"):
            itinerary = Itinerary(scene, setup, start, check.plans.poses, check.seed)
            stops = itinerary.near_stops()
        attendant.show_near_stops(stops, setup, scene)
        route = (check.scene, setup, stops.joints, self.real, check.cycle_s)
        bounds, warning = bounds_of_route(*route)
        attendant.show_stopping(bounds, warning)
        session.say("stopping", seconds=bounds[0].seconds, metres=bounds[0].metres)
        waived = self.options.allow_reduced_near_stop
        if self.real:
            require_near_stop(stops, scene, waived)
            attendant.confirm(scene, check.plans, itinerary)
        waived = waived and stops.share < least_near_share(scene)
        session.say("near stop", share=stops.share, waived=waived)
        try:
            ask = resume if self.real else None
            way = (session, itinerary, stops, attendant.alarm, ask, check.settle_s)
            return MovedRobot(self.address, scene, *way)
        except (MoveRefusedError, LinkFaultError) as error:
            raise UserError(f"--move: {error}") from error
