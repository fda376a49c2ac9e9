"""Which numbers of rings and sensors the rooms on a robot's links allow."""

from collections.abc import Sequence
from dataclasses import dataclass

MOST_RINGS = 64  # free rings in a search that chooses counts: work and memory grow with them


@dataclass(frozen=True)
class RingBudget:
    """A requested number of rings with its sensors, beside the room that there is."""

    rings: int
    """Requested rings, fixed ones included."""
    fixed: int
    """Fixed rings."""
    sensors: int
    """Requested sensors, those of the fixed rings included."""
    held: int
    """Sensors of the fixed rings."""
    least: int
    """Fewest sensors of a ring."""
    largest: Sequence[int]
    """Largest sensor count of each free ring that fits, in descending order."""

    @property
    def most(self) -> int:
        """Most sensors that the rings hold, fixed ones included."""
        return self.held + sum(self.largest[: self.rings - self.fixed])

    def refusal(self, barred: str = "", equal: Sequence[int] | None = None) -> str | None:
        """Return why the rings cannot be placed, in one line; None if they can.

        Args:
            barred: why links carry no ring, as the end of a sentence.
            equal: where all new rings must have ``least`` sensors: the largest sensor count of each
                ring without that rule, in descending order.
        """
        free = self.rings - self.fixed
        requested, sensors = _counted(self.rings, "ring"), _counted(self.sensors, "sensor")
        if free < 0:
            are = "is" if self.rings == 1 else "are"
            return f"{requested} {are} fewer than the {self.fixed} fixed ones; request more"
        if free > len(self.largest):
            if len(self.largest) == MOST_RINGS:
                return f"{requested} do not fit: a search places at most {MOST_RINGS} free rings"
            size = f"at least {self.least}" if equal is None else f"{self.least}"
            beside = f" besides the {self.fixed} fixed ones" if self.fixed else ""
            fit = (
                f"; rings of at most {equal[free - 1]} sensors fit"
                if equal and (free <= len(equal))
                else ""
            )
            return (
                f"{requested} of {size} sensors do not fit: there is room for"
                f" {len(self.largest)}{beside}{fit}{barred}"
            )
        least = self.held + free * self.least
        if self.sensors < least:
            return (
                f"{sensors} are too few for {requested}: they need at least {least}; request more"
                " sensors or fewer rings"
            )
        if self.sensors > self.most:
            return (
                f"{sensors} do not fit on {requested}, which hold at most {self.most}; request"
                " fewer sensors or more rings"
            )
        return None


def _counted(n: int, name: str) -> str:
    return f"{n} {name}" if n == 1 else f"{n} {name}s"
