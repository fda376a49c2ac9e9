"""Models of the output of ``report --json`` and ``export --json``: the files that were written."""

from pydantic import Field

from .base_model import StrictModel
from .result_models import VerifyResult


class ReportResult(StrictModel):
    """Output of ``report --json``."""

    setup: str = Field(description="the setup: its name or file")
    page: str = Field(description="path of report.html")
    zeta: list[VerifyResult] = Field(description="coverage of the setup for each target")


class ExportResult(StrictModel):
    """Output of ``export --json``."""

    setup: str = Field(description="the setup: its name or file")
    formats: list[str] = Field(description="the formats")
    files: list[str] = Field(description="paths of the files")
