"""Markdown pages, and the same pages as self-contained HTML for screen and print."""

import base64
import csv
import io
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from string import punctuation

from markdown_it import MarkdownIt

from ..formats.escaping import printable, printable_lines

_IMAGE = re.compile(r'src="([\w.-]+\.png)"')
_PICTURE = re.compile(r"[\w.-]+\.png")
# bars are escaped by ``table``; the other marks left out mean nothing within a line
_MARKUP = str.maketrans({c: f"\\{c}" for c in punctuation if c not in "|,;?%/()"})
_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
_STYLE = """body { max-width: 72rem; margin: 2rem auto; padding: 0 1rem; font: 16px/1.5 system-ui, \
sans-serif;
color: #23272b } h1, h2, h3 { line-height: 1.25 } h2 { margin-top: 2.4rem } h3 { margin-top: \
1.6rem }
img { max-width: 100% } table { border-collapse: collapse; font-size: 14px; margin: 1rem 0 }
th, td { border-bottom: 1px solid #d9dde1; padding: 0.3rem 0.7rem; text-align: left; \
vertical-align: top }
td { font-variant-numeric: tabular-nums } th { border-bottom: 2px solid #23272b }
code, pre { background: #f1f3f5; padding: 0 0.2rem }
pre { padding: 0.6rem 0.9rem; white-space: pre-wrap; overflow-wrap: anywhere }
blockquote { margin: 1rem 0; padding: 0.3rem 1.1rem; border-left: 4px solid #0072B2; font-size: \
1.1em }
@media screen and (max-width: 60rem) { table { display: block; overflow-x: auto } \
td { min-width: 3.5rem } }
@page { size: A4; margin: 16mm 14mm }
@media print { body { max-width: none; margin: 0; padding: 0; font-size: 10.5pt; \
print-color-adjust: exact }
table { font-size: 8.5pt } th, td { padding: 0.15rem 0.5rem } h2 { margin-top: 1.4rem } h2, h3 { \
break-after: avoid }
table, tr, img, pre, blockquote { break-inside: avoid } thead { display: table-header-group }
p:has(+ table), p:has(+ p > img) { break-after: avoid } p { orphans: 3; widows: 3 } }"""


def escaped(text: str) -> str:
    """Return a user's or a file's text as one line of Markdown without links, images or markup."""
    return printable(" ".join(text.split())).translate(_MARKUP)


def code(text: str) -> str:
    """Return a Markdown code block that shows ``text`` verbatim, with an empty line after it."""
    return "".join(f"    {printable(line)}\n" for line in text.splitlines()) + "\n"


def table(heads: Sequence[str], rows: Iterable[Sequence[str]], right: Collection[int] = ()) -> str:
    """Return a Markdown table with an empty line after it; columns ``right`` are right-aligned."""
    rules = [" ---: |" if i in right else " --- |" for i in range(len(heads))]
    lines = ["| " + " | ".join(heads) + " |", "|" + "".join(rules)]
    lines += ["| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def csv_text(records: Sequence[Mapping[str, object]]) -> str:
    """Return records with the same keys as CSV with a header."""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(records[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(records)
    return text.getvalue()


def html(markdown: str, folder: Path, title: str) -> str:
    """Return a page as self-contained HTML with all characters escaped.

    PNG files of ``folder`` that the page names are embedded. Every other link or image stays text,
    so that no page refers to anything outside.

    Args:
        markdown: the page.
        folder: folder of its images.
        title: title of the HTML document.
    """

    def embedded(match: re.Match[str]) -> str:
        image = base64.b64encode((folder / match[1]).read_bytes()).decode()
        return f'src="data:image/png;base64,{image}"'

    def picture(url: str) -> bool:
        return _PICTURE.fullmatch(url) is not None and (folder / url).is_file()

    parser = MarkdownIt("commonmark", {"html": False}).enable("table")
    # markdown-it asks this method which links to keep
    parser.validateLink = picture  # type: ignore[method-assign]
    head = (
        '<meta charset="utf-8"><meta http-equiv="Content-Security-Policy"'
        f' content="{_POLICY}"><meta name="viewport"'
        f' content="width=device-width"><title>{escape(printable(" ".join(title.split())))}</title>'
    )
    body = _IMAGE.sub(embedded, parser.render(printable_lines(markdown)))
    return (
        f'<!doctype html>\n<html lang="en">\n<head>{head}\n<style>{_STYLE}</style></head>\n'
        f"<body>\n{body}</body>\n</html>\n"
    )
