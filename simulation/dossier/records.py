"""Parts of a dossier: inputs with their state, separation distances, elements."""

from typing import Annotated, Literal

from pydantic import Field

from ...coverage.definitions.definition import definition

State = Literal[
    "measured by the user",
    "stated by the user",
    "maker's",
    "standard",
    "computed",
    "default",
    "assumed",
    "open",
]
"""Where a value comes from: ``default`` is a value that a source gives as an example, ``assumed``
one without a source, and ``open`` none at all."""
_Line = Annotated[str, Field(max_length=2000)]


@definition(kw_only=True)
class Input:
    """A value on which the dossier rests."""

    name: _Line
    """Name."""
    symbol: str = ""
    """Symbol in the formulas."""
    value: float | None = None
    """Value; None if open, or a text."""
    unit: str = ""
    """Unit."""
    text: _Line = ""
    """Value that is no number."""
    state: State
    """Where it comes from."""
    source: _Line
    """Source."""


@definition(kw_only=True)
class ApproachDistance:
    """Separation distances for one approach speed, at the fastest part of the robot."""

    approach: str
    """Part of the person that approaches."""
    speed_m_s: float
    """Approach speed K = v_h, m/s."""
    S_h: float
    """Distance that the person moves, v_h (T_r + T_s), m."""
    S_p_m: float
    """S_p = S_h + S_r + S_s + C + Z_d + Z_r, m."""
    S_m: float
    """S = K T + D_DS + Z with D_DS = C, m."""
    S_parallel_m: float
    """S for an approach parallel to the detection zone, m."""
    reached: bool
    """Whether every sensor's range is at least S_p."""
    some_reach: bool
    """Whether the range of at least one sensor is."""


@definition(kw_only=True)
class Element:
    """An element of the safety function, with its performance level."""

    element: _Line
    """The element."""
    default: _Line = ""
    """Default performance level of its safety function; empty if open."""
    default_state: State
    """Where the default comes from."""
    rating: _Line = ""
    """Rating; empty if open."""
    state: State
    """Where the rating comes from."""
    source: _Line = ""
    """Source of the rating."""
