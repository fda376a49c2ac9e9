"""Pages of studies: Markdown, and the same as one HTML file that needs nothing else."""

import base64
import csv
import io
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from markdown_it import MarkdownIt

_IMAGE = re.compile(r'src="([\w.-]+\.png)"')
_STYLE = """body { max-width: 72rem; margin: 2rem auto; padding: 0 1rem; font: 16px/1.5 system-ui, sans-serif;
color: #23272b }
img { max-width: 100% } table { border-collapse: collapse; font-size: 14px; margin: 1rem 0 }
th, td { border-bottom: 1px solid #d9dde1; padding: 0.3rem 0.7rem; text-align: left; vertical-align: top }
th { border-bottom: 2px solid #23272b } code { background: #f1f3f5; padding: 0 0.2rem }
@media print { body { max-width: none; font-size: 11px } table { font-size: 10px } h2 { break-after: avoid } }"""


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table, with an empty line after it."""
    lines = ["| " + " | ".join(heads) + " |", "|" + " --- |" * len(heads)]
    lines += ["| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def csv_text(records: Sequence[Mapping[str, Any]]) -> str:
    """Records with the same keys as CSV with a head."""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(records[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(records)
    return text.getvalue()


def html(markdown: str, folder: Path, title: str) -> str:
    """The page as self-contained HTML; its images (PNG) are taken from ``folder``."""

    def embedded(match: re.Match[str]) -> str:
        return f'src="data:image/png;base64,{base64.b64encode((folder / match[1]).read_bytes()).decode()}"'

    body = _IMAGE.sub(embedded, MarkdownIt("commonmark", {"html": False}).enable("table").render(markdown))
    head = f'<meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>{title}</title>'
    return (
        f'<!doctype html>\n<html lang="en">\n<head>{head}\n<style>{_STYLE}</style></head>\n<body>\n{body}</body>\n</html>\n'
    )
