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

// Write magic and header; return where they end.
inline uint8_t* head(uint8_t* at, uint8_t magic, uint8_t count, uint16_t sequence, uint64_t micros) {
  *at++ = 0xA5;
  *at++ = magic;
  *at++ = 1;  // version
  *at++ = count;
  *at++ = uint8_t(255 - count);
  at = put(at, sequence, 2);
  return put(at, micros, 8);
}

// Write a frame of `count` readings to `frame`, which must have room for `length(count)` bytes; return that length.
inline size_t encode(uint8_t* frame, uint16_t sequence, uint64_t micros, const Reading* readings, uint8_t count) {
  uint8_t* at = head(frame, 0xC3, count, sequence, micros);
  for (uint8_t i = 0; i < count; i++) {
    const bool there = readings[i].status == VALID || readings[i].status == WEAK;
    at = put(at, there ? readings[i].mm : 0, 2);
    *at++ = readings[i].status;
  }
  at = put(at, crc32(frame, size_t(at - frame)), 4);
  return size_t(at - frame);
}

// A target in a zone: distance from the sensor along the zone's own direction, and what the chip states of its precision.
struct Target {
  uint16_t mm;
  uint8_t status;
  uint16_t sigma_mm;
  uint16_t signal_kcps;  // per SPAD
};

// What a frame of sensors with zones holds of each sensor; `measured`: each target has its sigma and signal.
struct Grid {
  uint8_t rows, columns, targets;
  bool measured;
};

constexpr size_t length(uint8_t count, Grid grid) {
  return HEADER + 5 + size_t(grid.measured ? 6 : 3) * grid.targets * grid.rows * grid.columns * count + CHECK;
}

// Write a frame of `count` sensors to `frame`, which must have room for `length(count, grid)` bytes; return that length. The
// targets follow sensor by sensor, zone by zone (row by row, from the upper left as the sensor sees it), nearest first.
inline size_t encode_zones(uint8_t* frame, uint16_t sequence, uint64_t micros, const Target* targets, uint8_t count, Grid grid) {
  uint8_t* at = head(frame, 0xC6, count, sequence, micros);
  const uint8_t four[4] = {grid.rows, grid.columns, grid.targets, uint8_t(grid.measured)};
  for (uint8_t byte : four) *at++ = byte;
  *at++ = uint8_t(255 ^ four[0] ^ four[1] ^ four[2] ^ four[3]);
  const size_t all = size_t(count) * grid.rows * grid.columns * grid.targets;
  for (size_t i = 0; i < all; i++) {
    const bool there = targets[i].status == VALID || targets[i].status == WEAK;
    at = put(at, there ? targets[i].mm : 0, 2);
    *at++ = targets[i].status;
    if (!grid.measured) continue;
    *at++ = uint8_t(targets[i].sigma_mm < 255 ? targets[i].sigma_mm : 255);
    at = put(at, targets[i].signal_kcps, 2);
  }
  at = put(at, crc32(frame, size_t(at - frame)), 4);
  return size_t(at - frame);
}

const size_t HELLO = 16;

// Write the hello of a ring of `count` sensors, whose board has this serial number, to `hello`; return its length. 0: none.
inline size_t encode_hello(uint8_t* hello, uint8_t count, uint64_t serial) {
  const uint8_t head[4] = {0xA5, 0xC5, 1, count};  // magic, version
  for (size_t i = 0; i < sizeof(head); i++) hello[i] = head[i];
  put(hello + 4, serial, 8);
  put(hello + 12, crc32(hello, 12), 4);
  return HELLO;
}

}  // namespace ring_frame
