"""Frames of sensors with zones: none is lost, none is wrong, and the nearest zone counts."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.rig.rings.protocol import Decoder, Status, encode_zones
from place_rings.rig.rings.zones import Zones


@given(
    st.integers(1, 3),
    st.integers(1, 8),
    st.integers(1, 8),
    st.integers(1, 4),
    st.booleans(),
    st.binary(max_size=30),
    st.lists(st.integers(0, 4000), max_size=4),
    st.integers(0, 2**31),
)
@settings(max_examples=60)
def test_frames_of_zones_survive_noise_and_pieces(
    count, rows, columns, targets, measured, noise, cuts, seed
):
    zones = drawn_zones(seed, (count, rows, columns, targets), measured)
    data = noise + encode_zones(7, 1.5, zones) + encode_zones(8, 1.6, zones)
    decoder, frames = Decoder(count), []
    edges = [0, *sorted(min(cut, len(data)) for cut in cuts), len(data)]
    for i in range(len(edges) - 1):
        frames += decoder.feed(data[edges[i] : edges[i + 1]], float(i))
    assert [frame.sequence for frame in frames] == [7, 8]
    for frame in frames:
        read = frame.zones
        assert read.grid == (rows, columns, targets, measured)
        np.testing.assert_array_equal(read.status, zones.status)
        np.testing.assert_array_equal(read.mm, zones.mm)
        if measured:
            np.testing.assert_array_equal(read.sigma_mm, np.minimum(zones.sigma_mm, 255))
            np.testing.assert_array_equal(read.signal, zones.signal)
        assert len(frame.distance) == len(frame.status) == count


def drawn_zones(seed, shape, measured=False):
    rng = np.random.default_rng(seed)
    status = rng.integers(0, 4, shape)
    distance = np.where(status % 2 == 0, rng.integers(0, 65536, shape) / 1000, 0.0)
    zones = Zones.of(distance, status)
    if not measured:
        return zones
    sigma, signal = rng.integers(0, 400, shape), rng.integers(0, 65536, shape)
    return replace(zones, sigma_mm=sigma, signal=signal)


@given(st.integers(0, 2**31), st.integers(0, 10_000), st.integers(1, 255))
@settings(max_examples=60)
def test_one_wrong_byte_costs_one_frame_of_zones(seed, place, flip):
    zones = drawn_zones(seed, (2, 2, 3, 2))
    wrong = bytearray(encode_zones(0, 1.0, zones))
    wrong[place % len(wrong)] ^= flip
    decoder = Decoder(2)
    data = bytes(wrong) + b"".join(encode_zones(i, 1 + i, zones) for i in (1, 2))
    assert [frame.sequence for frame in decoder.feed(data, 0.0)] == [1, 2]


@given(st.integers(0, 2**31))
@settings(max_examples=30)
def test_a_sensor_reads_the_nearest_of_its_zones(seed):
    zones = drawn_zones(seed, (5, 3, 3, 2))
    distance, status = zones.nearest()
    for k in range(5):
        read = [
            (mm / 1000, s)
            for mm, s in zip(zones.mm[k].ravel(), zones.status[k].ravel(), strict=True)
            if s in (Status.VALID, Status.WEAK)
        ]
        if read:
            assert distance[k] == pytest.approx(min(read)[0], abs=1e-5)
            assert status[k] in {s for d, s in read if abs(d - distance[k]) < 1e-5}
        else:
            assert np.isnan(distance[k])
            failed = (zones.status[k, ..., 0] == Status.FAILED).all()
            assert status[k] == (Status.FAILED if failed else Status.NO_TARGET)
