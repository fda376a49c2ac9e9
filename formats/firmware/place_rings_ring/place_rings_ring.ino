// A ring of Time-of-Flight sensors that speaks the place-rings ring protocol over its serial port.
//
// Board, pins and bus are in ring_config.h, which `place-rings export SETUP --to firmware` writes; WIRING.md beside it says how to
// wire them. Sensor 0 sits at the ring's phase; the others follow right-handed about the link's axis, which points from its
// proximal to its distal end. `place-rings check` detects any other order.
//
// A sensor that does not start, or does not answer in time, is reported as FAILED and restarted from time to time. At most one
// sensor starts between two frames, so that no number of failed sensors silences the ring. Sensors with zones take seconds to start:
// all start before the first frame, and one that fails stays FAILED until the board restarts.
//
// With RING_SLOTS each sensor ranges once in a cycle, in its slot (ring_slots.h). Frames hold the latest readings, and the first of a
// cycle is sent when the cycle begins, so that the times of frames show whether rings are in step.

#include <Wire.h>

#include "ring_config.h"
#include "ring_frame.h"
#include "ring_serial.h"
#include "ring_bus.h"
#include "ring_sensor.h"
#if defined(RING_SLOTS)
#include "ring_slots.h"
#endif

using ring_config::COUNT;
using ring_config::PERIOD_MS;

const uint32_t BAUD = 460800;
const uint16_t HELLO_EVERY = 16;  // frames between two hellos with the board's serial number
#if defined(RING_SLOTS)
const uint32_t ANSWER_MS = 200 + 2 * ring_config::CYCLE_US / 1000;  // without an answer, after which a sensor has failed
#else
const uint32_t ANSWER_MS = 200;  // without an answer, after which a sensor has failed
#endif
const uint32_t RETRY_MS = 5000;  // between attempts to start one that failed

#if defined(RING_ROWS)
const bool RESTARTS = false;
const ring_frame::Grid GRID = {RING_ROWS, RING_COLUMNS, 1, true};
const size_t ZONES = ring_sensor::ZONES, LENGTH = ring_frame::length(COUNT, GRID);
ring_frame::Target readings[COUNT * ZONES];

bool read_sensor(uint8_t i) {
  ring_frame::Target* mine = readings + i * ZONES;
  bool any = ring_sensor::read(i, mine), good = false;
  for (size_t z = 0; z < ZONES; z++) good |= mine[z].status != ring_frame::FAILED;
  return any && good;
}

size_t encode(uint8_t* frame, uint16_t sequence, uint64_t micros) {
  return ring_frame::encode_zones(frame, sequence, micros, readings, COUNT, GRID);
}
#else
const bool RESTARTS = true;
const size_t ZONES = 1, LENGTH = ring_frame::length(COUNT);
ring_frame::Reading readings[COUNT];

bool read_sensor(uint8_t i) {
  readings[i] = ring_sensor::read(i);
  return readings[i].status != ring_frame::FAILED;
}

size_t encode(uint8_t* frame, uint16_t sequence, uint64_t micros) {
  return ring_frame::encode(frame, sequence, micros, readings, COUNT);
}
#endif

uint32_t answered[COUNT], tried[COUNT];  // ms
bool running[COUNT], begun[COUNT];
uint8_t frame[LENGTH];
uint8_t hello[ring_frame::HELLO];
uint8_t next_start = 0;
uint16_t sequence = 0;
uint64_t clock_us = 0;
uint32_t last_us = 0, due_ms = 0;

// Start one sensor, alone at its default address: the others are on other channels, in shutdown, or at addresses of their own.
bool start(uint8_t i) {
  tried[i] = millis();
  begun[i] = true;
  ring_bus::wake(i);
  const bool started = ring_bus::reach(i) && ring_sensor::start(i, ring_bus::address(i));
  if (!started) ring_bus::hold(i);  // off the bus: it would answer at the default address
  answered[i] = millis();
  return started;
}

// Start the next sensor that waits for it, if any.
void start_next() {
  for (uint8_t k = 0; k < COUNT; k++) {
    const uint8_t i = next_start;
    next_start = uint8_t((i + 1) % COUNT);
    if (running[i] || (begun[i] && (!RESTARTS || uint32_t(millis() - tried[i]) < RETRY_MS))) continue;
    running[i] = start(i);
    return;
  }
}

void fail(uint8_t i) {
  for (size_t z = 0; z < ZONES; z++) readings[i * ZONES + z].status = ring_frame::FAILED;
  running[i] = false;
  ring_bus::hold(i);
}

#if defined(RING_SLOTS)
bool fired[COUNT], ranging[COUNT];  // in this cycle; now

void stop(uint8_t i) {
  ranging[i] = false;
  if (ring_bus::reach(i)) ring_sensor::stop(i);
}

// Start the sensors that may start now, and stop those that have not ended with their slot.
void keep_slots() {
  const bool begun = ring_slots::next_cycle();
  if (begun) due_ms = millis();
  for (uint8_t i = 0; i < COUNT; i++) {
    if (begun) fired[i] = false;
    if (!running[i]) ranging[i] = false;
    if (ranging[i] && (begun || ring_slots::over(i))) stop(i);
    if (!running[i] || fired[i] || !ring_slots::open(i) || !ring_bus::reach(i) || !ring_slots::open(i)) continue;
    fired[i] = ranging[i] = true;
    ring_sensor::fire(i);
  }
}

bool may_answer(uint8_t i) {
  if (ring_slots::going) return ranging[i];
  for (size_t z = 0; z < ZONES; z++) readings[i * ZONES + z].status = ring_frame::FAILED;  // no clock: it must not range
  answered[i] = millis();
  return false;
}

void took(uint8_t i) { ranging[i] = false; }
#else
void keep_slots() {}
bool may_answer(uint8_t) { return true; }
void took(uint8_t) {}
#endif

// Take a sensor's new reading, if it has one; a failure that it reports is no answer.
void take_reading(uint8_t i) {
  if (!running[i]) return;
  if (may_answer(i) && ring_bus::reach(i) && ring_sensor::ready(i)) {
    took(i);
    if (read_sensor(i)) answered[i] = millis();
  }
  if (uint32_t(millis() - answered[i]) > ANSWER_MS) fail(i);
}

// Send a frame if one is due; those that a slow start delayed are left out.
void send_frame() {
  const uint32_t now_us = micros();
  clock_us += uint32_t(now_us - last_us);  // micros() wraps every 71 minutes
  last_us = now_us;
  const uint32_t late_ms = uint32_t(millis() - due_ms);
  if (int32_t(late_ms) < 0) return;
  due_ms += PERIOD_MS * (1 + late_ms / PERIOD_MS);
  if (sequence % HELLO_EVERY == 0) {
    Serial.write(hello, ring_frame::encode_hello(hello, COUNT, board_serial()));
  }
  Serial.write(frame, encode(frame, sequence++, clock_us));
}

void setup() {
  Serial.begin(BAUD);
  ring_bus::begin();
  for (size_t k = 0; k < COUNT * ZONES; k++) {
    readings[k].mm = 0;
    readings[k].status = ring_frame::FAILED;
  }
  for (uint8_t i = 0; i < COUNT && !RESTARTS; i++) start_next();
  for (uint8_t i = 0; i < COUNT; i++) answered[i] = millis();
  last_us = micros();
  due_ms = millis();
#if defined(RING_SLOTS)
  ring_slots::begin();
#endif
}

void loop() {
  for (uint8_t i = 0; i < COUNT; i++) {
    take_reading(i);
    keep_slots();
    send_frame();
  }
  start_next();
  send_frame();
}
