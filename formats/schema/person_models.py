"""Model of where people walk in a cell and how far they reach."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from ...coverage.person_reach import SHOULDER, Person
from .base_model import refuse
from .field_types import FARTHEST, Coordinate
from .mapping import MappedModel

_Corner = Annotated[list[Coordinate], Field(min_length=2, max_length=2)]


class PersonModel(MappedModel[Person]):
    """Where people walk and how far they reach: what a target that is ``reachable = "person"`` is
    cut to, and where blind spots are sought."""

    floor: float | None = Field(
        default=None,
        ge=-FARTHEST,
        le=FARTHEST,
        description="height of the floor, m; the highest floor of the obstacles if absent",
    )
    areas: list[Annotated[list[_Corner], Field(min_length=3, max_length=1000)]] = Field(
        default=[],
        max_length=100,
        description="walkable areas, polygons of corners (x, y) m; the whole floor if absent",
    )
    height: float = Field(
        default=Person.height, ge=0.5, le=2.5, description="stature of the tallest person, m"
    )
    shoulder: float = Field(
        default=Person.shoulder,
        ge=0.1,
        le=SHOULDER * 2.5,
        description="height of the smallest person's shoulders above the floor, m",
    )
    radius: float = Field(
        default=Person.radius, ge=0.05, le=0.5, description="radius of the body, m"
    )
    reach: float = Field(
        default=Person.reach, ge=0, le=2, description="length of an arm from the body's surface, m"
    )

    @model_validator(mode="after")
    def _agreeing(self) -> Self:
        most = SHOULDER * self.height
        if self.shoulder > most:
            allowed = f"at most {most:.4g} m, {SHOULDER:g} of height"
            refuse([(("shoulder",), self.shoulder, allowed)])
        return self
