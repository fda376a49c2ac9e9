"""A page's state as the query of its address, so that a link opens it."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, fields
from urllib.parse import quote, unquote, urlencode

from ..coverage.rings.ring import Setup
from .edited_setup import MOST_RINGS, StatedRing

_FIELDS = len(fields(StatedRing))


@dataclass(frozen=True)
class LinkState:
    """What a link states; None: as the page opens."""

    target: str | None = None
    """Label of the target."""
    pose: int | None = None
    """Index of the pose."""
    occlusion: str | None = None
    """Model of occlusion."""
    rings: tuple[StatedRing, ...] | None = None
    """Rings of the setup to change."""
    view: str | None = None
    """Standard view."""
    dark: bool | None = None
    """Whether the page is dark."""

    def query(self) -> str:
        """Return the query of the address."""
        stated = {
            "target": self.target,
            "pose": self.pose,
            "occlusion": self.occlusion,
            "rings": None if self.rings is None else ";".join(map(_written, self.rings)),
            "view": self.view,
            "dark": None if self.dark is None else int(self.dark),
        }
        return urlencode({k: v for k, v in stated.items() if v is not None}, safe=";,()")


def ring_values(setup: Setup) -> tuple[StatedRing, ...]:
    """Return what a link states of each ring of a setup."""
    return tuple(
        StatedRing(
            r.link,
            round(r.position, 6),
            r.count,
            round(math.degrees(r.tilt), 4),
            round(math.degrees(r.phase), 4),
        )
        for r in setup.rings
    )


def _written(ring: StatedRing) -> str:
    return ",".join([quote(ring.link, safe=""), *(f"{v:.9g}" for v in astuple(ring)[1:])])


def read_query(query: Mapping[str, str]) -> LinkState:
    """Return the state that a query describes; keys that it does not know are left out.

    Raises:
        ValueError: for a value that cannot be read.
    """
    pose, rings, dark = query.get("pose"), query.get("rings"), query.get("dark")
    return LinkState(
        query.get("target"),
        None if pose is None else _number(pose, "pose"),
        query.get("occlusion"),
        None if rings is None else tuple(map(_ring, _parts(rings))),
        query.get("view"),
        None if dark is None else dark not in ("0", "false", "no"),
    )


def _parts(rings: str) -> Sequence[str]:
    parts = [part for part in rings.split(";") if part]
    if len(parts) > MOST_RINGS:
        raise ValueError(f"link: found {len(parts)} rings, allowed: at most {MOST_RINGS}")
    return parts


def _number(text: str, key: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise ValueError(f"link: {key}: found {text[:40]!r}, allowed: a whole number") from None


def _ring(text: str) -> StatedRing:
    parts = text.split(",")
    try:
        if len(parts) != _FIELDS:
            raise ValueError
        position, tilt, phase = (float(parts[i]) for i in (1, 3, 4))
        if not all(map(math.isfinite, (position, tilt, phase))):
            raise ValueError
        return StatedRing(unquote(parts[0]), position, int(parts[2]), tilt, phase)
    except ValueError:
        wanted = "link,position,count,tilt_deg,phase_deg"
        raise ValueError(f"link: rings: found {text[:60]!r}, allowed: {wanted}") from None
