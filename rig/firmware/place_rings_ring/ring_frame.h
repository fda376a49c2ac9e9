// Frames of the place-rings ring protocol, version 1 (docs/rig.md). It has no Arduino code and compiles on any host.
#pragma once

#include <stddef.h>
#include <stdint.h>

namespace ring_frame {

enum Status : uint8_t { VALID = 0, NO_TARGET = 1, WEAK = 2, FAILED = 3 };

struct Reading {
  uint16_t mm;
  uint8_t status;
};

const size_t HEADER = 15, EACH = 3, CHECK = 4;

constexpr size_t length(uint8_t count) { return HEADER + EACH * count + CHECK; }

// CRC-32 of ISO 3309 (Ethernet, zlib), bit by bit: 800 steps for a ring of 16 sensors, a tenth of a millisecond.
inline uint32_t crc32(const uint8_t* data, size_t size) {
  uint32_t crc = 0xFFFFFFFFu;
  for (size_t i = 0; i < size; i++) {
    crc ^= data[i];
    for (int bit = 0; bit < 8; bit++) crc = (crc >> 1) ^ (crc & 1u ? 0xEDB88320u : 0u);
  }
  return ~crc;
}

inline uint8_t* put(uint8_t* at, uint64_t value, int bytes) {
  for (int i = 0; i < bytes; i++) *at++ = uint8_t(value >> 8 * i);
  return at;
}

// Write a frame of `count` readings to `frame`, which must have room for `length(count)` bytes; return that length.
inline size_t encode(uint8_t* frame, uint16_t sequence, uint64_t micros, const Reading* readings, uint8_t count) {
  uint8_t* at = frame;
  *at++ = 0xA5;
  *at++ = 0xC3;
  *at++ = 1;  // version
  *at++ = count;
  *at++ = uint8_t(255 - count);
  at = put(at, sequence, 2);
  at = put(at, micros, 8);
  for (uint8_t i = 0; i < count; i++) {
    const bool there = readings[i].status == VALID || readings[i].status == WEAK;
    at = put(at, there ? readings[i].mm : 0, 2);
    *at++ = readings[i].status;
  }
  at = put(at, crc32(frame, size_t(at - frame)), 4);
  return size_t(at - frame);
}

}  // namespace ring_frame
