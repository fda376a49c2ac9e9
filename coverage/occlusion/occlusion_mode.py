"""Occlusion models: how the robot's own body and the cell affect a beam."""

from typing import Literal, get_args

Occlusion = Literal["ignore", "shadow", "blind"]
"""``ignore``: bodies occlude nothing, as in the paper. ``shadow``: points behind a body are not
covered. ``blind``: a single-zone sensor sees nothing beyond the first return in its beam."""
OCCLUSIONS: tuple[Occlusion, ...] = get_args(Occlusion)
