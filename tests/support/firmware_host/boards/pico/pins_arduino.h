// Pin constants of the Raspberry Pi Pico as its Arduino core has them, and the board's pins that a sketch must not drive.
#pragma once
#include <stdint.h>

static const uint8_t SDA = 4, SCL = 5, TX = 0, RX = 1;

// Serial: 0, 1. Not on the headers: 23 (supply mode), 24 (USB sense), 25 (LED), 29 (supply voltage).
static const int BOARD_TAKEN[] = {0, 1, 23, 24, 25, 29, 30, -1};
