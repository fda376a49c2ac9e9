"""The reference firmware's encoder and its board's number, compiled for this machine, against the
decoder. Whole sketches are compiled in tests/formats.
"""

import subprocess
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from place_rings.formats.ring_frame import frame_length
from place_rings.rig.rings.identity import HelloReader
from place_rings.rig.rings.protocol import Counts, Decoder, Status, encode, encode_zones, hello
from place_rings.rig.rings.zones import Zones

from ..support.simulated_firmware import COMPILER, WARNINGS, compiled

FIRMWARE = Path(__file__).parents[2] / "formats" / "firmware" / "place_rings_ring"
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

static void send(const uint8_t* bytes, size_t size) { std::fwrite(bytes, 1, size, stdout); }

static int frame(unsigned count) {
  unsigned sequence, mm, status;
  unsigned long long micros;
  if (std::scanf("%u %llu", &sequence, &micros) != 2) return 1;
  ring_frame::Reading readings[64];
  for (unsigned i = 0; i < count && std::scanf("%u %u", &mm, &status) == 2; i++)
    readings[i] = {uint16_t(mm), uint8_t(status)};
  uint8_t out[ring_frame::length(64)];
  send(out, ring_frame::encode(out, uint16_t(sequence), micros, readings, uint8_t(count)));
  return 0;
}

static int zones(unsigned count) {
  unsigned rows, columns, targets, measured, mm, status, sigma, signal;
  if (std::scanf("%u %u %u %u", &rows, &columns, &targets, &measured) != 4) return 1;
  static ring_frame::Target all[4 * 64 * 4];
  const ring_frame::Grid grid = {uint8_t(rows), uint8_t(columns), uint8_t(targets), measured > 0};
  for (unsigned i = 0; i < count * rows * columns * targets; i++) {
    if (std::scanf("%u %u %u %u", &mm, &status, &sigma, &signal) != 4) return 1;
    all[i] = {uint16_t(mm), uint8_t(status), uint16_t(sigma), uint16_t(signal)};
  }
  static uint8_t out[ring_frame::length(4, {8, 8, 4, true})];
  const size_t size = ring_frame::encode_zones(out, 7, 1500000, all, uint8_t(count), grid);
  if (size != ring_frame::length(uint8_t(count), grid)) return 2;
  send(out, size);
  return 0;
}

int main() {
  char what[9];
  unsigned count;
  while (std::scanf("%8s %u", what, &count) == 2)
    if (const int wrong = *what == 'f' ? frame(count) : zones(count)) return wrong;
  uint8_t out[ring_frame::HELLO];
  (void)ESP;
  send(out, ring_frame::encode_hello(out, 16, board_serial()));
}
"""
BOARDS = {
    "ARDUINO_ARCH_ESP32": "0000112233445566",  # the MAC address as it is printed
    "ARDUINO_ARCH_RP2040": "E6614C311B4A2C2D",
    "ARDUINO_ARCH_AVR": None,
}


def drawn_frames(rng):
    """Lines that ask for frames, and the frames: bytes, sequence, µs, mm, status."""
    for sequence in (0, 1, 255, 256, 65535):
        count, micros = int(rng.integers(1, 65)), int(rng.integers(0, 2**50))
        mm, status = rng.integers(0, 65536, count), rng.integers(0, 4, count)
        numbers = " ".join(f"{a} {b}" for a, b in zip(mm, status, strict=True))
        frame = encode(sequence, micros / 1e6, mm / 1000, status)
        yield f"frame {count} {sequence} {micros} {numbers}", (frame, sequence, micros, mm, status)


def drawn_zones(rng):
    """Lines that ask for frames of zones, and their bytes."""
    for count, *grid, measured in ((1, 4, 4, 1, 0), (4, 8, 8, 4, 1), (3, 2, 5, 2, 1)):
        shape = (count, *grid)
        status = rng.integers(0, 4, shape)
        distance = rng.integers(0, 65536, shape) / 1000
        zones = Zones.of(distance, status)
        sigma, signal = rng.integers(0, 400, shape), rng.integers(0, 65536, shape)
        if measured:
            zones = replace(zones, sigma_mm=sigma, signal=signal)
        mm = np.rint(1000 * distance).astype(int)
        numbers = np.stack([mm, status, sigma, signal], axis=-1).ravel()
        line = " ".join(map(str, (count, *grid, measured, *numbers)))
        yield f"zones {line}", encode_zones(7, 1.5, zones)


@pytest.mark.skipif(COMPILER is None, reason="no C++ compiler")
@pytest.mark.parametrize("board", BOARDS)
def test_the_firmware_sends_what_the_decoder_reads(tmp_path, board):
    """Frames, frames of zones, and the serial number of its board."""
    (tmp_path / "main.cpp").write_text(PROGRAM)
    (tmp_path / "pico").mkdir()
    (tmp_path / "pico" / "unique_id.h").touch()
    flags = ["-std=c++11", *WARNINGS[1:], f"-D{board}", f"-I{tmp_path}", f"-I{FIRMWARE}"]
    compiled(*flags, tmp_path / "main.cpp", "-o", tmp_path / "main")
    rng = np.random.default_rng(0)
    lines, frames = zip(*drawn_frames(rng), strict=True)
    more, zones = zip(*drawn_zones(rng), strict=True)
    told = "\n".join([*lines, *more]).encode()
    sent = subprocess.run([tmp_path / "main"], input=told, capture_output=True, check=True).stdout
    for frame, sequence, micros, mm, status in frames:
        size = frame_length(len(mm))
        (found,) = Decoder(len(mm)).feed(sent[:size], 0.0)
        assert found.sequence == sequence
        assert found.clock == pytest.approx(micros / 1e6)
        assert found.status.tolist() == status.tolist()
        there = np.isin(status, (Status.VALID, Status.WEAK))
        np.testing.assert_array_equal(found.distance, np.where(there, mm / 1000, np.nan))
        assert sent[:size] == frame
        sent = sent[size:]
    wanted = BOARDS[board]
    said = hello(16, int(wanted or "0", 16))
    assert sent == b"".join(zones) + said
    assert HelloReader(16, Counts()).feed(said) == [wanted] * bool(wanted)


def test_the_documented_check_is_the_one_used():
    assert zlib.crc32(b"123456789") == 0xCBF43926
