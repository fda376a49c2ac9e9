// VL53L1X, by Pololu's library of that name.
#pragma once

#include <VL53L1X.h>

#include "ring_config.h"
#include "ring_frame.h"

namespace ring_sensor {

using namespace ring_config;

static VL53L1X sensors[COUNT];

// Start sensor i, which answers at its default address, and move it to `address`.
inline bool start(uint8_t i, uint8_t address) {
  VL53L1X& sensor = sensors[i];
  sensor = VL53L1X();
  sensor.setTimeout(50);
  if (!sensor.init()) return false;
  if (address != SENSOR_ADDRESS) sensor.setAddress(address);
  sensor.setDistanceMode(VL53L1X::RING_DISTANCE_MODE);
#if defined(RING_SLOTS)
  sensor.setMeasurementTimingBudget((RANGING_MS - 5) * 1000);
#else
  sensor.setMeasurementTimingBudget(uint32_t(PERIOD_MS - 5) * 1000);
  sensor.startContinuous(PERIOD_MS);
#endif
  return true;
}

#if defined(RING_SLOTS)
inline void fire(uint8_t i) { sensors[i].readSingle(false); }
inline void stop(uint8_t i) { sensors[i].stopContinuous(); }
#endif

inline bool ready(uint8_t i) { return sensors[i].dataReady(); }

// Out of bounds or too weak means no target; a large spread or a distance below the minimum means a weak reading.
inline uint8_t status_of(VL53L1X::RangeStatus status) {
  switch (status) {
    case VL53L1X::RangeValid:
      return ring_frame::VALID;
    case VL53L1X::RangeValidNoWrapCheckFail:
    case VL53L1X::RangeValidMinRangeClipped:
    case VL53L1X::SigmaFail:
      return ring_frame::WEAK;
    case VL53L1X::SignalFail:
    case VL53L1X::OutOfBoundsFail:
    case VL53L1X::WrapTargetFail:
      return ring_frame::NO_TARGET;
    default:
      return ring_frame::FAILED;
  }
}

inline ring_frame::Reading read(uint8_t i) {
  sensors[i].read(false);
  ring_frame::Reading reading = {sensors[i].ranging_data.range_mm, status_of(sensors[i].ranging_data.range_status)};
  return reading;
}

}  // namespace ring_sensor
