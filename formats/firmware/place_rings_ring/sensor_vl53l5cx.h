// VL53L5CX, by SparkFun's library of that name, which holds ST's driver. It loads 84 kB into each sensor, about 2.5 s at 400 kHz.
#pragma once

#include <SparkFun_VL53L5CX_Library.h>
#include <Wire.h>
#include <math.h>

#include "ring_config.h"
#include "ring_frame.h"

namespace ring_sensor {

using namespace ring_config;

const uint8_t ZONES = RING_ROWS * RING_COLUMNS;

static SparkFun_VL53L5CX sensors[COUNT];

// Start sensor i at `address`: it keeps that address, and answers there, while it has power; at first it has the default one.
inline bool start(uint8_t i, uint8_t address) {
  SparkFun_VL53L5CX& sensor = sensors[i];
  sensor.setWireMaxPacketSize(128);
  const bool moved = address != SENSOR_ADDRESS;
  const bool kept = moved && sensor.begin(address, Wire);
  if (!kept && !sensor.begin(SENSOR_ADDRESS, Wire)) return false;
  if (moved && !kept && !sensor.setAddress(address)) return false;
  return sensor.setResolution(ZONES) && sensor.setRangingFrequency(RING_RANGING_HZ) &&
         sensor.setTargetOrder(SF_VL53L5CX_TARGET_ORDER::CLOSEST) && sensor.startRanging();
}

inline bool ready(uint8_t i) { return sensors[i].isDataReady(); }

// By ST's table: 5 and 9 are valid; 3, 4, 6, 10 and 12 are uncertain distances; 0 is no measurement.
inline uint8_t status_of(uint8_t code, bool any) {
  if (!any) return ring_frame::NO_TARGET;
  switch (code) {
    case 5:
    case 9:
      return ring_frame::VALID;
    case 3:
    case 4:
    case 6:
    case 10:
    case 12:
      return ring_frame::WEAK;
    case 0:
      return ring_frame::FAILED;
    default:
      return ring_frame::NO_TARGET;
  }
}

// The chip states distances along its axis; the protocol wants them along the direction of each zone.
inline float slant(uint8_t zone) {
  const float x = float(2 * (zone % RING_COLUMNS) + 1 - RING_COLUMNS) / RING_COLUMNS;
  const float y = float(2 * (zone / RING_COLUMNS) + 1 - RING_ROWS) / RING_ROWS;
  return sqrtf(1.0f + RING_TANGENT * RING_TANGENT * (x * x + y * y));
}

// Read the first target of each zone, in the chip's order; return whether the sensor answered.
inline bool read(uint8_t i, ring_frame::Target* targets) {
  static VL53L5CX_ResultsData data;
  if (!sensors[i].getRangingData(&data)) return false;
  for (uint8_t z = 0; z < ZONES; z++) {
    const size_t at = size_t(z) * VL53L5CX_NB_TARGET_PER_ZONE;
    const uint32_t signal = data.signal_per_spad[at];
    targets[z].status = status_of(data.target_status[at], data.nb_target_detected[z] > 0);
    targets[z].mm = data.distance_mm[at] > 0 ? uint16_t(lroundf(slant(z) * data.distance_mm[at])) : 0;
    targets[z].sigma_mm = data.range_sigma_mm[at];
    targets[z].signal_kcps = uint16_t(signal < 0xFFFF ? signal : 0xFFFF);
  }
  return true;
}

}  // namespace ring_sensor
