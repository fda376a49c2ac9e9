// What the sketch uses of an Arduino core, with simulated pins, time and serial port.
#pragma once

#include <stddef.h>
#include <stdint.h>

#include <pins_arduino.h>

#include "simulator.h"

enum { LOW = 0, HIGH = 1, INPUT = 0, OUTPUT = 1, RISING = 1, INPUT_PULLDOWN = 9 };

inline void pinMode(uint8_t pin, uint8_t mode) { simulator::pin_mode(pin, mode == OUTPUT); }
inline void digitalWrite(uint8_t pin, uint8_t level) { simulator::pin_level(pin, level == HIGH); }
inline int digitalPinToInterrupt(uint8_t pin) { return pin; }
inline void attachInterrupt(int pin, void (*called)(), int mode) {
  if (mode == RISING) simulator::interrupt(pin, called);
}
inline uint32_t micros() { return uint32_t(simulator::now_us()); }
inline uint32_t millis() { return uint32_t(simulator::now_us() / 1000); }
inline void delay(uint32_t ms) { simulator::pass_us(1000ull * ms); }
inline void delayMicroseconds(uint32_t us) { simulator::pass_us(us); }

struct SerialPort {
  void begin(uint32_t baud) { simulator::open_serial(baud); }
  size_t write(const uint8_t* data, size_t size) { return simulator::send(data, size); }
};
extern SerialPort Serial;

#if defined(ARDUINO_ARCH_ESP32)
struct EspClass {
  uint64_t getEfuseMac() { return 0x665544332211ull; }  // of the MAC address 11:22:33:44:55:66, its first byte lowest
};
extern EspClass ESP;
#endif
