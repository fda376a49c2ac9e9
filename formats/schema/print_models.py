"""Models of ``printing.json``: printed rings and their measurements."""

from typing import Any

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer

from .base_model import StrictModel
from .versions import VersionedFile


class PrintCheck(StrictModel):
    """A measurement of a printed ring with its limits."""

    name: str = Field(description="name of the measurement")
    measured: float = Field(description="measured value")
    least: float | None = Field(default=None, description="smallest allowed value")
    most: float | None = Field(default=None, description="largest allowed value")
    unit: str = Field(default="", description="unit of the values")
    holds: bool = Field(description="whether the measured value is within its limits")


class PrintedLids(StrictModel):
    """The lids of a printed ring, which are all alike."""

    file: str = Field(description="name of the mesh file of a lid")
    copies: int = Field(ge=1, description="number of lids to print, one for each board")
    size_mm: list[float] = Field(description="dimensions of a lid in its printing orientation, mm")
    T_link_print: list[list[list[float]]] = Field(
        description="for each lid, the 4 x 4 transform as in T_link_print of the ring"
    )


class PrintedRing(StrictModel):
    """A printed ring: its files, position, hardware and measurements."""

    ring: int = Field(ge=0, description="number of the ring, counted from 0")
    link: str = Field(description="link that carries the ring")
    position_mm: float = Field(
        description="distance of the lenses from the mount's proximal end along the link, mm"
    )
    count: int = Field(description="number of sensors")
    tilt_deg: float = Field(description="tilt, degrees")
    radius_mm: float = Field(description="radius, mm")
    bore_mm: float = Field(description="diameter of the bore, mm")
    size_mm: list[float] = Field(
        description="largest dimensions of a part in its printing orientation, mm"
    )
    flipped: bool = Field(
        description="whether the side on the printing bed faces the distal end when mounted"
    )
    board: str = Field(description="source of the board's figures")
    screws: str = Field(description="screws that hold the boards")
    bolts: str = Field(description="bolts that close the ring")
    ties: int = Field(description="number of parts with a bridge for a cable tie")
    lettering: list[str] = Field(description="text engraved in each part; none: no room for it")
    files: list[str] = Field(description="names of the mesh files, and of the picture")
    frame: str = Field(
        description="frame of the link that carries the ring: the joint that moves it, or tcp"
    )
    T_link_print: dict[str, list[list[float]]] = Field(
        description=(
            "for each mesh file, the 4 x 4 transform from its coordinates, converted to metres, to"
            " that frame, translations in m"
        )
    )
    checks: list[PrintCheck] = Field(description="measurements")
    lids: PrintedLids | None = Field(
        default=None, description="lids of the boards; absent without printing.cover"
    )

    @model_serializer(mode="wrap")
    def _without_absent_lids(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        return {key: v for key, v in write(self).items() if key != "lids" or v is not None}


class PrintResult(VersionedFile):
    """The file ``printing.json`` of ``export --to stl``."""

    rings: list[PrintedRing] = Field(description="printed rings")
    assembled: str = Field(description="picture of the robot with all rings")
    mounted: str = Field(description="picture of the first ring with boards and link")
    plates: list[str] = Field(description="3MF files of parts that are printed together")
