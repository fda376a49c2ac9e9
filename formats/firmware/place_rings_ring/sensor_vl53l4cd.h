// VL53L4CD, by STMicroelectronics' library STM32duino VL53L4CD.
#pragma once

#include <Wire.h>
#include <vl53l4cd_class.h>

#include "ring_bus.h"
#include "ring_config.h"
#include "ring_frame.h"

namespace ring_sensor {

using namespace ring_config;

// Sensors without a pin for XSHUT: the ring drives those itself.
struct Sensor : VL53L4CD {
  Sensor() : VL53L4CD(&Wire, -1) {}
};

static Sensor sensors[COUNT];

// Start sensor i, which answers at its default address, and move it to `address`.
inline bool start(uint8_t i, uint8_t address) {
  Sensor& sensor = sensors[i];
  sensor = Sensor();
  sensor.begin();
  if (sensor.InitSensor(uint8_t(address << 1)) != VL53L4CD_ERROR_NONE) return false;
#if defined(RING_SLOTS)
  // It is stopped long before the second ranging, even if the library waits for another sensor to start: twice for a second or two.
  return sensor.VL53L4CD_SetRangeTiming(RANGING_MS - 5, 10000) == VL53L4CD_ERROR_NONE;
#else
  if (sensor.VL53L4CD_SetRangeTiming(PERIOD_MS - 5, PERIOD_MS) != VL53L4CD_ERROR_NONE) return false;
  return sensor.VL53L4CD_StartRanging() == VL53L4CD_ERROR_NONE;
#endif
}

#if defined(RING_SLOTS)
// As the library starts a sensor with a period, which then waits for the first reading and drops it.
inline void fire(uint8_t i) {
  Wire.beginTransmission(ring_bus::address(i));
  Wire.write(uint8_t(0x00)), Wire.write(uint8_t(0x87));  // SYSTEM_START
  Wire.write(uint8_t(0x40));
  Wire.endTransmission();
}

inline void stop(uint8_t i) { sensors[i].VL53L4CD_StopRanging(), sensors[i].VL53L4CD_ClearInterrupt(); }
#endif

inline bool ready(uint8_t i) {
  uint8_t is_ready = 0;
  return sensors[i].VL53L4CD_CheckForDataReady(&is_ready) == VL53L4CD_ERROR_NONE && is_ready;
}

// By ST's table: 0 is valid; 1, 3, 6 and 11 are uncertain distances; 2, 4, 7 and 12 are too weak or out of bounds.
inline uint8_t status_of(uint8_t code) {
  switch (code) {
    case 0:
      return ring_frame::VALID;
    case 1:
    case 3:
    case 6:
    case 11:
      return ring_frame::WEAK;
    case 2:
    case 4:
    case 7:
    case 12:
      return ring_frame::NO_TARGET;
    default:
      return ring_frame::FAILED;
  }
}

inline ring_frame::Reading read(uint8_t i) {
  VL53L4CD_Result_t result;
  ring_frame::Reading reading = {0, ring_frame::FAILED};
  if (sensors[i].VL53L4CD_GetResult(&result) != VL53L4CD_ERROR_NONE) return reading;
#if defined(RING_SLOTS)
  stop(i);
#else
  sensors[i].VL53L4CD_ClearInterrupt();
#endif
  reading.mm = result.distance_mm;
  reading.status = status_of(result.range_status);
  return reading;
}

}  // namespace ring_sensor
