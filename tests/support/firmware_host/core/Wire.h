// The I2C class of both cores: arduino-esp32 takes its pins with begin(), arduino-pico by setSDA() and setSCL() before it.
#pragma once

#include <Arduino.h>

class TwoWire {
 public:
#if defined(ARDUINO_ARCH_ESP32)
  bool begin(int sda, int scl, uint32_t frequency = 0) { return simulator::open_bus(sda, scl, frequency ? frequency : 100000); }
  bool begin(uint8_t, int, int, uint32_t) { return false; }
  void setTimeOut(uint16_t ms) { simulator::bus_timeout(ms); }
#else
  bool setSDA(uint8_t pin) { return sda_ = pin, pin % 4 == 0; }
  bool setSCL(uint8_t pin) { return scl_ = pin, pin % 4 == 1; }
  void begin() { simulator::open_bus(sda_, scl_, 100000); }
#endif
  void setClock(uint32_t hertz) { simulator::bus_clock(hertz); }
  void beginTransmission(uint8_t address) { address_ = address, size_ = 0; }
  size_t write(uint8_t byte) { return size_ < sizeof(out_) ? (out_[size_++] = byte, 1) : 0; }
  uint8_t endTransmission() { return simulator::write_bus(address_, out_, size_); }
  size_t requestFrom(uint8_t address, size_t size) {
    in_size_ = simulator::read_bus(address, in_, size), in_at_ = 0;
    return in_size_;
  }
  int read() { return in_at_ < in_size_ ? in_[in_at_++] : -1; }

 private:
  uint8_t address_ = 0, out_[128], in_[128];
  size_t size_ = 0, in_size_ = 0, in_at_ = 0;
#if !defined(ARDUINO_ARCH_ESP32)
  uint8_t sda_ = SDA, scl_ = SCL;
#endif
};
extern TwoWire Wire;
