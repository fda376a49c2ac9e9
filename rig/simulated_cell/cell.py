"""Simulated rig in the cell of a proposal: the robot's true geometry, rings with mounting errors, a
test rod.

Run: python -m place_rings.rig.simulated_cell.cell FOLDER ADDRESS PROPOSAL SEED FAULTS PACES

PACES is a JSON list with the pace of each ring; an empty one: all send at a fixed rate. The process
reads messages as JSON from stdin.
"""

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from pydantic import TypeAdapter

from ...coverage.choices import Faults
from ...coverage.rings.ring import Setup
from ...coverage.robots.built_in import controller_table
from ...coverage.solids.capsules import Capsules
from ...formats.firmware.ring_pace import RingPace
from ...formats.loader import read_proposal
from ...formats.schema.proposal_models import ProposalFile
from ...formats.writing import to_toml, write_text
from ...objectives.obstacle import Obstacle
from ...objectives.scene import Scene
from ..rod.rod import Rod
from ..sensing.expected import beams_at
from ..simulated.environment import Measured
from ..simulated.process import SimulatedRig
from ..simulated.serve import Rig, serve
from .ground_truth import injected, late_s
from .world import World

RATE = 25.0  # frames a second
FILE = "world.toml"
_PACES: TypeAdapter[tuple[RingPace, ...]] = TypeAdapter(tuple[RingPace, ...])
# m: a hand's radius, distance of its centre from a sensor, its depth
_HAND, _AWAY, _DEEP = 0.04, 0.14, 0.01


class SimulatedCell:
    """Environment of the rings of a ``World``: the robot, the cell and, if present, a rod or a
    hand.
    """

    def __init__(self, world: World) -> None:
        self._world, self.counts = world, tuple(r.count for r in world.mounted.groups)
        self._rod: Capsules | None = None
        self._hand: int | None = None

    def see(self, q: Float[np.ndarray, " 6"]) -> list[Float[np.ndarray, "*grid"]]:
        """Return the true distances of each ring's sensors (n,), or of their zones (n, r, c, t),
        m, as wired: infinite without a target, nan for dead sensors.
        """
        joints = np.asarray(q, float)[None]
        rod = self._rod if self._hand is None else self._before(joints, self._hand)
        return [ring[0] for ring in self._world.seen(joints, rod)]

    def measure(
        self, seen: list[Float[np.ndarray, "*grid"]], rng: np.random.Generator
    ) -> list[Measured]:
        """Add noise."""
        return [self._world.told(rng, true) for true in seen]

    def tell(self, message: dict[str, Any]) -> None:
        """Place or remove a rod or a hand. ``rod`` is the rod's centre, three m in the base frame,
        with ``radius`` and ``length`` in m; ``hand`` is the ring and the seat it is in front of.
        None removes it.
        """
        if "hand" in message:
            at = message["hand"]
            self._hand = None if at is None else int(np.cumsum([0, *self.counts])[at[0]] + at[1])
            return
        at = message["rod"]
        rod = Rod(message.get("radius", Rod.radius), message.get("length", Rod.length))
        self._rod = None if at is None else rod.at(np.array([at], float))

    def _before(self, joints: Float[np.ndarray, "1 6"], seat: int) -> Capsules:
        """Return a hand, as a ball, in front of a seat."""
        beams = beams_at(self._world.scene, self._world.mounted, joints)
        apex, axis = np.asarray(beams.apex[seat]), np.asarray(beams.axis[seat])
        near, far = (apex + d * axis for d in (_AWAY, _AWAY + _DEEP))
        return Capsules(near[None, None], far[None, None], np.array([_HAND]))


def with_cell(scene: Scene) -> Scene:
    """Return ``scene`` with a floor, a table and a wall if it has no obstacles."""
    if scene.obstacles:
        return scene
    return replace(scene, obstacles=_CELL)


_CELL = (
    Obstacle("floor", floor=-0.75),
    Obstacle("table", centre=(0.9, 0.0, -0.2), size=(0.6, 1.2, 0.05)),
    Obstacle("wall", centre=(-1.3, 0.2, 0.25), size=(0.1, 3.0, 2.0), rpy_deg=(0.0, 0.0, 20.0)),
)


def simulated_rig(
    scene: Scene,
    setup: Setup,
    seed: int,
    folder: Path,
    faults: Faults = "random",
    paces: Sequence[RingPace] = (),
) -> SimulatedRig:
    """Start a simulated rig of ``setup`` in ``scene`` with these faults, of ``seed``, whose rings
    keep these paces, if there are any; leave the file of its world in ``folder``.
    """
    file = folder / FILE
    write_text(file, to_toml(ProposalFile.of(setup, scene)))
    text = _PACES.dump_json(tuple(paces)).decode()
    return SimulatedRig((("-m", __name__), (str(file), str(seed), faults, text)))


def main() -> None:
    """Serve a rig with the settings of the command line. Everything is compiled before a client can
    connect, because compilation would delay the controller.
    """
    folder, address, file, seed, kind, text = sys.argv[1:]
    faults: Any = kind
    paces = _PACES.validate_json(text)
    setup, scene, _ = read_proposal(Path(file))
    cell = SimulatedCell(injected(scene, setup, int(seed), faults).world(scene))
    q = scene.poses[0].q
    for rod in ([0.0, 0.0, 10.0], None):
        cell.tell({"rod": rod})
        cell.see(q)
    try:
        own = controller_table(scene.robot)
    except ValueError:
        own = None  # no arm of Universal Robots
    serve(
        Rig(
            cell,
            np.array(q),
            Path(folder),
            address,
            RATE,
            seed=int(seed),
            kinematics=own,
            paces=paces,
            late_s=late_s(paces, faults),
        )
    )


if __name__ == "__main__":
    main()
