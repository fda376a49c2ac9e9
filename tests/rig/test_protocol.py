"""The ring protocol and the decoders: no intact frame, of zones or not, and no hello is lost, no
other is taken, whatever comes.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.formats.ring_frame import frame_length
from place_rings.rig.rings.firmware_decoders import DECODERS, decoder
from place_rings.rig.rings.identity import HelloReader, serial_text
from place_rings.rig.rings.protocol import (
    MAGIC,
    Counts,
    Decoder,
    SequenceTracker,
    Status,
    encode,
    encode_zones,
    hello,
)
from place_rings.rig.rings.zones import Zones
from place_rings.rig.simulated.ports import ENCODERS

from ..support.refusals import refused

COUNT = 7
sensors = st.lists(
    st.tuples(st.integers(0, 65535), st.sampled_from(Status)), min_size=COUNT, max_size=COUNT
)
noise = st.binary(max_size=40) | st.sampled_from(
    [MAGIC, MAGIC[:1], MAGIC * 3, MAGIC + b"\1\x07\xf8", MAGIC + b"\1\x07\xf8\0\0"]
)


def frame(sequence=0, clock=1.5, values=((1000, Status.VALID),) * COUNT):
    """A frame's bytes."""
    mm, status = np.array(values, int).T
    return encode(sequence, clock, mm / 1000, status)


def pieces(data, cuts):
    """Data cut into pieces, each with its end."""
    edges = [0, *sorted(min(cut, len(data)) for cut in cuts), len(data)]
    return [(data[a:b], float(b)) for a, b in pairwise(edges)]


def fed(found, data, cuts=()):
    """Frames of bytes that come in pieces."""
    return [f for piece, end in pieces(data, cuts) for f in found.feed(piece, end)]


@given(sensors, st.integers(0, 65535), st.integers(0, 2**63))
def test_a_frame_comes_back_as_it_was_sent(values, sequence, micros):
    found = fed(Decoder(COUNT), frame(sequence, micros / 1e6, values))
    assert [f.sequence for f in found] == [sequence]
    assert found[0].clock == pytest.approx(micros / 1e6, rel=1e-12)
    assert found[0].status.tolist() == [s for _, s in values]
    for (mm, status), distance in zip(values, found[0].distance, strict=True):
        assert (
            np.isnan(distance)
            if status in (Status.NO_TARGET, Status.FAILED)
            else distance == mm / 1000
        )


@given(st.lists(noise, min_size=1, max_size=8), st.lists(st.integers(0, 600), max_size=12))
def test_no_intact_frame_is_lost_whatever_stands_between_and_however_it_is_cut(between, cuts):
    data = b"".join(garbage + frame(i) for i, garbage in enumerate(between)) + bytes(
        frame_length(COUNT)
    )
    found = Decoder(COUNT)
    assert [f.sequence for f in fed(found, data, cuts)] == list(range(len(between)))
    assert (found.counts.frames, found.counts.lost) == (len(between), 0)


@given(st.integers(0, 8 * frame_length(COUNT) - 1), st.integers(0, 8 * frame_length(COUNT) - 1))
def test_a_frame_with_changed_bits_is_never_taken(one, other):
    data = bytearray(frame())
    for bit in {one, other}:
        data[bit // 8] ^= 1 << bit % 8
    assert [f.sequence for f in fed(Decoder(COUNT), bytes(data) + frame(1))] == [1]


@given(st.integers(0, 8 * frame_length(COUNT) - 32), st.integers(1, 2**32 - 1))
def test_a_burst_of_changed_bits_is_never_taken(start, pattern):
    data = (int.from_bytes(frame(), "little") ^ (pattern << start)).to_bytes(
        frame_length(COUNT), "little"
    )
    assert not fed(Decoder(COUNT), data)


@given(st.integers(0, frame_length(COUNT) - 1), st.integers(1, 60))
def test_frames_that_are_cut_or_of_another_ring_are_passed_over(cut, other):
    data = (
        frame(0)[:cut] + encode(1, 2.0, np.ones(other), np.zeros(other, int)) + frame(2) + frame(3)
    )
    sequences = [f.sequence for f in fed(Decoder(COUNT), data + bytes(frame_length(COUNT)))]
    assert sequences == ([1, 2, 3] if other == COUNT else [2, 3])


@given(st.lists(st.integers(0, 400), unique=True, min_size=1, max_size=60))
def test_gaps_are_counted_as_lost(sequences):
    sequences.sort()
    found = Decoder(COUNT)
    fed(found, b"".join(frame(65400 + i, i) for i in sequences))  # over the turn of the number
    assert found.counts.frames == len(sequences)
    assert found.counts.lost == sequences[-1] - sequences[0] + 1 - len(sequences)


def test_a_frame_out_of_order_is_not_handed_on_and_a_ring_may_restart():
    found = Decoder(COUNT)
    order = [(100, 10.0), (102, 10.2), (101, 10.1), (102, 10.2), (103, 10.3), (0, 0.0), (1, 0.1)]
    assert [f.sequence for f in fed(found, b"".join(frame(*at) for at in order))] == [
        100,
        102,
        103,
        0,
        1,
    ]
    assert found.counts == Counts(frames=5, lost=0, late=2, restarts=1)


def test_a_frame_has_the_time_of_its_last_byte():
    found, data, cut = Decoder(COUNT), frame(0) + frame(1), frame_length(COUNT)
    parts = data[: cut - 1], data[cut - 1 : cut + 3], data[cut + 3 :]
    assert [f.time for t, part in enumerate(parts) for f in found.feed(part, t)] == [1, 2]


@given(st.integers(0, 2**16), st.integers(1, 2**14))
def test_order_takes_what_is_ahead(start, ahead):
    order = SequenceTracker(Counts())
    assert order.take(start % 65536, 0.0)
    assert order.take((start + ahead) % 65536, 1.0)
    assert not order.take(start % 65536, 0.5) or ahead > 8


@pytest.mark.parametrize(
    ("distance", "status"),
    [
        ([], []),
        ([-0.1], [0]),
        ([66.0], [0]),
        ([float("nan")], [0]),
        ([1.0], [4]),
        ([1.0] * 65, [0] * 65),
    ],
)
def test_what_fits_no_frame_is_refused(distance, status):
    with refused(error=ValueError):
        encode(0, 0.0, np.array(distance), np.array(status, int))


@pytest.mark.parametrize("name", ENCODERS)
@given(
    values=st.lists(
        st.lists(st.integers(1, 8000) | st.none(), min_size=COUNT, max_size=COUNT),
        min_size=4,
        max_size=7,
    ),
    start=st.integers(0, 20),
    cuts=st.lists(st.integers(0, 300), max_size=8),
)
def test_every_firmware_is_read_from_any_start(name, values, start, cuts):
    distance = np.array([[np.nan if mm is None else mm / 1000 for mm in row] for row in values])
    status = np.where(np.isnan(distance), Status.NO_TARGET, Status.VALID)
    data = b"".join(
        ENCODERS[name](i, 0.1 * i, *row) for i, row in enumerate(zip(distance, status, strict=True))
    )
    data += ENCODERS[name](len(values), 1.0, distance[0], status[0])[:2]  # the next one begins
    found = fed(decoder(name, COUNT), data[start:], cuts)
    assert len(found) >= len(values) - 1 - (name == "text")
    for got, row, s in zip(found[::-1], distance[::-1], status[::-1], strict=False):
        np.testing.assert_allclose(got.distance, row, atol=5e-4)
        assert got.status.tolist() == s.tolist()


def test_unknown_decoders_are_named():
    with refused("place-rings, esp32, text", error=ValueError):
        decoder("esp33", 3)


def spoiled(rng, size, encode_frame):
    """Bytes of frames, changed, cut, doubled and mixed with noise."""
    data, i = bytearray(), 0
    while len(data) < size:
        part = bytearray(encode_frame(i))
        match rng.integers(6):
            case 0:
                part[rng.integers(len(part))] ^= rng.integers(1, 256)
            case 1:
                part = part[: rng.integers(len(part))]
            case 2:
                part += rng.bytes(rng.integers(80))
            case 3:
                part = bytearray(rng.bytes(rng.integers(200)))
        data += part
        i += 1
    return bytes(data[:size])


@pytest.mark.parametrize("name", ENCODERS)
def test_fuzzed_bytes_raise_nothing_and_make_no_frame_that_was_not_sent(name):
    size = 50_000
    rng = np.random.default_rng(size)
    sent = np.round(rng.uniform(0.1, 3, (512, COUNT)), 3)
    data = spoiled(
        rng, size, lambda i: ENCODERS[name](i, 0.1 * i, sent[i % 512], np.zeros(COUNT, int))
    )
    found, frames, at = decoder(name, COUNT), [], 0
    while at < len(data):
        step = int(rng.integers(1, 400))
        frames += found.feed(data[at : at + step], 0.0)
        at += step
    assert len(frames) > size / 400
    if name == "place-rings":  # the others have no check
        assert all(np.array_equal(f.distance, sent[f.sequence % 512]) for f in frames)
        assert found.counts.frames == len(frames)


@settings(max_examples=20)
@given(st.sampled_from(list(DECODERS)), st.lists(st.binary(max_size=200), max_size=10))
def test_any_bytes_at_all_raise_nothing(name, data):
    found, reader = decoder(name, 3), HelloReader(COUNT, Counts())
    for piece in data:
        reader.feed(piece)
        for got in found.feed(piece, 0.0):
            assert got.distance.shape == (3,)


serials = st.integers(1, 2**64 - 1)


@given(
    st.lists(st.tuples(serials, st.binary(max_size=40)), min_size=1, max_size=6),
    st.lists(st.integers(0, 900), max_size=12),
)
def test_hellos_come_back_between_frames_and_noise_however_they_are_cut(said, cuts):
    data = b"".join(frame(i) + hello(COUNT, s) + noise for i, (s, noise) in enumerate(said))
    counts = Counts()
    reader, heard = HelloReader(COUNT, counts), []
    for piece, _ in pieces(data + bytes(300), cuts):
        heard += reader.feed(piece)
    assert heard == [serial_text(s) for s, _ in said]
    assert counts.serials.total() == len(said)
    assert not counts.sizes


@given(st.lists(serials, min_size=1, max_size=6), st.lists(st.integers(0, 400), max_size=9))
def test_a_hello_costs_a_receiver_no_frame_and_is_no_corrupt_one(said, cuts):
    """As one that knows no hellos."""
    found = Decoder(COUNT)
    data = b"".join(hello(COUNT, s) + frame(i) for i, s in enumerate(said))
    assert [f.sequence for f in fed(found, data, cuts)] == list(range(len(said)))
    assert (found.counts.corrupt, found.counts.lost) == (0, 0)


@given(serials, st.integers(0, 8 * 16 - 1), st.integers(0, 8 * 16 - 1))
def test_a_hello_with_changed_bits_is_never_taken(serial, one, other):
    data = bytearray(hello(COUNT, serial))
    for bit in {one, other}:
        data[bit // 8] ^= 1 << bit % 8
    assert HelloReader(COUNT, Counts()).feed(bytes(data) + bytes(300)) == []


def test_a_board_without_a_number_says_none_and_other_sizes_are_counted():
    counts = Counts()
    reader, other = HelloReader(COUNT, counts), encode(1, 2.0, np.ones(9), np.zeros(9, int))
    assert reader.feed(hello(COUNT, 0) + frame(0) + 2 * other + bytes(9)) == []
    assert (counts.serials, counts.sizes) == ({}, {9: 2})


def drawn_zones(seed, shape, measured=False):
    rng = np.random.default_rng(seed)
    status = rng.integers(0, 4, shape)
    distance = np.where(status % 2 == 0, rng.integers(0, 65536, shape) / 1000, 0.0)
    zones = Zones.of(distance, status)
    if not measured:
        return zones
    sigma, signal = rng.integers(0, 400, shape), rng.integers(0, 65536, shape)
    return replace(zones, sigma_mm=sigma, signal=signal)


some = st.integers(0, 2**31)
sides = st.integers(1, 8)


@settings(max_examples=20)
@given(
    some,
    st.tuples(st.integers(1, 3), sides, sides, st.integers(1, 4)),
    st.booleans(),
    st.binary(max_size=30),
    st.lists(st.integers(0, 4000), max_size=4),
)
def test_frames_of_zones_survive_noise_and_pieces(seed, shape, measured, noise, cuts):
    zones = drawn_zones(seed, shape, measured)
    data = noise + encode_zones(7, 1.5, zones) + encode_zones(8, 1.6, zones)
    frames = fed(Decoder(shape[0]), data, cuts)
    assert [frame.sequence for frame in frames] == [7, 8]
    for got in frames:
        read = got.zones
        assert read.grid == (*shape[1:], measured)
        np.testing.assert_array_equal(read.status, zones.status)
        np.testing.assert_array_equal(read.mm, zones.mm)
        if measured:
            np.testing.assert_array_equal(read.sigma_mm, np.minimum(zones.sigma_mm, 255))
            np.testing.assert_array_equal(read.signal, zones.signal)
        assert len(got.distance) == len(got.status) == shape[0]


@settings(max_examples=20)
@given(some, st.integers(0, 10_000), st.integers(1, 255))
def test_one_wrong_byte_costs_one_frame_of_zones(seed, place, flip):
    zones = drawn_zones(seed, (2, 2, 3, 2))
    wrong = bytearray(encode_zones(0, 1.0, zones))
    wrong[place % len(wrong)] ^= flip
    data = bytes(wrong) + b"".join(encode_zones(i, 1 + i, zones) for i in (1, 2))
    assert [f.sequence for f in fed(Decoder(2), data)] == [1, 2]


@settings(max_examples=15)
@given(some)
def test_a_sensor_reads_the_nearest_of_its_zones(seed):
    zones = drawn_zones(seed, (5, 3, 3, 2))
    distance, status = zones.nearest()
    for k in range(5):
        each = zip(zones.mm[k].ravel(), zones.status[k].ravel(), strict=True)
        read = [(mm / 1000, s) for mm, s in each if s in (Status.VALID, Status.WEAK)]
        if read:
            assert distance[k] == pytest.approx(min(read)[0], abs=1e-5)
            assert status[k] in {s for d, s in read if abs(d - distance[k]) < 1e-5}
        else:
            assert np.isnan(distance[k])
            failed = (zones.status[k, ..., 0] == Status.FAILED).mean() > 0.25
            assert status[k] == (Status.FAILED if failed else Status.NO_TARGET)
