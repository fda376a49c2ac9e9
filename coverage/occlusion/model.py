"""The models of occlusion: what the robot's own body and the cell do to a beam."""

from typing import Literal, get_args

Occlusion = Literal["ignore", "shadow", "blind"]
"""``ignore``: bodies hide nothing, as in the paper. ``shadow``: points behind a body are not
covered. ``blind``: a sensor of one zone sees nothing beyond the nearest thing in its beam."""
OCCLUSIONS: tuple[Occlusion, ...] = get_args(Occlusion)
