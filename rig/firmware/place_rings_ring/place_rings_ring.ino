// A ring of VL53L1X sensors on an ESP32 or RP2040 that speaks the place-rings ring protocol over its serial port.
//
// Wiring: all sensors on one I2C bus, each XSHUT on its own pin. Sensor 0 sits at the ring's phase; the others follow
// right-handed about the link's axis, which points from its proximal to its distal end. `place-rings check` detects any other order.
// Libraries: Wire, and Pololu's VL53L1X. Board: any ESP32 or RP2040 core.
//
// A sensor that does not start, or does not answer in time, is reported as FAILED and restarted from time to time.

#include <VL53L1X.h>
#include <Wire.h>

#include "ring_frame.h"

const uint8_t XSHUT[] = {4, 5, 6, 7, 8, 9, 10, 11};  // pins, in the order of the sensors
const uint8_t COUNT = sizeof(XSHUT);
const uint8_t FIRST_ADDRESS = 0x2A;
const uint32_t BAUD = 460800;
const uint32_t BUDGET_US = 45000;   // us for one measurement
const uint16_t PERIOD_MS = 50;      // between frames: 20 a second
const uint32_t ANSWER_MS = 200;     // without an answer, after which a sensor has failed
const uint32_t RETRY_MS = 5000;     // between attempts to start one that failed

VL53L1X sensors[COUNT];
ring_frame::Reading readings[COUNT];
uint32_t answered[COUNT], tried[COUNT];  // ms
bool running[COUNT];
uint8_t frame[ring_frame::length(COUNT)];
uint16_t sequence = 0;
uint64_t clock_us = 0;
uint32_t last_us = 0, due_ms = 0;

// Start one sensor at its own address, while the sensors not yet started are held in shutdown.
bool start(uint8_t i) {
  tried[i] = millis();
  pinMode(XSHUT[i], OUTPUT);
  digitalWrite(XSHUT[i], LOW);
  delay(2);
  pinMode(XSHUT[i], INPUT);  // the carrier pulls it up
  delay(2);
  sensors[i] = VL53L1X();
  sensors[i].setTimeout(50);
  if (!sensors[i].init()) {
    pinMode(XSHUT[i], OUTPUT);
    digitalWrite(XSHUT[i], LOW);  // off the bus: it would answer at the default address
    return false;
  }
  sensors[i].setAddress(FIRST_ADDRESS + i);
  sensors[i].setDistanceMode(VL53L1X::Long);
  sensors[i].setMeasurementTimingBudget(BUDGET_US);
  sensors[i].startContinuous(PERIOD_MS);
  answered[i] = millis();
  return true;
}

// Map the sensor's status: out of bounds or too weak means no target; a large spread or a distance below the minimum means a
// weak reading.
uint8_t status_of(VL53L1X::RangeStatus status) {
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

void setup() {
  Serial.begin(BAUD);
  Wire.begin();
  Wire.setClock(400000);
  for (uint8_t i = 0; i < COUNT; i++) {
    pinMode(XSHUT[i], OUTPUT);
    digitalWrite(XSHUT[i], LOW);
  }
  for (uint8_t i = 0; i < COUNT; i++) running[i] = start(i);
  last_us = micros();
  due_ms = millis();
}

void loop() {
  for (uint8_t i = 0; i < COUNT; i++) {
    if (running[i] && sensors[i].dataReady()) {
      sensors[i].read(false);
      readings[i].mm = sensors[i].ranging_data.range_mm;
      readings[i].status = status_of(sensors[i].ranging_data.range_status);
      answered[i] = millis();
    }
    if (!running[i] || uint32_t(millis() - answered[i]) > ANSWER_MS) {
      readings[i].status = ring_frame::FAILED;
      running[i] = false;
      if (uint32_t(millis() - tried[i]) > RETRY_MS) running[i] = start(i);
    }
  }
  const uint32_t now_us = micros();
  clock_us += uint32_t(now_us - last_us);  // micros() wraps every 71 minutes
  last_us = now_us;
  if (int32_t(millis() - due_ms) >= 0) {
    due_ms += PERIOD_MS;
    Serial.write(frame, ring_frame::encode(frame, sequence++, clock_us, readings, COUNT));
  }
}
