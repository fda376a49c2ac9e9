"""Models of the output of ``report --json`` and ``export --json``: the files that were written."""

from typing import Literal

from pydantic import Field

from ...objectives.verified import Verified
from .base_model import StrictModel


class RequirementModel(StrictModel):
    """A required coverage of a target, with the proved interval of the coverage."""

    target: str = Field(description="label of the target, such as V_S(0.5)")
    required_percent: float = Field(description="required coverage, percent")
    low_percent: float = Field(description="lower end of the proved interval, percent")
    high_percent: float = Field(description="upper end of the proved interval, percent")
    passes: bool = Field(description="whether the lower end reaches the required coverage")


class VerdictModel(StrictModel):
    """Verdict of a report on one question."""

    question: Literal["mountable", "wireable", "powered", "covered"] = Field(
        description="what is decided"
    )
    state: Literal["pass", "fail", "not known"] = Field(description="the verdict")
    figure: str = Field(description="its figure, or the reason")


class ReportResult(StrictModel):
    """Output of ``report --json``."""

    setup: str = Field(description="the setup: its name or file")
    page: str = Field(description="path of report.html")
    pdf: str | None = Field(default=None, description="path of report.pdf; null without --pdf")
    zeta: list[Verified] = Field(description="coverage of the setup for each target")
    requirements: list[RequirementModel] = Field(
        default=[], description="required coverages, decided"
    )
    verdicts: list[VerdictModel] = Field(
        default=[], description="verdicts of the cover, each with its figure"
    )


class ExportResult(StrictModel):
    """Output of ``export --json``."""

    setup: str = Field(description="the setup: its name or file")
    formats: list[str] = Field(description="the formats")
    files: list[str] = Field(description="paths of the files")
