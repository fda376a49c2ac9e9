"""What is left of xacro in a URDF: definitions that nothing uses are ignored, anything else is
refused."""

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator

from ...coverage.definitions.errors import UserError, shown, unusable

EXPAND = "a file that ends in .xacro is expanded (pip install 'place-rings[xacro]')"
_DEFINITIONS = ("property", "arg", "macro")
_EXPRESSION = re.compile(r"(?<!\$)\$[{(][^{}()]*[)}]?")  # of xacro; $${ stands for itself
_READ = ("link", "joint")  # elements of a URDF that the reader takes


def unused_definitions(root: ET.Element, name: str) -> list[str]:
    """Return the names of the properties, arguments and macros in a URDF, which nothing uses.

    Expressions of properties, ``${...}``, count in the root, links and joints, and beside
    definitions wherever they are. Others, ``$(...)``, count in links and joints of a file that
    declares xacro: elsewhere simulators have addresses such as ``$(find pkg)``.

    Args:
        root: root of the URDF.
        name: the file, for messages.

    Raises:
        UserError: for an expression, or an element that xacro would replace.
    """
    declared = {
        key.removeprefix("xmlns:")
        for key, value in root.attrib.items()
        if key.startswith("xmlns:") and value.rstrip("/").endswith("xacro")
    }
    prefixes = {"xacro", *declared}
    defined, used = list[str](), list[tuple[str, str, str]]()
    for element, place in _elements(root):
        prefix, colon, kind = element.tag.rpartition(":")
        if colon and prefix in prefixes:
            if kind not in _DEFINITIONS:
                raise unusable(f"{name}: {place}", element.tag, f"a URDF; {EXPAND}")
            defined.append(element.get("name", kind))
        else:
            used += [(place, key, found) for key, found in _expressions(element)]
    for place, key, expression in used:
        of_property, read = expression.startswith("${"), place.startswith(("robot", *_READ))
        if (of_property and (read or defined)) or (read and (declared or defined)):
            raise UserError(
                f"{name}: {place}: {key}: found {shown(expression)}, an expression of xacro,"
                f" allowed: its value; {EXPAND}"
            )
    return defined


def _elements(root: ET.Element) -> Iterator[tuple[ET.Element, str]]:
    """Yield the elements of a URDF with their places for messages; of what defines something of
    xacro, the definition only."""
    yield root, root.tag
    for top in root:
        label = top.get("name", "")
        place = f"{top.tag} {shown(label)}" if label else top.tag
        stack = [top]
        while stack:
            element = stack.pop()
            yield element, place if element is top else f"{place}: {element.tag}"
            if element.tag.rpartition(":")[2] not in _DEFINITIONS or ":" not in element.tag:
                stack += reversed(element)


def _expressions(element: ET.Element) -> Iterator[tuple[str, str]]:
    """Yield the expressions in the attributes and texts of an element, each with its key."""
    texts = [(k, v) for k, v in element.attrib.items() if not k.startswith("xmlns")]
    texts += [("text", t) for t in (element.text or "", *(c.tail or "" for c in element))]
    for key, text in texts:
        yield from ((key, found) for found in _EXPRESSION.findall(text))
