// The part of STMicroelectronics' VL53L4CD that the sketch uses, with the same names, on the simulated bus.
#pragma once

#include <Wire.h>

typedef uint8_t VL53L4CD_ERROR;
const VL53L4CD_ERROR VL53L4CD_ERROR_NONE = 0, VL53L4CD_ERROR_TIMEOUT = 255;

struct VL53L4CD_Result_t {
  uint8_t range_status;
  uint16_t distance_mm;
};

class VL53L4CD {
 public:
  VL53L4CD(TwoWire* bus, int xshut) : bus_(bus), xshut_(xshut) {}
  virtual ~VL53L4CD() {}
  virtual int begin() { return xshut_ >= 0; }

  VL53L4CD_ERROR InitSensor(uint8_t address = 0x52) {
    delay(20);  // off and on
    if (address != device_) {
      put(0x01, uint8_t(address >> 1));
      device_ = address;
    }
    uint8_t high = 0, low = 0;
    if (!get(0x10F, high) || !get(0x110, low) || (high << 8 | low) != 0xEBAA) return VL53L4CD_ERROR_TIMEOUT;
    for (uint16_t at = 0x32; at < 0x86; at++) put(at, 0);
    return started();
  }
  VL53L4CD_ERROR VL53L4CD_SetRangeTiming(uint32_t budget_ms, uint32_t period_ms) {
    if (budget_ms < 10 || budget_ms > 200 || (period_ms && period_ms <= budget_ms)) return VL53L4CD_ERROR_TIMEOUT;
    const bool answers = put(0x61, uint8_t(budget_ms + 5)) && put(0x62, uint8_t(period_ms >> 8)) && put(0x63, uint8_t(period_ms));
    return answers ? VL53L4CD_ERROR_NONE : VL53L4CD_ERROR_TIMEOUT;
  }
  VL53L4CD_ERROR VL53L4CD_StartRanging() { return started(); }
  VL53L4CD_ERROR VL53L4CD_StopRanging() { return put(0x87, 0) ? VL53L4CD_ERROR_NONE : VL53L4CD_ERROR_TIMEOUT; }
  VL53L4CD_ERROR VL53L4CD_CheckForDataReady(uint8_t* is_ready) {
    uint8_t polarity = 0, status = 1;
    const bool answers = get(0x30, polarity) && get(0x31, status);
    *is_ready = (status & 1) == (polarity & 0x10 ? 0 : 1);
    return answers ? VL53L4CD_ERROR_NONE : VL53L4CD_ERROR_TIMEOUT;
  }
  VL53L4CD_ERROR VL53L4CD_ClearInterrupt() { return put(0x86, 1) ? VL53L4CD_ERROR_NONE : VL53L4CD_ERROR_TIMEOUT; }
  VL53L4CD_ERROR VL53L4CD_GetResult(VL53L4CD_Result_t* result) {
    static const uint8_t TABLE[] = {255, 255, 255, 5, 2, 4, 1, 7, 3, 0, 255, 255, 9, 13, 255, 255, 255, 255, 10, 6, 255, 255, 11, 12};
    uint8_t status = 0, high = 0, low = 0;
    if (!get(0x89, status) || !get(0x96, high) || !get(0x97, low)) return VL53L4CD_ERROR_TIMEOUT;
    status &= 0x1F;
    result->range_status = status < sizeof(TABLE) ? TABLE[status] : status;
    result->distance_mm = uint16_t(high << 8 | low);
    return VL53L4CD_ERROR_NONE;
  }

 private:
  TwoWire* bus_;
  int xshut_;
  uint8_t device_ = 0x52;

  VL53L4CD_ERROR started() {
    put(0x87, 0x40);
    uint8_t is_ready = 0;
    for (uint16_t k = 0; k < 200 && !is_ready; k++) delay(1), VL53L4CD_CheckForDataReady(&is_ready);
    return is_ready ? VL53L4CD_ClearInterrupt() : VL53L4CD_ERROR_TIMEOUT;
  }
  bool put(uint16_t at, uint8_t value) {
    bus_->beginTransmission(uint8_t(device_ >> 1));
    bus_->write(uint8_t(at >> 8)), bus_->write(uint8_t(at)), bus_->write(value);
    return bus_->endTransmission() == 0;
  }
  bool get(uint16_t at, uint8_t& value) {
    bus_->beginTransmission(uint8_t(device_ >> 1));
    bus_->write(uint8_t(at >> 8)), bus_->write(uint8_t(at));
    if (bus_->endTransmission() != 0 || bus_->requestFrom(uint8_t(device_ >> 1), 1) != 1) return false;
    value = uint8_t(bus_->read());
    return true;
  }
};
