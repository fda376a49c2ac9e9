"""The setup as built: compared with the proposal, with ζ verified again, and as a proposal of its
own.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool

from ...coverage.pytrees import mapped
from ...coverage.rings.ring import Setup
from ...coverage.rings.ring_kinematics import sensor_cones
from ...coverage.rings.rounding import rounded
from ...coverage.solids.base import Parts
from ...coverage.targets.target import Target, key_text
from ...formats.schema.base_model import Percent, StrictModel
from ...formats.schema.proposal_models import ProposalFile
from ...formats.writing import to_toml
from ...objectives.occlusion import sight
from ...objectives.scene import Scene
from ...objectives.tolerance import exact_zetas
from ...objectives.verify import Verifier
from .fit_record import fit_of
from .ring_fit import RingFit


class ZetaModel(StrictModel):
    """ζ of a target: of the proposed setup, of the setup as built, and of the same without dead
    sensors."""

    target: str
    radius: float | None = None
    proposed_percent: Percent
    built_percent: Percent
    alive_percent: Percent

    @property
    def named(self) -> str:
        """The target."""
        return key_text(self.target, self.radius)


@dataclass(frozen=True)
class AsBuilt:
    """The setup as built."""

    scene: Scene
    """The scene."""
    proposed: Setup
    """The proposed setup."""
    fits: tuple[RingFit, ...]
    """Estimated mounting of each ring."""
    silent: tuple[int, ...] = ()
    """Single sensors, numbered from 0 among themselves, that never answered at any stop."""

    @property
    def setup(self) -> Setup:
        """The rings as built, as a proposal's file stores them: a ring that slipped beyond a link's
        end is placed at the end.
        """
        rings = (replace(f.ring, position=min(max(f.ring.position, 0.0), 1.0)) for f in self.fits)
        built = replace(self.proposed, rings=tuple(rings))
        return rounded(built, self.scene.sensor)

    @property
    def alive(self) -> Bool[np.ndarray, " K"]:
        """Which of the setup's sensors, seat by seat, answer."""
        alive = [np.ones(f.ring.count, bool) for f in self.fits]
        for mine, f in zip(alive, self.fits, strict=True):
            mine[f.seat[list(f.dead)]] = False
        single = np.ones(len(self.proposed.singles), bool)
        single[list(self.silent)] = False
        return np.concatenate([*alive, single])

    def zeta(self, target: Target, verifier: Verifier) -> ZetaModel:
        """Count ζ; ``verifier`` must be of the same scene."""
        proposed, built = (verifier.verify(s, target).zeta for s in (self.proposed, self.setup))
        alive = built if self.alive.all() else float(exact_zetas(verifier, target, self._living)[0])
        name, radius = target.key
        return ZetaModel(
            target=name,
            radius=radius,
            proposed_percent=100 * proposed,
            built_percent=100 * built,
            alive_percent=100 * alive,
        )

    def _living(self, pose: int) -> Sequence[Parts]:
        """Return the regions that answering sensors cover at a pose."""
        q = self.scene.poses[pose].q
        return [
            sight(
                self.scene,
                mapped(lambda a: a[self.alive], sensor_cones(self.scene.robot, self.setup, q)),
                q,
            )
        ]

    def toml(self, name: str, verifier: Verifier) -> str:
        """Return the setup as built as a proposal's file, with ζ of the scene's targets verified
        again, and with the findings as comments.
        """
        zeta = [
            replace(verified.in_scene(name, self.scene), seconds=0.0)  # one file of one reading
            for verified in verifier.verify_goals(self.setup)
        ]
        file = ProposalFile.of(self.setup, self.scene, zeta=zeta)
        return to_toml(file, "\n".join(["As built, from a mount check:", *self.text()]))

    def text(self) -> list[str]:
        """Compare each ring with its proposal and list its faults, as lines."""
        lines = []
        for r in map(fit_of, range(len(self.fits)), self.fits):
            values = ", ".join(map(str, r.errors))
            values += f" (95 % confidence, {r.readings} readings, residuals {r.scale:.2f} of"
            values += " the noise model)"
            values = values if r.errors else "not estimated, as proposed here"
            lines += [f"ring {r.ring} ({r.link}): {values}", *r.text]
        first = len(self.proposed.rings)
        return lines + [
            f"{self.proposed.group_name(first + k)}: never answers" for k in self.silent
        ]
