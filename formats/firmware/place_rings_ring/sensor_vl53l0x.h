// VL53L0X, by Pololu's library of that name.
#pragma once

#include <VL53L0X.h>

#include "ring_config.h"
#include "ring_frame.h"

namespace ring_sensor {

using namespace ring_config;

static VL53L0X sensors[COUNT];

#if defined(RING_SLOTS)
static uint8_t stop_variable[COUNT];  // as in the library, which reads a single ranging only by waiting for it

inline void open_page(VL53L0X& sensor, bool open) {
  if (open) sensor.writeReg(0x80, 0x01), sensor.writeReg(0xFF, 0x01), sensor.writeReg(0x00, 0x00);
  if (!open) sensor.writeReg(0x00, 0x01), sensor.writeReg(0xFF, 0x00), sensor.writeReg(0x80, 0x00);
}

inline void fire(uint8_t i) {
  open_page(sensors[i], true);
  sensors[i].writeReg(0x91, stop_variable[i]);
  open_page(sensors[i], false);
  sensors[i].writeReg(VL53L0X::SYSRANGE_START, 0x01);
}

// A single ranging ends by itself; a reading that comes too late is dropped.
inline void stop(uint8_t i) { sensors[i].writeReg(VL53L0X::SYSTEM_INTERRUPT_CLEAR, 0x01); }
#endif

// Start sensor i, which answers at its default address, and move it to `address`.
inline bool start(uint8_t i, uint8_t address) {
  VL53L0X& sensor = sensors[i];
  sensor = VL53L0X();
  sensor.setTimeout(50);
  if (!sensor.init()) return false;
  if (address != SENSOR_ADDRESS) sensor.setAddress(address);
#if defined(RING_SLOTS)
  if (!sensor.setMeasurementTimingBudget((RANGING_MS - 10) * 1000)) return false;
  open_page(sensor, true);
  stop_variable[i] = sensor.readReg(0x91);
  open_page(sensor, false);
#else
  if (!sensor.setMeasurementTimingBudget(uint32_t(PERIOD_MS - 10) * 1000)) return false;
  sensor.startContinuous(PERIOD_MS);
#endif
  return true;
}

inline bool ready(uint8_t i) { return (sensors[i].readReg(VL53L0X::RESULT_INTERRUPT_STATUS) & 0x07) != 0; }

// The status is in bits 3 to 6 of its register, as in ST's driver: 11 is valid, 8 and 10 are below the minimum distance, 4 is too
// weak, 6 and 9 are out of bounds.
inline uint8_t status_of(uint8_t code) {
  switch (code >> 3 & 0x0F) {
    case 11:
      return ring_frame::VALID;
    case 8:
    case 10:
      return ring_frame::WEAK;
    case 4:
    case 6:
    case 9:
      return ring_frame::NO_TARGET;
    default:
      return ring_frame::FAILED;
  }
}

inline ring_frame::Reading read(uint8_t i) {
  const uint8_t status = status_of(sensors[i].readReg(VL53L0X::RESULT_RANGE_STATUS));
  const uint16_t mm = sensors[i].readRangeContinuousMillimeters();
  const bool beyond = status == ring_frame::VALID && mm >= 8190;  // codes for no target
  ring_frame::Reading reading = {mm, beyond ? uint8_t(ring_frame::NO_TARGET) : status};
  return reading;
}

}  // namespace ring_sensor
