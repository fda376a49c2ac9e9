"""Lines of text of known firmwares: what they say is read, and no other number becomes a distance.

Public sources of the faults: Pololu's and SparkFun's VL53L1X examples print more numbers than the
distance; https://github.com/pyserial/pyserial/issues/156 (a boot log before the data);
https://github.com/pimoroni/vl53l1x-python/issues/26 (-1185 mm).
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.rig.rings.firmware_decoders import DECODERS, decoder
from place_rings.rig.rings.line_grammar import GRAMMARS
from place_rings.rig.rings.line_monitor import Event, Happened, Line, Port
from place_rings.rig.rings.protocol import Frame, Status

from ..support.drawing import seeds

TEXT = [name for name in DECODERS if name.startswith("text")]
FIRST = b"half a line\n"
BOOT = [
    "ets Jul 29 2019 12:21:46",
    "",
    "rst:0x1 (POWERON_RESET),boot:0x13 (SPI_FAST_FLASH_BOOT)",
    "mode:DIO, clock div:1",
    "load:0x3fff0030,len:1184",
    "entry 0x400805b0",
    "[    12][W][Wire.cpp:301] begin(): Bus already started in Master Mode.",
]


def frames(name, count, lines, found=None):
    found = found or decoder(name, count)
    return found, found.feed(FIRST + "".join(f"{line}\r\n" for line in lines).encode(), 0.0)


def listed(mm, rng):
    gap = rng.choice([",", ", ", ";", "\t", " ", "\t "])
    text = gap.join(map(str, mm)) + rng.choice(["", gap.strip(" ")])
    return rng.choice(["", "17: ", "ranges: ", "Distance (mm): ", "tof:"]) + text


def with_units(mm, rng):
    words = [
        rng.choice([f"{one} mm", f"{one}mm", f"{one / 10:.1f} cm", f"{one / 1000:.3f} m"])
        for one in mm
    ]
    return rng.choice([", ", ";", "\t", " "]).join(words)


def indexed(mm, rng):
    first, name = int(rng.integers(2)), rng.choice(["", "sensor ", "S"])
    return rng.choice([",", ", ", " ", "\t"]).join(
        f"{name}{i + first}:{one}" for i, one in enumerate(mm)
    )


def pololu(mm, rng):
    peak, ambient = rng.uniform(0, 60, 2)
    words = f"peak signal: {peak:.2f}\tambient: {ambient:.2f}"
    return f"range: {mm[0]}\tstatus: range valid\t{words}"


def sparkfun(mm, rng):
    feet = f"Distance(mm): {mm[0]}\tDistance(ft): {mm[0] / 304.8:.2f}"
    more = ["", "\tRange Status: Good", "\tRange Status: Good\tHz: 9.87"]
    return feet + rng.choice(more)


SHAPES = {
    listed: ("list", None),
    with_units: ("list", None),
    indexed: ("indexed", None),
    pololu: ("pololu", 1),
    sparkfun: ("sparkfun", 1),
}


@pytest.mark.parametrize("shape", SHAPES)
@settings(max_examples=20)
@given(seeds, st.integers(1, 9))
def test_every_line_of_a_grammar_is_read_by_its_name_and_without(shape, seed, count):
    rng, (name, only) = np.random.default_rng(seed), SHAPES[shape]
    count = only or max(count, 2 if shape is indexed else 1)
    mm = rng.integers(1, 8000, count)
    line = shape(mm, rng)
    for each in (name, ""):
        _, found = frames(f"text-{each}".strip("-"), count, [line] * 4)
        assert len(found) == 4, line
        for frame in found:
            np.testing.assert_allclose(frame.distance, mm / 1000, atol=1e-9, err_msg=line)
            assert (frame.status == Status.VALID).all()


WORDS = ["heap", "temp", "ax", "gyro", "battery", "wifi", "i2c", "loop", "addr", "retries", "lux"]
LEVELS = ["I", "E", "INFO", "WARN", "[info]", "[E][Wire.cpp:301]", "DEBUG:"]


def foreign(rng, count):
    """A line of a board that is none of its readings."""
    word, level, n = rng.choice(WORDS), rng.choice(LEVELS), int(rng.integers(0, 5000))
    x = rng.uniform(-20, 20, int(rng.integers(2, 9)))
    more = count + int(rng.integers(1, 4))
    return [
        f"{level} ({n}) {word}: {n}",
        f"{rng.integers(24):02}:{rng.integers(60):02}:{rng.integers(60):02}",
        f"{rng.integers(24)}:{rng.integers(60):02}",
        f"2026-11-{rng.integers(1, 30):02} {rng.integers(24):02}:{rng.integers(60):02}:07,{n}",
        f"ax:{x[0]:.2f} ay:{x[1]:.2f} az:9.81",
        ",".join(f"{v:.2f}" for v in [*x[:1], *rng.uniform(-9, 9, count - 1)]),
        f'{{"{word}": {n}, "t": [{n}, {n}]}}',
        ",".join(map(str, rng.integers(0, 4000, more))),
        f"{word}={n}",
        f"{word}: {n}",
        f"{word}: " + ", ".join(map(str, rng.integers(1, 4000, count))),
        " ".join(map(str, -rng.integers(1, 2000, count))),
        " ".join(hex(v) for v in rng.integers(0, 1 << 31, count)),
        f"{word} {n} of {n + 1}",
        f"{level} " + " ".join(map(str, rng.integers(1, 4000, count))),
        f"{n} ft",
        f"{x[0]:.2f}",
        f"{word}, " + ", ".join(map(str, rng.integers(1, 4000, count - 1))),
        f"192.168.{rng.integers(256)}.{rng.integers(256)}",
        f"{n}.{rng.integers(1000):03} s",
    ][rng.integers(20)]


@pytest.mark.parametrize("count", [1, 3, 8])
def test_no_number_of_another_line_becomes_a_distance(count):
    rng = np.random.default_rng(count)
    lines = [foreign(rng, count) for _ in range(10_000)]
    for name in TEXT:
        found, some = frames(name, count, lines)
        read = [frame for frame in some if np.isfinite(frame.distance).any()]
        assert read == []
        assert found.counts.corrupt > 9_000
        assert found.counts.foreign
    assert [line for line in lines for g in GRAMMARS.values() if good(g(line, count))] == []


def good(read):
    return read is not None and any(one.status != Status.FAILED for one in read.sensors)


@settings(max_examples=20)
@given(seeds, st.integers(1, 6))
def test_lines_of_others_between_cost_no_reading_and_add_none(seed, count):
    rng = np.random.default_rng(seed)
    sent, lines = [], []
    for _ in range(12):
        lines += [foreign(rng, count) for _ in range(rng.integers(2))]
        sent.append(rng.integers(100, 3000, count))
        lines.append("range: " + ", ".join(map(str, sent[-1])))
    _, found = frames("text", count, lines)
    np.testing.assert_allclose([frame.distance for frame in found], np.array(sent) / 1000)


ODD = [
    "-1185",
    "inf",
    "out of range",
    "err",
    "nan",
    "-",
    "-1",
    "",
    "70000",
    "TIMEOUT",
    "E7",
    "oops",
    "no target",
    "inf m",
]


@settings(max_examples=20)
@given(seeds, st.integers(4, 16), st.sampled_from([",", ", ", "; ", "\t"]))
def test_an_odd_word_fails_its_sensor_alone(seed, count, gap):
    rng = np.random.default_rng(seed)
    mm, k, word = rng.integers(1, 8000, count), int(rng.integers(1, count)), rng.choice(ODD)
    words = [str(one) for one in mm]
    lines = [gap.join(words)] * 3
    words[k] = word
    if gap == "\t" and not word:
        return  # several tabs separate as one does
    found, some = frames("text", count, [*lines, gap.join(words), gap.join(words[1:])])
    (*_, odd) = some
    assert len(some) == 4
    assert odd.status.tolist() == [Status.FAILED if i == k else Status.VALID for i in range(count)]
    np.testing.assert_allclose(np.delete(odd.distance, k), np.delete(mm, k) / 1000)
    assert found.counts.corrupt == 1


@settings(max_examples=20)
@given(seeds, st.integers(4, 16), st.sampled_from([",", " ", "\t", "; "]), st.integers(0, 1))
def test_an_odd_word_fails_the_sensor_of_its_index_alone(seed, count, gap, first):
    rng = np.random.default_rng(seed)
    mm, k, word = rng.integers(1, 8000, count), int(rng.integers(count)), rng.choice(ODD)
    words = [str(one) for one in mm]
    good, words[k] = [*words], word
    lines = [gap.join(f"{i + first}:{one}" for i, one in enumerate(w)) for w in (good, words)]
    _, (*_, odd) = frames("text", count, [*lines[:1] * 3, lines[1]])
    assert odd.status.tolist() == [Status.FAILED if i == k else Status.VALID for i in range(count)]
    np.testing.assert_allclose(np.delete(odd.distance, k), np.delete(mm, k) / 1000)


@given(seeds, st.integers(1, 9), st.sampled_from(["", "mm", " m", " cm"]))
def test_no_part_of_a_number_with_a_decimal_comma_is_a_distance(seed, n, unit):
    """Of n sensors, whose line has 2 n fields if each comma separates, too."""
    rng = np.random.default_rng(seed)
    line = ";".join(f"{rng.integers(9)},{rng.integers(10, 100)}{unit}" for _ in range(n))
    for count in {n, 2 * n} if n > 1 or unit in (" m", " cm") else {n}:
        _, found = frames("text", count, [line] * 4)
        assert found == []


@pytest.mark.parametrize(
    ("words", "status"),
    [
        ("range valid", Status.VALID),
        ("signal fail", Status.NO_TARGET),
        ("out of bounds fail", Status.NO_TARGET),
        ("sigma fail", Status.FAILED),
        ("wrap target fail", Status.FAILED),
        ("range valid, min range clipped", Status.FAILED),
        ("unknown status", Status.FAILED),
    ],
)
def test_only_a_valid_range_is_a_distance(words, status):
    good = "range: 900\tstatus: range valid\tpeak signal: 5.00\tambient: 0.40"
    _, found = frames("text", 1, [good] * 3 + [good.replace("range valid", words)])
    assert found[-1].status.tolist() == [status]
    assert np.isfinite(found[-1].distance[0]) == (status == Status.VALID)


def test_a_grammar_is_used_once_three_lines_are_of_it_and_then_no_other():
    found, some = frames("text", 1, ["d:700", "812", "d:701"])
    assert (some, found.counts.waiting) == ([], 3)
    some = found.feed(b"d:702\n5\nd:703\n", 1.0)
    assert [frame.distance[0] for frame in some] == [0.7, 0.701, 0.702, 0.703]
    assert [frame.time for frame in some] == [0.0, 0.0, 1.0, 1.0]
    assert found.counts.corrupt == 2


def test_lines_tell_of_failures_and_skip_what_is_no_line():
    found = decoder("text", 3)
    data = b"half a\n1,2\n1 2 x y\n\n10;9999;-1\r\n" + b"7" * 5000 + b"\n1 2 3\n4 5 6\n7 8 9\n"
    some = found.feed(data, 0.0)
    assert [f.status.tolist() for f in some] == [[0, 1, 3]] + [[0, 0, 0]] * 3
    assert found.counts.corrupt == 3


def chatter(rng):
    words = ["VL53L1X ring", "firmware v1.2", "wifi lost", "sensor 0 ok", "Ready.", "calibrating"]
    return [str(word) for word in rng.choice(words, int(rng.integers(3, 7)))]


@settings(max_examples=15)
@given(seeds, st.integers(1, 4), st.booleans(), st.integers(1, 4))
def test_each_restart_is_named_once_and_nothing_of_it_is_read(seed, count, boots, times):
    """Only a boot log says that a board restarted; other lines of text do not, however many."""
    rng, line = np.random.default_rng(seed), Line(0, Port("", count, "text"), 0.0)
    body, lines = [], ["ignored"]
    for part in range(times + 1):
        if part:
            lines += BOOT if boots else chatter(rng)
        body += (some := [rng.integers(1, 4000, count) for _ in range(9)])
        lines += ["mm: " + ", ".join(map(str, one)) for one in some]
    got = [
        each for n, text in enumerate(lines) for each in line.take(f"{text}\r\n".encode(), n / 20)
    ]
    read = [each for each in got if isinstance(each, Frame)]
    named = [each.what for each in got if isinstance(each, Event)]
    np.testing.assert_allclose([f.distance for f in read], np.array(body) / 1000)
    assert named.count(Happened.RESTARTED) == boots * times
    assert line.counts.restarts == boots * times
    assert read[-1].era == boots * times
