"""Text of TOML files, read in bounded time and memory.

The standard library's parser takes time in proportion to the square of the parts of a dotted key:
one of 200,000 parts took 82 s and 3.9 GB.
"""

import re
import tomllib
from typing import Any

MOST_PARTS = 32  # of a dotted key
MOST_TABLES = 50_000  # parts of the headers and dotted keys at the starts of lines
_HEAD = re.compile(r"^[ \t]*+(?:\[[^,\n=\]]++\]|[^=\n#\[,.]*+\.[^=\n#,]*+=)", re.MULTILINE)
_TOKEN = re.compile(
    r"""
    (?P<skip> \"{3} (?: [^"\\]++ | \\. | "(?!"") )*+ (?:\"{3})?+   # strings over several lines
      | '{3} (?: [^']++ | '(?!'') )*+ (?:'{3})?+
      | \# [^\n]*+ | [^\w"'.\#\ \t-]++ )
    | (?P<part> " (?: [^"\\\n]++ | \\. )*+ "?+ | ' [^'\n]*+ '?+ | [\w-]++ )
    | (?P<dot> \. )
    | [\ \t]++
    """,
    re.VERBOSE | re.DOTALL,
)


def toml_keys(text: str) -> dict[str, Any]:
    """Return the keys of a TOML file.

    Raises:
        ValueError: if it is not TOML, or nested too deeply.
    """
    longest = max((line.count(".") for line in text.split("\n")), default=0)
    if longest >= MOST_PARTS and (line := _deep_line(text)):
        raise ValueError(
            f"line {line}: found a key of more than {MOST_PARTS} parts, allowed: at most"
            f" {MOST_PARTS}"
        )
    if text.count("\n") >= MOST_TABLES // MOST_PARTS:
        parts = sum(head[0].count(".") + 1 for head in _HEAD.finditer(text))
        if parts > MOST_TABLES:
            raise ValueError(f"found {parts} parts of tables, allowed: at most {MOST_TABLES}")
    try:
        return tomllib.loads(text)
    except RecursionError as error:
        raise ValueError("nested too deeply") from error


def _deep_line(text: str) -> int:
    """Return the line of the first dotted key with too many parts; 0 if there is none."""
    parts, dotted = 0, False
    for token in _TOKEN.finditer(text):
        match token.lastgroup:
            case "part":
                parts = parts + 1 if dotted else 1
                if parts > MOST_PARTS:
                    return text.count("\n", 0, token.start()) + 1
                dotted = False
            case "dot":
                dotted = parts > 0
            case "skip":
                parts, dotted = 0, False
    return 0
