"""Findings about a ring's line: status codes that its decoder does not know, and lines of text
outside its grammar.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from ...coverage.rings.ring import Setup
from ...formats.ring_status import CHIPS, Status, likely_chip
from ..rings.protocol import Counts
from .models import LineModel

_RARE = 5.0  # percent of a sensor's frames; more unknown codes differ from the proposal


def unknown_codes(counts: Counts) -> dict[str, dict[str, float]]:
    """Return the share in percent of each status code that the decoder does not know, by sensor
    and code; with those that it knows in another sense than the chip whose codes these seem to be.
    """
    if counts.codes is None or not (counts.codes[:, len(Status) :]).any():
        return {}
    chip = likely_chip(np.asarray(counts.codes.sum(axis=0)))
    doubtful = np.arange(256) >= len(Status)
    most = (counts.codes[:, doubtful].sum(axis=1) / counts.codes.sum(axis=1)).max()
    if chip is not None and 100 * most > _RARE:  # else a line that spoils a byte now and then
        doubtful[: len(Status)] = chip.status(np.arange(len(Status))) != np.arange(len(Status))
    found: dict[str, dict[str, float]] = {}
    for sensor, row in enumerate(counts.codes):
        shares = 100 * row / max(int(row.sum()), 1)
        if (row[doubtful] > 0).any():
            which = np.flatnonzero(doubtful & (row > 0))
            found[str(sensor)] = {str(code): round(float(shares[code]), 3) for code in which}
    return found


def chip_of(counts: Counts) -> str | None:
    """Return the chips whose codes a ring seems to send, if it sends unknown ones."""
    if counts.codes is None or not unknown_codes(counts):
        return None
    chip = likely_chip(np.asarray(counts.codes.sum(axis=0)))
    return None if chip is None else chip.chip


def code_findings(setup: Setup, lines: Sequence[LineModel]) -> tuple[list[str], list[str]]:
    """Describe the unknown status codes of each ring, one line each: differences from the proposal,
    and warnings where they are rare.
    """
    differ, rare = list[str](), list[str]()
    for line in lines:
        if line.unknown_codes:
            most = max(sum(each.values()) for each in line.unknown_codes.values())
            text = f"{setup.group_name(line.ring)}: {_codes_text(line)}"
            (differ if most > _RARE else rare).append(text)
    return differ, rare


def _codes_text(line: LineModel) -> str:
    """Describe the unknown status codes of a line, and what to do."""
    alike: dict[str, list[str]] = {}
    for sensor, each in line.unknown_codes.items():
        alike.setdefault(_shares(each), []).append(sensor)
    sensors = "; ".join(f"sensor {', '.join(some)}: {text}" for text, some in alike.items())
    chip = next((one for one in CHIPS if one.chip == line.codes_of), None)
    if chip is None:
        return f"sends unknown status codes: {sensors}: translate them in its firmware"
    also = "; then 1 is an uncertain distance and 2 is no target, not the reverse"
    also *= chip.meaning.get(1) == Status.WEAK
    way = f"name the decoder {chip.decoder}, or translate them" * line.decoder.startswith("esp32")
    return (
        f"sends unknown status codes: {sensors}; they seem to be those of a {chip.chip}{also}:"
        f" {way or 'translate them'} in its firmware"
    )


def _shares(codes: Mapping[str, float]) -> str:
    """Describe codes with their shares, rounded to whole percent."""
    return ", ".join(f"{code} in {max(round(share), 1)} %" for code, share in codes.items())
