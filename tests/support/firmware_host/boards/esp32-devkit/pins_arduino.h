// Pin constants of the ESP32 Dev Module as its Arduino core has them, and the chip's pins that a sketch must not drive.
#pragma once
#include <stdint.h>

#define CONFIG_IDF_TARGET_ESP32 1

static const uint8_t SDA = 21, SCL = 22, TX = 1, RX = 3;

// Boot: 0, 2, 5, 12, 15. Serial: 1, 3. Flash: 6 to 11. Input only: 34 to 39. Not there: 20, 24, 28 to 31.
static const int BOARD_TAKEN[] = {0,  1,  2,  3,  5,  6,  7,  8,  9,  10, 11, 12, 15, 20, 24,
                                  28, 29, 30, 31, 34, 35, 36, 37, 38, 39, 40, -1};
