"""Base model of all files: unknown keys and type conversions are rejected."""

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

Percent = Annotated[float, Field(ge=0, le=100, description="percentage")]


class StrictModel(BaseModel):
    """Base of all models: unknown keys are rejected, values are not converted, and instances are
    immutable."""

    model_config = ConfigDict(
        extra="forbid",
        strict=True,
        frozen=True,
        allow_inf_nan=False,
        defer_build=True,  # a command uses few of all models
        serialize_by_alias=True,
    )

    def stated(self) -> dict[str, Any]:
        """Return the keys that a TOML file of the model states."""
        return self.model_dump(mode="json")
