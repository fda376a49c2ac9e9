// The part of SparkFun's VL53L5CX library that the sketch uses, with the same names, on the simulated bus. It transfers as many bytes
// as the chip's driver does; what the simulated sensor measures is in its registers of a VL53L1X, and zone z reads z mm more.
#pragma once

#include <Wire.h>

const uint8_t VL53L5CX_RESOLUTION_8X8 = 64;
#define VL53L5CX_NB_TARGET_PER_ZONE 1

enum class SF_VL53L5CX_TARGET_ORDER { STRONGEST, CLOSEST, ERROR };

struct VL53L5CX_ResultsData {
  uint8_t nb_target_detected[VL53L5CX_RESOLUTION_8X8];
  uint32_t signal_per_spad[VL53L5CX_RESOLUTION_8X8 * VL53L5CX_NB_TARGET_PER_ZONE];
  uint16_t range_sigma_mm[VL53L5CX_RESOLUTION_8X8 * VL53L5CX_NB_TARGET_PER_ZONE];
  int16_t distance_mm[VL53L5CX_RESOLUTION_8X8 * VL53L5CX_NB_TARGET_PER_ZONE];
  uint8_t target_status[VL53L5CX_RESOLUTION_8X8 * VL53L5CX_NB_TARGET_PER_ZONE];
};

class SparkFun_VL53L5CX {
 public:
  bool begin(uint8_t address, TwoWire& bus) {
    bus_ = &bus, device_ = address;
    uint8_t high = 0;
    if (!get(0x10F, high)) return false;
    for (uint32_t sent = 0; sent < 84000; sent += packet_ - 2u) {
      bus_->beginTransmission(device_);
      for (uint8_t i = 0; i < packet_; i++) bus_->write(uint8_t(i ? 0 : 0x70));
      if (bus_->endTransmission() != 0) return false;
    }
    return true;
  }
  bool setAddress(uint8_t address) {
    const bool done = put(0x01, address);
    device_ = address;
    return done;
  }
  bool setResolution(uint8_t zones) { return zones_ = zones, zones == 16 || zones == 64; }
  bool setRangingFrequency(uint8_t hertz) { return hertz >= 1 && hertz <= (zones_ == 64 ? 15 : 60); }
  bool setTargetOrder(SF_VL53L5CX_TARGET_ORDER order) { return order == SF_VL53L5CX_TARGET_ORDER::CLOSEST; }
  void setWireMaxPacketSize(uint8_t size) { packet_ = size; }
  bool startRanging() { return put(0x87, 0x40); }
  bool isDataReady() {
    uint8_t status = 1;
    return get(0x31, status) && !(status & 1);
  }
  bool getRangingData(VL53L5CX_ResultsData* data) {
    uint8_t code = 0, high = 0, low = 0;
    if (!get(0x89, code) || !get(0x96, high) || !get(0x97, low)) return false;
    for (int left = 210 + 19 * zones_; left > 0; left -= packet_) {
      bus_->beginTransmission(device_);
      bus_->write(0), bus_->write(0);
      if (bus_->endTransmission() != 0 || !bus_->requestFrom(device_, size_t(left < packet_ ? left : packet_))) return false;
    }
    for (uint8_t z = 0; z < zones_; z++) {
      data->nb_target_detected[z] = code != 255;
      data->signal_per_spad[z] = 1000u * z;
      data->range_sigma_mm[z] = uint16_t(5 * z);
      data->distance_mm[z] = int16_t((high << 8 | low) + z);
      data->target_status[z] = code;
    }
    return put(0x86, 1);
  }

 private:
  TwoWire* bus_ = nullptr;
  uint8_t device_ = 0x29, packet_ = 32, zones_ = 16;

  bool put(uint16_t at, uint8_t value) {
    bus_->beginTransmission(device_);
    bus_->write(uint8_t(at >> 8)), bus_->write(uint8_t(at)), bus_->write(value);
    return bus_->endTransmission() == 0;
  }
  bool get(uint16_t at, uint8_t& value) {
    bus_->beginTransmission(device_);
    bus_->write(uint8_t(at >> 8)), bus_->write(uint8_t(at));
    if (bus_->endTransmission() != 0 || bus_->requestFrom(device_, size_t(1)) != 1) return false;
    value = uint8_t(bus_->read());
    return true;
  }
};
