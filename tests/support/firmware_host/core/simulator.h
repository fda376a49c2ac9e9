// A controller board's pins, clock, serial port and I2C bus, with multiplexers and sensors on it.
#pragma once

#include <stddef.h>
#include <stdint.h>

namespace simulator {

void pin_mode(int pin, bool output);
void pin_level(int pin, bool high);
void interrupt(int pin, void (*called)());
uint64_t now_us();
void pass_us(uint64_t us);
void open_serial(uint32_t baud);
size_t send(const uint8_t* data, size_t size);
bool open_bus(int sda, int scl, uint32_t hertz);
void bus_clock(uint32_t hertz);
void bus_timeout(uint32_t ms);
uint8_t write_bus(uint8_t address, const uint8_t* data, size_t size);
size_t read_bus(uint8_t address, uint8_t* data, size_t size);

}  // namespace simulator
