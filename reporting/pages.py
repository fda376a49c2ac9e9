"""Markdown pages, and the same pages as self-contained HTML for screen and print."""

import base64
import csv
import io
import re
import shlex
from collections.abc import Collection, Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from string import punctuation
from typing import Any

from markdown_it import MarkdownIt
from markdown_it.token import Token

from ..coverage.definitions.escaping import printable, printable_lines

_IMAGE = re.compile(r'src="([\w.-]+\.png)"')
_PICTURE = re.compile(r"[\w.-]+\.png")
# bars are escaped by ``table``; the other marks left out mean nothing within a line
_VERDICTS = {"Passes.": "passes", "Fails.": "fails"}
_MARKUP = str.maketrans({c: f"\\{c}" for c in punctuation if c not in "|,;?%/()"})
_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
_STYLE = """body { max-width: 60rem; margin: 2rem auto; padding: 0 1rem; \
font: 16px/1.5 system-ui, "DejaVu Sans", sans-serif; color: #23272b }
h1, h2, h3 { line-height: 1.25; text-wrap: balance; overflow-wrap: anywhere }
h2 { margin-top: 2.6rem; padding-top: 0.6rem; border-top: 2px solid #0072B2 }
h3 { margin-top: 1.6rem } hr { border: 0 }
img { max-width: 100%; height: auto } table { border-collapse: collapse; font-size: 14px; \
margin: 1rem 0 }
th, td { border-bottom: 1px solid #d9dde1; padding: 0.3rem 0.7rem; text-align: left; \
vertical-align: top }
td { font-variant-numeric: tabular-nums } th { border-bottom: 2px solid #23272b }
td code { overflow-wrap: anywhere }
code, pre { background: #f1f3f5; padding: 0 0.2rem } p > code, li > code { white-space: nowrap }
pre { padding: 0.6rem 0.9rem; white-space: pre; overflow-x: auto }
blockquote { margin: 1rem 0; padding: 0.3rem 1.1rem; border-left: 6px solid #0072B2; font-size: \
1.1em; background: #eef4f9 }
blockquote.passes { border-color: #00805f; background: #e8f5f0 }
blockquote.fails { border-color: #b3261e; background: #fbeae9 }
@media screen and (max-width: 60rem) { table { display: block; overflow-x: auto } \
td { min-width: 3.5rem } \
td:not([style]):nth-child(n + 3) { min-width: 7rem } \
p > code, li > code { white-space: normal; overflow-wrap: anywhere } \
p:has(> img) { overflow-x: auto } img[alt^="Rings on"] { max-width: none; min-width: 40rem } }
@page { size: A4; margin: 20mm 14mm 18mm; \
@top-left { content: TITLE; font: 8pt sans-serif; color: #666d75 } \
@bottom-right { content: counter(page) " of " counter(pages); font: 8pt sans-serif; \
color: #666d75 } }
@page :first { @top-left { content: "" } }
@media print { body { max-width: none; margin: 0; padding: 0; font-size: 10pt; line-height: 1.4; \
print-color-adjust: exact }
h1 { font-size: 20pt; margin-top: 0 } h2 { font-size: 14pt; margin: 1.2rem 0 0.6rem } h3 { \
font-size: 11pt; margin: 0.9rem 0 0.4rem }
table { font-size: 8pt; margin: 0.5rem 0 } th, td { padding: 0.12rem 0.4rem } h2, h3 { \
break-after: avoid }
p, ul { margin: 0.5rem 0 } pre { white-space: pre-wrap; overflow-wrap: anywhere; font-size: 8.5pt }
tr, img, pre, blockquote { break-inside: avoid } tr:nth-child(-n + 2) { break-after: avoid } \
tr:nth-last-child(2) { break-after: avoid } thead { display: table-header-group }
table:not(:has(tr:nth-child(14))) { break-inside: avoid }
hr { break-after: page; margin: 0; height: 0 } hr + h2 { margin-top: 0 }
img { max-height: 110mm } p:has(+ table), p:has(+ pre), p:has(+ ul) { break-after: avoid } \
p, li { break-inside: avoid } }"""


def _css_string(text: str) -> str:
    """Return a text as a CSS string in which every character but letters and digits is an
    escape."""
    return '"' + "".join(c if c.isascii() and c.isalnum() else f"\\{ord(c):x} " for c in text) + '"'


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


def csv_text(records: Sequence[Mapping[str, object]], keys: Sequence[str] = ()) -> str:
    """Return records with the same keys, by default those of the first, as CSV with a header."""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(keys or records[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(records)
    return text.getvalue()


def command(words: Sequence[str]) -> str:
    """Return a command as a Markdown code block with one option on each line, so that no line
    breaks inside an option; a shell reads it as one command."""
    lines = list[list[str]]()
    for word in words:
        if word.startswith("-") or not lines:
            lines.append([])
        lines[-1].append(word)
    return code(" \\\n    ".join(shlex.join(line) for line in lines))


def command_of(text: str) -> str:
    """Return a recorded command as a code block; a text that is no command line stays as it is."""
    try:
        words = shlex.split(text)
    except ValueError:
        return code(text)
    return command(words) if words and shlex.join(words) == text else code(text)


def _with_verdicts(tokens: list[Token]) -> None:
    """Give block quotes that begin with a verdict its class."""
    for i, token in enumerate(tokens[:-2]):
        if token.type == "blockquote_open" and (inline := tokens[i + 2].children):
            first = [child for child in inline if child.type != "text" or child.content][:2]
            if first[0].type == "strong_open" and first[1].content in _VERDICTS:
                token.attrSet("class", _VERDICTS[first[1].content])


def html(markdown: str, folder: Path, title: str) -> str:
    """Return a page as self-contained HTML with all characters escaped.

    Printed, each page but the first has the title on top, and all have their numbers. A thematic
    break ends a printed page, and a block quote that begins with ``**Passes.**`` or ``**Fails.**``
    is coloured.

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
    tokens, env = parser.parse(printable_lines(markdown)), dict[str, Any]()
    _with_verdicts(tokens)
    body = _IMAGE.sub(embedded, parser.renderer.render(tokens, parser.options, env))
    style = _STYLE.replace("TITLE", _css_string(printable(" ".join(title.split()))))
    return (
        f'<!doctype html>\n<html lang="en">\n<head>{head}\n<style>{style}</style></head>\n'
        f"<body>\n{body}</body>\n</html>\n"
    )
