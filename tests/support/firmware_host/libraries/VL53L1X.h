// The part of Pololu's VL53L1X that the sketch uses, with the same names, on the simulated bus.
#pragma once

#include <Wire.h>

class VL53L1X {
 public:
  enum DistanceMode { Short, Medium, Long, Unknown };
  enum RangeStatus : uint8_t {
    RangeValid = 0,
    SigmaFail = 1,
    SignalFail = 2,
    RangeValidMinRangeClipped = 3,
    OutOfBoundsFail = 4,
    HardwareFail = 5,
    RangeValidNoWrapCheckFail = 6,
    WrapTargetFail = 7,
    None = 255
  };
  struct RangingData {
    uint16_t range_mm;
    RangeStatus range_status;
  };
  RangingData ranging_data = {0, None};

  void setTimeout(uint16_t) {}
  void setAddress(uint8_t address) { put(0x01, address & 0x7F), address_ = address; }
  bool init(bool = true) {
    if ((get(0x10F) << 8 | get(0x110)) != 0xEACC) return false;
    put(0x00, 0), delayMicroseconds(100), put(0x00, 1), delay(1);
    for (uint16_t at = 0x2E; at < 0x86; at++) put(at, 0);  // as many settings as the library writes
    return true;
  }
  bool setDistanceMode(DistanceMode mode) { return mode != Unknown; }
  bool setMeasurementTimingBudget(uint32_t us) { return us >= 20000 && (put(0x61, uint8_t(us / 1000 + 5)), true); }
  void startContinuous(uint32_t) { put(0x86, 1), put(0x87, 0x40); }
  void stopContinuous() { put(0x87, 0x80); }
  uint16_t readSingle(bool blocking = true) { return put(0x86, 1), put(0x87, 0x10), blocking ? read() : uint16_t(0); }
  bool dataReady() { return (get(0x31) & 1) == 0; }
  uint16_t read(bool blocking = true) {
    while (blocking && !dataReady()) {
    }
    uint8_t result[17];
    open(0x89, sizeof(result));
    for (uint8_t& byte : result) byte = uint8_t(Wire.read());
    ranging_data.range_mm = uint16_t(result[13] << 8 | result[14]);
    ranging_data.range_status = status_of(result[0]);
    put(0x86, 1);
    return ranging_data.range_mm;
  }

 private:
  uint8_t address_ = 0x29;

  static RangeStatus status_of(uint8_t code) {
    switch (code) {
      case 9: return RangeValid;
      case 6: return SigmaFail;
      case 4: return SignalFail;
      case 8: return RangeValidMinRangeClipped;
      case 5: return OutOfBoundsFail;
      case 3: return HardwareFail;
      case 7: return WrapTargetFail;
      default: return None;
    }
  }
  void put(uint16_t at, uint8_t value) {
    Wire.beginTransmission(address_);
    Wire.write(uint8_t(at >> 8)), Wire.write(uint8_t(at)), Wire.write(value);
    Wire.endTransmission();
  }
  void open(uint16_t at, size_t size) {
    Wire.beginTransmission(address_);
    Wire.write(uint8_t(at >> 8)), Wire.write(uint8_t(at));
    Wire.endTransmission();
    Wire.requestFrom(address_, size);
  }
  uint8_t get(uint16_t at) { return open(at, 1), uint8_t(Wire.read()); }
};
