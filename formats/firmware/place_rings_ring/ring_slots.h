// Slots of time in which the sensors of a ring range, so that no two range at once that may disturb each other. Rings of one group
// keep in step by the clock line: one ring raises it at the beginning of each cycle, the others time their slots from that edge.
#pragma once

#include <Arduino.h>

#include "ring_config.h"

#if !defined(IRAM_ATTR)
#define IRAM_ATTR
#endif

namespace ring_slots {

using namespace ring_config;

static uint32_t begun_us = 0;  // of the cycle, by this board's own clock
static bool going = false;     // whether a cycle has begun, and the clock line still has edges

#if defined(RING_LEADS) && !RING_LEADS

const uint32_t LATE_US = 1000;  // how late the ring that leads may be
static volatile uint32_t edge_us = 0, edges = 0;

// An edge counts if it follows another after a cycle; one before its time is noise.
inline void IRAM_ATTR on_edge() {
  static bool heard = false;
  static uint32_t last_us = 0;
  const uint32_t now = micros(), since = uint32_t(now - last_us);
  if (heard && since < CYCLE_US - SYNC_US) return;
  const bool counts = heard && since <= CYCLE_US + LATE_US;
  heard = true;
  last_us = now;
  if (!counts) return;
  edge_us = now;
  edges = edges + 1;
}

inline void begin() {
  pinMode(CLOCK_PIN, INPUT_PULLDOWN);  // a wire that has come off is no edge
  attachInterrupt(digitalPinToInterrupt(CLOCK_PIN), on_edge, RISING);
}

// Whether a cycle has begun since the last call.
inline bool next_cycle() {
  static uint32_t taken = 0;
  if (edges != taken) {
    taken = edges;
    begun_us = edge_us;
    going = true;
    return true;
  }
  if (going && uint32_t(micros() - begun_us) > 2 * CYCLE_US) going = false;
  return false;
}

#else

inline void begin() {
#if defined(RING_LEADS)
  pinMode(CLOCK_PIN, OUTPUT);
  digitalWrite(CLOCK_PIN, LOW);
#endif
}

// Begin a cycle if it is time; return whether one has begun.
inline bool next_cycle() {
  const uint32_t since = uint32_t(micros() - begun_us);
  const bool due = !going || since >= CYCLE_US;
  if (due) begun_us = micros();
  going = true;
#if defined(RING_LEADS)
  if (due) digitalWrite(CLOCK_PIN, HIGH);
  if (!due && since >= CYCLE_US / 2) digitalWrite(CLOCK_PIN, LOW);
#endif
  return due;
}

#endif

// Whether sensor i may start now, so that its ranging ends within its slot, on any clock of the group.
inline bool open(uint8_t i) {
  const uint32_t since = uint32_t(micros() - begun_us);
  return going && since >= SLOT_US[SLOT_OF[i]] && since <= LATEST_US[SLOT_OF[i]];
}

// Whether the slot of sensor i, which started in it, ends.
inline bool over(uint8_t i) { return !going || uint32_t(micros() - begun_us) >= END_US[SLOT_OF[i]] - SYNC_US; }

}  // namespace ring_slots
