"""Records of how far sensors and people reach into a target, in percent."""

from typing import Annotated, Self

from pydantic import Field

from ...objectives.reach import Beyond
from ...objectives.verify_breakdown import PeopleShare
from .field_types import Percent
from .mapping import COVERAGE, MappedModel, Of


class BeyondModel(MappedModel[Beyond]):
    """The part of a target that no layout covers."""

    percent: Annotated[Percent, Of("share", COVERAGE)] = Field(
        description="part of the target that is beyond any sensor that the rules allow, percent"
    )
    error_percent: Annotated[Percent, Of("error", COVERAGE)] = Field(
        description="Monte Carlo error of it, percentage points, at a confidence of 95 %"
    )


class PeopleModel(MappedModel[PeopleShare]):
    """The part of a target that a person can touch."""

    percent: Annotated[Percent, Of("share", COVERAGE)] = Field(
        description="part of the target's volume that a person can touch, percent"
    )
    zeta_percent: Annotated[Percent, Of("zeta", COVERAGE)] = Field(
        description="coverage of this part, percent"
    )

    @classmethod
    def of(cls, share: PeopleShare | None) -> Self | None:
        """Return the record; None where the scene states no person."""
        return None if share is None else cls.from_domain(share)
