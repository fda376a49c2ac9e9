"""The reference firmware's encoder, compiled for the host, against the decoder."""

import shutil
import subprocess
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from place_rings.formats.ring_frame import frame_length
from place_rings.rig.rings.protocol import Decoder, Status, encode, encode_zones
from place_rings.rig.rings.zones import Zones

FIRMWARE = Path(__file__).parents[2] / "formats" / "firmware" / "place_rings_ring"
COMPILER = next(
    (found for name in ("c++", "g++", "clang++") if (found := shutil.which(name))), None
)
PROGRAM = """
#include <cstdio>
#include "ring_frame.h"
int main() {
  unsigned count, sequence, mm, status;
  unsigned long long micros;
  while (std::scanf("%u %u %llu", &count, &sequence, &micros) == 3) {
    ring_frame::Reading readings[64];
    for (unsigned i = 0; i < count && std::scanf("%u %u", &mm, &status) == 2; i++)
      readings[i] = {uint16_t(mm), uint8_t(status)};
    uint8_t frame[ring_frame::length(64)];
    std::fwrite(frame, 1, ring_frame::encode(frame, uint16_t(sequence), micros, readings, \
uint8_t(count)), stdout);
  }
}
"""


@pytest.mark.skipif(COMPILER is None, reason="no C++ compiler")
def test_the_firmware_sends_what_the_decoder_reads(tmp_path):
    (tmp_path / "main.cpp").write_text(PROGRAM)
    warnings = ["-std=c++11", "-Wall", "-Wextra", "-Werror", "-pedantic"]
    subprocess.run(
        [COMPILER, *warnings, "-I", FIRMWARE, "main.cpp", "-o", "main"], cwd=tmp_path, check=True
    )
    rng = np.random.default_rng(0)
    frames = []
    for sequence in (0, 1, 255, 256, 65535):
        count = int(rng.integers(1, 65))
        status = rng.integers(0, 4, count)
        mm = rng.integers(0, 65536, count)
        frames.append((sequence, int(rng.integers(0, 2**50)), mm, status))
    told = "\n".join(
        f"{len(mm)} {n} {t} " + " ".join(f"{a} {b}" for a, b in zip(mm, s, strict=True))
        for n, t, mm, s in frames
    )
    sent = subprocess.run(
        [tmp_path / "main"], input=told.encode(), capture_output=True, check=True
    ).stdout
    for sequence, micros, mm, status in frames:
        size = frame_length(len(mm))
        (found,) = Decoder(len(mm)).feed(sent[:size], 0.0)
        assert found.sequence == sequence
        assert found.clock == pytest.approx(micros / 1e6)
        assert found.status.tolist() == status.tolist()
        there = np.isin(status, (Status.VALID, Status.WEAK))
        np.testing.assert_array_equal(found.distance, np.where(there, mm / 1000, np.nan))
        assert sent[:size] == encode(sequence, micros / 1e6, mm / 1000, status)
        sent = sent[size:]
    assert not sent


ZONES = """
#include <cstdio>
#include "ring_frame.h"
int main() {
  unsigned count, rows, columns, targets, measured, mm, status, sigma, signal;
  while (std::scanf("%u %u %u %u %u", &count, &rows, &columns, &targets, &measured) == 5) {
    static ring_frame::Target all[4 * 64 * 4];
    const ring_frame::Grid grid = {uint8_t(rows), uint8_t(columns), uint8_t(targets), measured > 0};
    for (unsigned i = 0; i < count * rows * columns * targets; i++) {
      if (std::scanf("%u %u %u %u", &mm, &status, &sigma, &signal) != 4) return 1;
      all[i] = {uint16_t(mm), uint8_t(status), uint16_t(sigma), uint16_t(signal)};
    }
    static uint8_t frame[ring_frame::length(4, {8, 8, 4, true})];
    const size_t size = ring_frame::encode_zones(frame, 7, 1500000, all, uint8_t(count), grid);
    if (size != ring_frame::length(uint8_t(count), grid)) return 2;
    std::fwrite(frame, 1, size, stdout);
  }
}
"""


@pytest.mark.skipif(COMPILER is None, reason="no C++ compiler")
def test_the_firmware_s_frames_of_zones_are_those_of_the_protocol(tmp_path):
    (tmp_path / "main.cpp").write_text(ZONES)
    warnings = ["-std=c++11", "-Wall", "-Wextra", "-Werror", "-pedantic"]
    subprocess.run(
        [COMPILER, *warnings, "-I", FIRMWARE, "main.cpp", "-o", "main"], cwd=tmp_path, check=True
    )
    rng = np.random.default_rng(0)
    told, wanted = list[str](), b""
    for count, *grid, measured in ((1, 4, 4, 1, 0), (4, 8, 8, 4, 1), (3, 2, 5, 2, 1)):
        shape = (count, *grid)
        status = rng.integers(0, 4, shape)
        distance = rng.integers(0, 65536, shape) / 1000
        zones = Zones.of(distance, status)
        sigma, signal = rng.integers(0, 400, shape), rng.integers(0, 65536, shape)
        if measured:
            zones = replace(zones, sigma_mm=sigma, signal=signal)
        wanted += encode_zones(7, 1.5, zones)
        mm = np.rint(1000 * distance).astype(int)
        numbers = np.stack([mm, status, sigma, signal], axis=-1)
        told.append(" ".join(map(str, (count, *grid, measured, *numbers.ravel()))))
    given = "\n".join(told).encode()
    sent = subprocess.run([tmp_path / "main"], input=given, capture_output=True, check=True).stdout
    assert sent == wanted


def test_the_documented_check_is_the_one_used():
    assert zlib.crc32(b"123456789") == 0xCBF43926
