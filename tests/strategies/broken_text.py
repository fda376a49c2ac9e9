"""Texts with broken pieces: files of TOML, JSON, CSV, XML or OBJ that are right but for some
numbers, names, texts, tags or lines."""

import re

from hypothesis import strategies as st

_PIECE = re.compile(
    r'-?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?|"[^"\n]*"|</?[A-Za-z][^>]*>|[A-Za-z_][\w.-]*'
)
_NUMBERS = ("nan", "inf", "-inf", "1e308", "-1e308", "1e-308", "1e400", "-0.0", "0", "-1", "1.5")
_NUMBERS += ("2", "7", "1000000", "9223372036854775808", "1" * 400, "0x10", "1_0", "1,5", "٣")
_TEXTS = ('""', '"\\u0000"', '"..\\..\\x"', '"../../etc/passwd"', '"/etc/passwd"', '"file:///etc"')
_TEXTS += ('"' + "a" * 3000 + '"', '"\u202e"', '"\\x1b[31m"', '"<script>"', '"package://../x"')
_TEXTS += ('"base"', '"world"', '"$(find x)"', '"${1/0}"', "[]", "{}", "null", "true", "[" * 400)
_WORDS = ("", "x", "q0", "link", "name", "__class__", "nan", "ring", "robot", "\x00", "=", ",", "]")
_BROKEN = st.sampled_from(_NUMBERS + _TEXTS + _WORDS)


@st.composite
def broken(draw: st.DrawFn, text: str) -> str:
    """Return the text with one to three pieces or lines changed, left out, repeated or moved."""
    for _ in range(draw(st.integers(1, 3))):
        change = draw(st.sampled_from(("piece", "piece", "piece", "like", "line", "end")))
        if change == "end":
            text = text[: draw(st.integers(0, len(text)))]
        elif change == "line":
            text = draw(_with_other_lines(text))
        else:
            text = draw(_with_another_piece(text, change == "like"))
    return text


@st.composite
def _with_another_piece(draw: st.DrawFn, text: str, like: bool) -> str:
    """Return the text with one piece replaced: by another of the same text, or by a bad one."""
    pieces = list(_PIECE.finditer(text))
    if not pieces:
        return text
    piece = pieces[draw(st.integers(0, len(pieces) - 1))]
    other = pieces[draw(st.integers(0, len(pieces) - 1))].group() if like else draw(_BROKEN)
    return text[: piece.start()] + other + text[piece.end() :]


@st.composite
def _with_other_lines(draw: st.DrawFn, text: str) -> str:
    """Return the text with one line left out, repeated or moved."""
    lines = text.splitlines(keepends=True)
    if not lines:
        return text
    at, to = (draw(st.integers(0, len(lines) - 1)) for _ in range(2))
    line = lines[at]
    if draw(st.booleans()):
        del lines[at]
    return "".join([*lines[:to], *[line] * draw(st.integers(0, 2)), *lines[to:]])
