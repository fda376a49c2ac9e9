"""Text of XML files from others: bounded in size, and without entities of its own.

Only the standard library's parser is used, and it refuses a document type, so that no entity is
expanded.
"""

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path
from xml.parsers import expat

from ...coverage.definitions.errors import UserError
from ..stand_ins import refuse_stand_in
from ..user_files import read_bytes

_MOST_DEEP = 500  # elements in each other
_MOST = 1_000_000  # elements of a file
_MOST_ATTRIBUTES = 2_000_000


def plain_xml(text: bytes, name: str, comments: bool = False) -> ET.Element:
    """Return the root of an XML text without a document type, and thus without entities of its own.

    Prefixes of names stay as they are written: simulators read files that declare none. Comments
    are kept with ``comments``.

    Raises:
        UserError: if the text is not XML, has a document type, or has too many elements.
    """
    if text.count(b"=") > _MOST_ATTRIBUTES:
        allowed = f"at most {_MOST_ATTRIBUTES} attributes"
        raise UserError(f"{name}: found more, allowed: {allowed}")
    parser, builder = expat.ParserCreate(), ET.TreeBuilder(insert_comments=comments)
    parser.buffer_text = True
    depth, count = 0, 0

    def refuse(*_: object) -> None:
        raise UserError(
            f"{name}: line {parser.CurrentLineNumber}: found a document type, allowed: XML"
            " without one"
        )

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth, count
        depth, count = depth + 1, count + 1
        if depth > _MOST_DEEP or count > _MOST:
            most = f"{_MOST_DEEP} levels" if depth > _MOST_DEEP else f"{_MOST} elements"
            line = parser.CurrentLineNumber
            raise UserError(f"{name}: line {line}: found more, allowed: at most {most}")
        builder.start(tag, attributes)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    parser.StartDoctypeDeclHandler = refuse
    parser.EntityDeclHandler = refuse
    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = builder.data
    parser.CommentHandler = builder.comment
    try:
        parser.Parse(text, True)
        return builder.close()
    except (expat.ExpatError, ET.ParseError, ValueError, LookupError) as error:
        raise UserError(f"{name}: not XML: {error}") from error


def some(names: Sequence[str], most: int = 8) -> str:
    """Return the first of ``names``, and how many more there are."""
    return ", ".join(names[:most]) + f" and {len(names) - most} more" * (len(names) > most)


def bounded_bytes(path: Path, most: int, name: str = "") -> bytes:
    """Return the content of a regular file of at most ``most`` bytes; ``name`` is the file's for
    messages.

    Raises:
        UserError: if it cannot be read, is larger, or is no such file at all.
    """
    name = name or str(path)
    try:
        regular = path.is_file() or not path.exists()
    except (OSError, ValueError):
        regular = True  # reading it says why it cannot be
    if not regular:
        raise UserError(f"{name}: not a regular file; give a file")
    data = read_bytes(path, "", most, name)
    refuse_stand_in(data, name)
    return data
