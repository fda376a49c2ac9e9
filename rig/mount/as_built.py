"""The setup as built: compared with the proposal, with ζ verified again, and as a proposal of its
own.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from ...coverage.pytrees import mapped
from ...coverage.rings.ring import Setup
from ...coverage.rings.ring_kinematics import sensor_cones
from ...coverage.rings.rounding import rounded
from ...coverage.solids.base import Parts
from ...coverage.targets.target import Target
from ...formats.schema.proposal_models import ProposalFile
from ...formats.writing import to_toml
from ...objectives.occlusion import sight
from ...objectives.scene import CoreScene
from ...objectives.tolerance import exact_zetas
from ...objectives.verify import Verifier
from .channel_assignment import told
from .mounting_error_model import LIMITS, NAMES
from .ring_fit import RingFit

_SHOWN = {
    "slip": (1000.0, "mm"),
    "tilt": (180 / math.pi, "°"),
    "phase": (180 / math.pi, "°"),
    "offset": (1000.0, "mm"),
}


@dataclass(frozen=True)
class Zeta:
    """ζ of a target, in [0, 1]."""

    target: Target
    """The target."""
    proposed: float
    """ζ of the proposed setup."""
    built: float
    """ζ of the setup as built."""
    alive: float
    """ζ of the setup as built, without dead sensors."""


@dataclass(frozen=True)
class AsBuilt:
    """The setup as built."""

    scene: CoreScene
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

    def zeta(self, target: Target, verifier: Verifier | None = None) -> Zeta:
        """Count ζ; ``verifier`` must be of the same scene."""
        verifier = verifier or Verifier(self.scene)
        proposed, built = (verifier.verify(s, target).zeta for s in (self.proposed, self.setup))
        alive = built if self.alive.all() else float(exact_zetas(verifier, target, self._living)[0])
        return Zeta(target, proposed, built, alive)

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

    def proposal(self, name: str, verifier: Verifier | None = None) -> ProposalFile:
        """Return the setup as built as a proposal's file, with ζ of the scene's targets verified
        again.
        """
        verifier = verifier or Verifier(self.scene)
        zeta = [
            replace(verified.in_scene(name, self.scene), seconds=0.0)  # one file of one reading
            for verified in verifier.verify_goals(self.setup)
        ]
        return ProposalFile.of(self.setup, self.scene, zeta=zeta)

    def toml(self, name: str, verifier: Verifier | None = None) -> str:
        """Return the same as text, with the findings as comments."""
        return to_toml(
            self.proposal(name, verifier),
            "\n".join(["As built, from a mount check:", *self.text()]),
        )

    def text(self, confidence: float = 0.95) -> list[str]:
        """Compare each ring with its proposal and list its faults, as lines."""
        lines = []
        for i, fit in enumerate(self.fits):
            margins = fit.margins(confidence)
            found = [_shown(*each) for each in zip(fit.names, fit.values, margins, strict=True)]
            sure = (
                f"{100 * confidence:.0f} % confidence, {fit.used} readings, residuals"
                f" {fit.scale:.2f} of the noise model"
            )
            values = f"{', '.join(found)} ({sure})" if found else "not estimated, as proposed here"
            lines.append(f"ring {i} ({fit.nominal.link}): {values}")
            said = [*faults(fit, i), *undetermined(fit)]
            lines += [f"ring {i} ({fit.nominal.link}): {one}" for one in said]
        first = len(self.proposed.rings)
        lines += [f"{self.proposed.group_name(first + k)}: never answers" for k in self.silent]
        return lines


def _shown(name: str, value: float, margin: float) -> str:
    factor, unit = _SHOWN[name]
    return f"{name} {factor * value:+.2f} ± {factor * margin:.2f} {unit}"


def faults(fit: RingFit, number: int) -> list[str]:
    """List the differences of ring ``number`` from its proposal."""
    found = told(fit.order, fit.mixed)
    found += _mixed_grids(fit)
    if fit.zones is not None:
        found += fit.zones.faults(number, fit.nominal.link)
    if fit.dead:
        found.append(f"has dead sensors, by place in its frames: {', '.join(map(str, fit.dead))}")
    if fit.ring.position < 0 or fit.ring.position > 1:
        found.append(f"sits beyond its link's end, at {fit.ring.position:.3f}")
    limit = LIMITS[[NAMES.index(name) for name in fit.names]]
    beyond = np.flatnonzero(np.abs(fit.values) > limit + fit.margins())
    return found + [f"is off by more than careful mounting allows: {fit.names[k]}" for k in beyond]


def undetermined(fit: RingFit) -> list[str]:
    """List what the readings do not determine about a ring, with the reason."""
    if fit.unfit:
        return [f"not determined, as proposed here: {fit.unfit}"]
    return [f"not determined by these readings: {', '.join(fit.open)}"] * bool(fit.open)


def _mixed_grids(fit: RingFit) -> list[str]:
    """Describe grids of zones that fit no turn and no mirror, one line for each likely order."""
    each: dict[str, list[str]] = {}
    for wire, text in fit.misfits.items():
        each.setdefault(text, []).append(str(wire))
    return [
        f"the grids of sensors {', '.join(wires)} fit no turn and no mirror"
        + f"; they fit if the {text}: mend the order of the zones in the firmware" * bool(text)
        for text, wires in each.items()
    ]


def truth_of(fit: RingFit, errors: Float[np.ndarray, " 4"]) -> Float[np.ndarray, " p"]:
    """Select from errors by ``NAMES`` those that a fit estimated."""
    return np.array([errors[NAMES.index(name)] for name in fit.names])
