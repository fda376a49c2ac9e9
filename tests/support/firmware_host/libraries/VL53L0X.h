// The part of Pololu's VL53L0X that the sketch uses, with the same names, on the simulated bus.
#pragma once

#include <Wire.h>

class VL53L0X {
 public:
  enum regAddr {
    SYSRANGE_START = 0x00,
    SYSTEM_INTERRUPT_CLEAR = 0x0B,
    RESULT_INTERRUPT_STATUS = 0x13,
    RESULT_RANGE_STATUS = 0x14,
    I2C_SLAVE_DEVICE_ADDRESS = 0x8A,
    IDENTIFICATION_MODEL_ID = 0xC0
  };

  void setTimeout(uint16_t ms) { timeout_ = ms; }
  void setAddress(uint8_t address) { writeReg(I2C_SLAVE_DEVICE_ADDRESS, address & 0x7F), address_ = address; }
  bool init(bool = true) {
    if (readReg(IDENTIFICATION_MODEL_ID) != 0xEE) return false;
    for (uint8_t k = 0; k < 80; k++) writeReg(0x20, k);  // as many settings as the library writes
    delay(10);                                           // its two calibrations
    return true;
  }
  bool setMeasurementTimingBudget(uint32_t us) { return us >= 20000 && (writeReg(0x61, uint8_t(us / 1000 + 10)), true); }
  void startContinuous(uint32_t = 0) { writeReg(SYSRANGE_START, 0x04); }
  uint16_t readRangeContinuousMillimeters() {
    const uint32_t start = millis();
    while ((readReg(RESULT_INTERRUPT_STATUS) & 0x07) == 0)
      if (timeout_ && uint32_t(millis() - start) > timeout_) return 65535;
    open(RESULT_RANGE_STATUS + 10, 2);
    const int high = Wire.read(), low = Wire.read();
    writeReg(SYSTEM_INTERRUPT_CLEAR, 1);
    return uint16_t(high << 8 | low);
  }
  void writeReg(uint8_t at, uint8_t value) {
    Wire.beginTransmission(address_);
    Wire.write(at), Wire.write(value);
    Wire.endTransmission();
  }
  uint8_t readReg(uint8_t at) { return open(at, 1), uint8_t(Wire.read()); }

 private:
  uint8_t address_ = 0x29;
  uint16_t timeout_ = 0;

  void open(uint8_t at, size_t size) {
    Wire.beginTransmission(address_);
    Wire.write(at);
    Wire.endTransmission();
    Wire.requestFrom(address_, size);
  }
};
