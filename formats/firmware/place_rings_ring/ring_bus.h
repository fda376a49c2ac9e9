// The I2C bus of a ring: its pins and clock, and how one sensor of many with the same address is reached.
#pragma once

#include <Arduino.h>
#include <Wire.h>

#include "ring_config.h"

namespace ring_bus {

using namespace ring_config;

inline void begin_wire() {
#if defined(ARDUINO_ARCH_ESP32)
  Wire.begin(int(SDA_PIN), int(SCL_PIN), CLOCK_HZ);
  Wire.setTimeOut(10);  // ms, for a bus that is held low
#else
  Wire.setSDA(SDA_PIN);
  Wire.setSCL(SCL_PIN);
  Wire.begin();
  Wire.setClock(CLOCK_HZ);
#endif
}

#if RING_MULTIPLEXERS

// TCA9548A: one register, with a bit for each connected channel. All sensors keep their default address, so at most one channel
// of all multiplexers is connected at any time.
const uint8_t NONE = 255;
static uint8_t selected = NONE;

inline bool set_channels(uint8_t multiplexer, uint8_t channels) {
  Wire.beginTransmission(uint8_t(FIRST_MULTIPLEXER + multiplexer));
  Wire.write(channels);
  return Wire.endTransmission() == 0;
}

// Disconnect all channels; this frees a bus that a sensor holds low.
inline void reset() {
  digitalWrite(RESET_PIN, LOW);
  delayMicroseconds(10);
  digitalWrite(RESET_PIN, HIGH);
  selected = NONE;
}

inline void begin() {
  pinMode(RESET_PIN, OUTPUT);
  reset();
  begin_wire();
}

// Connect sensor i to the bus, alone; return whether that worked.
inline bool reach(uint8_t i) {
  if (selected == i) return true;
  const Place& place = PLACES[i];
  for (uint8_t attempt = 0; attempt < 2; attempt++) {
    const bool other = selected != NONE && PLACES[selected].multiplexer != place.multiplexer;
    if ((!other || set_channels(PLACES[selected].multiplexer, 0)) && set_channels(place.multiplexer, uint8_t(1u << place.channel))) {
      selected = i;
      return true;
    }
    reset();
  }
  return false;
}

inline void wake(uint8_t) {}
inline void hold(uint8_t) { reset(); }  // what the multiplexers connect may not be what was written: they lose it with their supply
inline uint8_t address(uint8_t) { return SENSOR_ADDRESS; }

#else

// One bus for all, each XSHUT on its own pin: a sensor that is held in shutdown has left the bus.
inline void hold(uint8_t i) {
  pinMode(XSHUT[i], OUTPUT);
  digitalWrite(XSHUT[i], LOW);
}

inline void begin() {
  for (uint8_t i = 0; i < COUNT; i++) hold(i);
  begin_wire();
}

inline void wake(uint8_t i) {
  hold(i);
  delay(2);
  pinMode(XSHUT[i], INPUT);  // the carrier pulls it up
  delay(2);
}

inline bool reach(uint8_t) { return true; }
inline uint8_t address(uint8_t i) { return uint8_t(SENSOR_ADDRESS + 1 + i); }

#endif

}  // namespace ring_bus
