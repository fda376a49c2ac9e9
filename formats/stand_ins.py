"""Content that is not the file that its name says: a pointer of Git LFS, an HTML page, or both
sides of a merge conflict."""

import re

from ..coverage.definitions.errors import UserError

_START = 4096  # bytes in which a page or a pointer states what it is
_HTML = re.compile(
    rb"\A(?:\xef\xbb\xbf)?\s*(?:<\?xml[^>]*>\s*)?<(?:!doctype\s+html|html)[\s>]",
    re.IGNORECASE | re.DOTALL,
)
_POINTER = re.compile(
    rb"\A(?:version https://(?:git-lfs|hawser)\.github\.com/spec/|\S*/annex/objects/)"
)
_MARK = re.compile(rb"^[ \t]*(?:(?:<{7}|>{7}|\|{7})(?:[ \t][^\n]*)?|={7})[ \t]*\r?$", re.MULTILINE)
_MARKS = (b"<<<<<<<", b">>>>>>>", b"|||||||", b"=======")
_COMMENT = re.compile(rb"<!--.*?-->", re.DOTALL)


def refuse_stand_in(data: bytes, name: str) -> None:
    """Refuse the content of a file if it is no such file at all.

    A merge conflict within an XML comment changes nothing and is no reason.

    Args:
        data: the content.
        name: the file, for messages.

    Raises:
        UserError: for a pointer, a page or a merge conflict.
    """
    start = data[:_START]
    if _POINTER.match(start):
        raise UserError(f"{name}: found a pointer of Git LFS, not the file; run: git lfs pull")
    if _HTML.match(_without_comments(start)):
        raise UserError(f"{name}: found an HTML page, not the file; download the raw file again")
    if not any(mark in data for mark in _MARKS) or _MARK.search(data) is None:
        return
    bare = _without_comments(data)
    if (mark := _MARK.search(bare)) is not None:
        line = bare.count(b"\n", 0, mark.start()) + 1
        raise UserError(
            f"{name}: found a merge conflict at line {line}, allowed: one version; resolve it in"
            " the file"
        )


def _without_comments(data: bytes) -> bytes:
    """Return a text with the line ends only of its XML comments, in time in proportion to it."""
    end = data.rfind(b"-->") + 1  # so that each search for the end of a comment finds one
    closed = _COMMENT.sub(lambda comment: b"\n" * comment[0].count(b"\n"), data[: end and end + 2])
    return closed + data[end and end + 2 :]
