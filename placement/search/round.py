"""Rounds of the coordinate exchange."""

from dataclasses import dataclass

SPREADS = (0.3, 1.0)  # standard deviations of the places near a ring, in units of a round's scale
_SOFTNESS = 0.02  # of the minimum over poses or losses, per scale of a round
_SOFTEST = 0.0015  # least of that softness


@dataclass(frozen=True)
class Round:
    """One round of the exchange."""

    points: int
    """Points of all goals and poses together."""
    keep: int
    """Number of the best candidates that enter the round."""
    sweeps: int
    """Sweeps over the rings of each candidate."""
    near: int
    """Places tried near a ring's own."""
    scale: float
    """Distance of the near places, as a share of the ring's bounds."""
    anywhere: int = 0
    """Places tried anywhere in the feasible set."""
    moves: int = 0
    """Moves tried in each sweep: of sensors between rings where counts are free, else of rings."""
    pairs: int = 0
    """Pairs of rings that each sweep moves together."""
    trials: int = 0
    """Trials of ruin and recreate for each candidate before the sweeps."""
    library: int = 0
    """Places anywhere in the feasible set from which they combine rings."""
    beside: int = 0
    """Places near each ring of each candidate from which they combine rings."""
    own: bool = False
    """Whether each candidate has a library of its own, so that candidates stay different; else they
    share one, and with it the rings of each other."""

    guess: bool = False
    """Whether guessed lines of sight also decide; else they only rank places."""

    @property
    def softness(self) -> float:
        """Softness of a worst pose or loss."""
        return max(_SOFTNESS * self.scale, _SOFTEST)
