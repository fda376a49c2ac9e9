"""Grammars of the lines of text that known firmwares print.

A line belongs to a grammar as a whole or not at all: nothing is searched for in a line, so that no
other number of it becomes a distance. A number without a unit is a whole number of millimetres.
"""

import re
from collections.abc import Callable, Mapping
from typing import NamedTuple

from ...formats.ring_status import MOST_MM, Status

NO_TARGET_MM = (0, 8190, 8191, 9999, MOST_MM)  # codes of firmwares for no target
_I = re.IGNORECASE
_UNITS = {"mm": 1, "cm": 10, "m": 1000}
_NUMBER = re.compile(
    r"(?P<sign>-?)(?P<whole>\d{1,20})(?:\.(?P<part>\d{1,6}))?\s?(?P<unit>mm|cm|m)?(?P<rest>\s.*)?",
    _I,
)
_FAILURE = re.compile(
    r"bad|bounds|data|dead|e|err|error|fail|failed|failure|fault|inf|infinity|invalid|lost|missing"
    r"|na|nan|nil|no|none?|null|off?|oor|out|ovf|over|overflow|range|reading|saturated|sensor"
    r"|signal|target|timed?|timeout|undefined|underflow|weak|x"
)
_PHRASES = re.compile(
    r"\b(?:out of range|out of bounds|no (?:data|reading|signal|target)|timed? out)\b", _I
)
_NUMBERED = re.compile(r"\d{1,10}:[ \t]+")
_MEASURING = re.compile(r"reading a measurement\.{3}\s*", _I)
_LABEL = re.compile(
    r"(?P<label>(?:(?:tof|sensor|ring|lidar|measured|vl53l\d\w{1,2})[ _-]?\d{0,3}[ _-]?)?"
    r"(?:ranges?|distances?|dist|d|mm|depth|tof|readings?)[ _-]?\d{0,3})\s?"
    r"(?:[(\[](?P<unit>mm|cm|m)[)\]]\s?)?:\s*",
    _I,
)
_INDEX = re.compile(r"\b(?:sensor|tof|distance|dist|s|d)[ _]?(?=\d{1,3}\s?:)", _I)
_ITEM = re.compile(r"(?P<index>0|[1-9]\d{0,2})\s?:\s?(?P<value>.*)")
_POLOLU = re.compile(
    r"range: (?P<mm>\d{1,5})\s+status: (?P<status>[a-z ,]+?)\s+peak signal: \d+(?:\.\d+)?"
    r"\s+ambient: \d+(?:\.\d+)?",
    _I,
)
_SPARKFUN = re.compile(
    r"distance ?\(mm\): (?P<mm>\d{1,5})\s+distance ?\(ft\): \d+\.\d+"
    r"(?:\s+(?:range )?status: (?P<status>[a-z ,]+?))?(?:\s+[a-z ]*(?:hz|rate): \d+(?:\.\d+)?)*",
    _I,
)
_SURE = ("range valid", "valid", "good")  # statuses of a distance, in words
_NOTHING = ("signal fail", "out of bounds fail")
_ODD = re.compile(r"[A-Za-z]{1,12}")
_FEWEST = 4  # sensors; a line of fewer is not recognised beside a word of no known meaning


class Reading(NamedTuple):
    """Reading of a sensor in a line."""

    mm: float
    """Distance, mm; 0 if there is none."""
    status: Status
    """Its status."""


class LineReadings(NamedTuple):
    """Readings of all sensors in a line."""

    head: str
    """What comes before them: a label, "#" for the number of the frame, or nothing."""
    sensors: list[Reading]
    """In the order of the line, or by the index that it states."""


_FAILED, _NONE = Reading(0.0, Status.FAILED), Reading(0.0, Status.NO_TARGET)


def reading(word: str, unit: str = "") -> Reading | None:
    """Return the reading of a word: a distance, or a failure (a negative number, one beyond
    65,535 mm, nothing, or words that mean one); None for anything else.

    Args:
        word: of a line, without separators.
        unit: mm, cm or m, if the line states it elsewhere.
    """
    match = _NUMBER.fullmatch(word)
    if match is None:
        return _FAILED if _means_failure(word) else None
    if match["rest"]:  # such as "65535 TIMEOUT"
        return _FAILED if match["rest"].strip() and _means_failure(match["rest"]) else None
    units = {u.lower() for u in (unit, match["unit"]) if u}
    if len(units) > 1 or not (units or match["part"] is None):
        return None
    number = float(f"{match['whole']}.{match['part'] or 0}")
    mm = round(number * _UNITS[units.pop() if units else "mm"], 3)
    if match["sign"] or mm > MOST_MM:
        return _FAILED
    return _NONE if mm in NO_TARGET_MM else Reading(mm, Status.VALID)


def _means_failure(word: str) -> bool:
    """Whether a word means a failure: marks such as ``-`` or ``?``, or words that mean one."""
    word = re.sub(r"(?<=\w)\s(?:mm|cm|m)$", "", word.lower().replace("n/a", "na"))
    words, rest = re.findall(r"[a-z]+", word), re.sub(r"[a-z]", "", word)
    if not words:
        return bool(re.fullmatch(r"[-?*#!/ ]*", word))
    return all(map(_FAILURE.fullmatch, words)) and bool(re.fullmatch(r"[-+_!?/ ]*\d{0,3}", rest))


def read_list(line: str, count: int) -> LineReadings | None:
    """Read ``count`` distances separated by commas, semicolons, tabs or blanks, after nothing, a
    label that means a distance, or a number of the frame that a blank follows.
    """
    before = _MEASURING.match(line)
    text = line[before.end() :] if before else line
    label = _LABEL.match(text)
    number = None if label or before else _NUMBERED.match(text)
    text = text[match.end() :] if (match := label or number) else text
    unit = (label["unit"] or "") if label else ""
    fields = _fields(text, count)
    each = [reading(field, unit) for field in fields]
    odd = [i for i, one in enumerate(each) if one is None]
    # a log's lines begin with a word, or are words between blanks
    log = bool(odd) and (odd[0] == 0 or re.search(r"[,;\t]", text) is None)
    if len(fields) != count or log or _some_units(fields, unit) or not _one_odd_word(fields, odd):
        return None
    name = re.sub(r"[\d _-]+", "", label["label"]).lower() if label else "#" * bool(number)
    return LineReadings("measurement" if before else name, [one or _FAILED for one in each])


def _some_units(fields: list[str], unit: str) -> bool:
    """Whether some numbers are in cm or m and others without a unit: ``1,24 m`` is one distance."""
    numbers = [match for field in fields if (match := _NUMBER.fullmatch(field))]
    stated = {(match["unit"] or unit or "").lower() for match in numbers}
    return "" in stated and bool(stated & {"cm", "m"})


def _one_odd_word(fields: list[str], odd: list[int]) -> bool:
    """Whether the fields ``odd``, of no known meaning, are none, or one word among the numbers of
    at least three other sensors.
    """
    numbers = sum(field[:1].isdigit() for field in fields)
    alone = len(odd) == 1 and numbers == len(fields) - 1 and len(fields) >= _FEWEST
    return not odd or (alone and _ODD.fullmatch(fields[odd[0]]) is not None)


def _fields(text: str, count: int) -> list[str]:
    """Return the fields of a list; a separator after the last one is no further field."""
    if re.search(r"[,;]", text):  # commas beside semicolons are decimal
        fields = re.split(";" if re.search(r";(?!\s*$)", text) else "[,;]", text)
    elif "\t" in text:
        fields = text.split("\t")
    else:
        fields = [text]
    fields = [field.strip() for field in fields]
    if len(fields) == count + 1 and not fields[-1]:
        fields.pop()
    if len(fields) != count and not re.search(r"[,;]", text):
        joined = re.sub(r"(\d)[ \t](mm|cm|m)\b", r"\1\2", _PHRASES.sub("nan", text), flags=_I)
        fields = joined.split()
    return fields


def read_indexed(line: str, count: int) -> LineReadings | None:
    """Read ``0:900,1:910``: every sensor of at least two, with its index from 0 or from 1."""
    items = re.split(r"(?:\s*[,;]\s*|\s+)(?=\d{1,3}\s?:)", _INDEX.sub("", line).strip(" ,;\t"))
    found: dict[int, str] = {}
    for item in items:
        if (match := _ITEM.fullmatch(item)) is None:
            return None
        found[int(match["index"])] = match["value"].strip()
    each = sorted(found)
    if count < 2 or len(items) != count or each not in ([*range(count)], [*range(1, count + 1)]):
        return None
    words = [found[i] for i in each]
    sensors = [reading(word) for word in words]
    odd = [i for i, one in enumerate(sensors) if one is None]
    return (
        LineReadings("", [one or _FAILED for one in sensors]) if _one_odd_word(words, odd) else None
    )


def read_pololu(line: str, count: int) -> LineReadings | None:
    """Read a line of Pololu's VL53L1X example with details: range, status in words, peak signal
    and ambient light.
    """
    return _with_status(_POLOLU.fullmatch(line), count)


def read_sparkfun(line: str, count: int) -> LineReadings | None:
    """Read a line of SparkFun's VL53L1X examples: the distance in mm and in feet, and in some of
    them the status in words and rates.
    """
    return _with_status(_SPARKFUN.fullmatch(line), count)


def _with_status(match: re.Match[str] | None, count: int) -> LineReadings | None:
    if match is None or count != 1:
        return None
    words, one = (match["status"] or "valid").lower(), reading(match["mm"])
    if words not in _SURE:
        one = _NONE if words in _NOTHING else _FAILED
    return None if one is None else LineReadings("", [one])


GRAMMARS: Mapping[str, Callable[[str, int], LineReadings | None]] = {
    "list": read_list,
    "indexed": read_indexed,
    "pololu": read_pololu,
    "sparkfun": read_sparkfun,
}
"""The grammars by name; no line belongs to two of them."""
