// The sketch as the Arduino tools compile it, with the pins that its board's own header names.
#include <Arduino.h>
#include <Wire.h>

SerialPort Serial;
TwoWire Wire;
#if defined(ARDUINO_ARCH_ESP32)
EspClass ESP;
#endif
extern const int* const board_taken;
const int* const board_taken = BOARD_TAKEN;

#include SKETCH

static_assert(ring_config::SDA_PIN == SDA && ring_config::SCL_PIN == SCL, "Wire is on the pins of the board's own header");
