"""The models of ``printing.json``: printed rings and what was measured of them."""

from pydantic import Field

from .base_model import StrictModel
from .versions import VersionedFile


class PrintCheck(StrictModel):
    """Something measured on a printed ring, what is allowed, and whether it holds."""

    name: str
    measured: float
    least: float | None = None
    most: float | None = None
    unit: str = ""
    holds: bool


class PrintedRing(StrictModel):
    """A printed ring: its files, where it goes, what else it takes, and what was measured of it."""

    ring: int = Field(ge=0, description="counted from 0")
    link: str
    position_mm: float = Field(
        description="of its lenses from the mount's proximal end, along the link"
    )
    count: int
    tilt_deg: float
    radius_mm: float
    bore_mm: float = Field(description="diameter")
    size_mm: list[float] = Field(description="of the larger half as it is printed")
    flipped: bool = Field(description="mounted with its bed side towards distal")
    board: str = Field(description="where its figures are from")
    screws: str
    bolts: str
    files: list[str]
    checks: list[PrintCheck]


class PrintResult(VersionedFile):
    """What ``export --to stl`` leaves in printing.json."""

    rings: list[PrintedRing]
    assembled: str = Field(description="picture of the first ring with boards and link")
