"""Occlusion models: how the robot's own body and the cell affect a beam."""

from typing import Literal, get_args

Occlusion = Literal["ignore", "shadow", "returns", "blind"]
"""``ignore``: bodies occlude nothing, as in the paper. ``shadow``: points behind a body are not
covered. ``returns``: nor is a point whose return a single-zone sensor cannot tell from those of
bodies in its beam, or has no target left to report (``unreported``). ``blind``: a single-zone
sensor sees nothing beyond the first return in its beam; ``returns`` with one target."""
OCCLUSIONS: tuple[Occlusion, ...] = get_args(Occlusion)
"""All models; each covers no point that an earlier one does not."""
REPORTING: tuple[Occlusion, ...] = ("returns", "blind")
"""Models in which bodies in the beam of a single-zone sensor take its targets."""
ONE_TARGET = tuple(model for model in OCCLUSIONS if model != "returns")
"""Models that differ for sensors of one target."""
