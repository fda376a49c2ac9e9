// Pin constants of the ESP32-S3 Dev Module as its Arduino core has them, and the chip's pins that a sketch must not drive.
#pragma once
#include <stdint.h>

#define CONFIG_IDF_TARGET_ESP32S3 1

static const uint8_t SDA = 8, SCL = 9, TX = 43, RX = 44;

// GPIO0 to 21 and 26 to 48 exist. Boot: 0, 3, 45, 46. USB: 19, 20. Flash and PSRAM: 26 to 37. Serial: 43, 44. LED: 38, 48.
static const int BOARD_TAKEN[] = {0,  3,  19, 20, 22, 23, 24, 25, 26, 27, 28, 29, 30, 31,
                                  32, 33, 34, 35, 36, 37, 38, 43, 44, 45, 46, 48, 49, -1};
