"""Model of the output of ``improve --json``: changes to a mounted setup, step by step."""

from pydantic import Field

from ...coverage.rings.ring import Ring
from ...objectives.verified import Verified
from ...placement.redesign.changes import Answer
from .base_model import Percent
from .versions import SceneInFiles, VersionedFile


class ImproveResult(VersionedFile):
    """Output of ``improve --json``. A number of changes without a further gain has no step."""

    setup: str = Field(description="name or file of the mounted setup")
    scene: SceneInFiles = Field(description="scene of the setup")
    most_changes: int = Field(description="largest number of changes")
    add_sensors: int = Field(description="largest number of additional sensors")
    outcome: str = Field(description="how the search ended")
    seed: int = Field(description="random seed")
    seconds: float = Field(ge=0, description="wall-clock time, s")
    exact_percent: Percent = Field(
        description="exact coverage as mounted, weighted mean over the targets, percent"
    )
    short_percent: float = Field(
        ge=0, description="sum by which floors are missed as mounted, percentage points"
    )
    rings: list[Ring] = Field(description="mounted rings")
    zeta: list[Verified] = Field(description="verified coverage of each target as mounted")
    broken: list[str] = Field(description="rules that the mounted setup breaks")
    steps: list[Answer] = Field(description="best setups with a growing number of changes")
    files: dict[str, str] = Field(default={}, description="written files")
