"""Model of the board that carries a sensor."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from ...coverage.sensors.boards import Board
from .base_model import refuse
from .mapping import MappedModel

_Small = Annotated[float, Field(gt=0, le=0.2, description="length, m")]
_OnBoard = Annotated[
    list[Annotated[float, Field(ge=-0.1, le=0.1, description="coordinate from the middle, m")]],
    Field(min_length=2, max_length=2),
]


class BoardModel(MappedModel[Board]):
    """The board that carries a sensor, seen from the front; x points right, y up, from its
    middle."""

    width: _Small = Field(description="width of the board, m")
    height: _Small = Field(description="height of the board, m")
    thickness: _Small = Field(default=0.0016, description="thickness of the board, m")
    lens: _OnBoard = Field(default=[0.0, 0.0], description="position of the sensor's lens, m")
    lens_height: float = Field(
        default=0.001, ge=0, le=0.1, description="height of the sensor's front above the board, m"
    )
    holes: list[_OnBoard] = Field(
        default=[], max_length=16, description="positions of the screw holes, m"
    )
    hole: _Small = Field(default=0.0025, description="diameter of the holes, m")
    plugs: Annotated[
        list[Annotated[float, Field(ge=0, le=0.1, description="room beyond an edge, m")]],
        Field(min_length=2, max_length=2),
    ] = Field(
        default=[0.0, 0.0],
        description="room for plugs beyond the edges left and right, and above and below, m",
    )
    plug_height: float = Field(
        default=0.003,
        ge=0,
        le=0.1,
        description="height of plugs, and of other parts under a lid, above the board's front, m",
    )
    source: str = Field(default="", max_length=1000, description="source of the figures")

    @model_validator(mode="after")
    def _within_its_outline(self) -> Self:
        half = (self.width / 2, self.height / 2)
        spots = {("lens",): (self.lens, 0.0)} | {
            ("holes", i): (at, self.hole / 2) for i, at in enumerate(self.holes)
        }
        refuse(
            (loc, str(at), f"within the outline of {self.width:g} by {self.height:g} m")
            for loc, (at, r) in spots.items()
            if any(abs(x) + r > h for x, h in zip(at, half, strict=True))
        )
        return self
