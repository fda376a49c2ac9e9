"""Identities of rings: hellos through any bytes, from the firmware, and ports that are swapped."""

import shutil
import subprocess
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.rig.rings.identity import HelloReader, serial_text
from place_rings.rig.rings.protocol import Counts, Decoder, encode, hello

COUNT = 5
COMPILER = next((path for name in ("c++", "g++", "clang++") if (path := shutil.which(name))), None)
FIRMWARE = next(Path(__file__).parents[2].glob("*/firmware/place_rings_ring"))
serials = st.integers(1, 2**64 - 1)


def frame(n, count=COUNT):
    return encode(n, n / 20, np.full(count, 0.5), np.zeros(count, int))


def pieces(data, cuts):
    edges = [0, *sorted(min(cut, len(data)) for cut in cuts), len(data)]
    return [data[a:b] for a, b in pairwise(edges)]


@given(
    st.lists(st.tuples(serials, st.binary(max_size=40)), min_size=1, max_size=6),
    st.lists(st.integers(0, 900), max_size=12),
)
def test_hellos_come_back_between_frames_and_noise_however_they_are_cut(said, cuts):
    data = b"".join(frame(i) + hello(COUNT, s) + noise for i, (s, noise) in enumerate(said))
    counts = Counts()
    reader, heard = HelloReader(COUNT, counts), []
    for piece in pieces(data + bytes(300), cuts):
        heard += reader.feed(piece)
    assert heard == [serial_text(s) for s, _ in said]
    assert counts.serials.total() == len(said)
    assert not counts.sizes


@given(st.lists(serials, min_size=1, max_size=6), st.lists(st.integers(0, 400), max_size=9))
def test_a_hello_costs_a_receiver_no_frame_and_is_no_corrupt_one(said, cuts):
    """As one that knows no hellos."""
    decoder = Decoder(COUNT)
    data = b"".join(hello(COUNT, s) + frame(i) for i, s in enumerate(said))
    found = [f for piece in pieces(data, cuts) for f in decoder.feed(piece, 0.0)]
    assert [f.sequence for f in found] == list(range(len(said)))
    assert (decoder.counts.corrupt, decoder.counts.lost) == (0, 0)


@given(serials, st.integers(0, 8 * 16 - 1), st.integers(0, 8 * 16 - 1))
def test_a_hello_with_changed_bits_is_never_taken(serial, one, other):
    data = bytearray(hello(COUNT, serial))
    for bit in {one, other}:
        data[bit // 8] ^= 1 << bit % 8
    assert HelloReader(COUNT, Counts()).feed(bytes(data) + bytes(300)) == []


@given(st.lists(st.binary(max_size=200), max_size=10))
def test_any_bytes_at_all_raise_nothing(data):
    reader = HelloReader(COUNT, Counts())
    for piece in data:
        reader.feed(piece)


def test_a_board_without_a_number_says_none_and_other_sizes_are_counted():
    counts = Counts()
    reader = HelloReader(COUNT, counts)
    assert reader.feed(hello(COUNT, 0) + frame(0) + frame(1, 9) + frame(2, 9) + bytes(9)) == []
    assert (counts.serials, counts.sizes) == ({}, {9: 2})


PROGRAM = """
#include <cstdint>
#include <cstdio>
#include <cstring>
#include "ring_frame.h"
#define PICO_UNIQUE_BOARD_ID_SIZE_BYTES 8
struct pico_unique_board_id_t { uint8_t id[8]; };
inline void pico_get_unique_board_id(pico_unique_board_id_t* id) {
  const uint8_t known[8] = {0xE6, 0x61, 0x4C, 0x31, 0x1B, 0x4A, 0x2C, 0x2D};
  std::memcpy(id->id, known, 8);
}
struct { uint64_t getEfuseMac() { return 0x665544332211ull; } } ESP;
#include "ring_serial.h"
int main() {
  uint8_t hello[ring_frame::HELLO];
  (void)ESP;
  std::fwrite(hello, 1, ring_frame::encode_hello(hello, 16, board_serial()), stdout);
}
"""
BOARDS = {
    "ARDUINO_ARCH_ESP32": "0000112233445566",  # the MAC address as it is printed
    "ARDUINO_ARCH_RP2040": "E6614C311B4A2C2D",
    "ARDUINO_ARCH_AVR": None,
}


@pytest.mark.skipif(COMPILER is None, reason="no C++ compiler")
@pytest.mark.parametrize("board", BOARDS)
def test_the_firmware_says_the_serial_number_of_its_board(tmp_path, board):
    (tmp_path / "main.cpp").write_text(PROGRAM)
    (tmp_path / "pico").mkdir()
    (tmp_path / "pico" / "unique_id.h").touch()
    warnings = ["-std=c++11", "-Wall", "-Wextra", "-Werror", "-pedantic"]
    words = [COMPILER, *warnings, f"-D{board}", "-I", ".", "-I", FIRMWARE, "main.cpp", "-o", "main"]
    subprocess.run(words, cwd=tmp_path, check=True)
    said = subprocess.run([tmp_path / "main"], capture_output=True, check=True).stdout
    wanted = BOARDS[board]
    assert said == hello(16, int(wanted or "0", 16))
    assert HelloReader(16, Counts()).feed(said) == [wanted] * bool(wanted)
