// The number of a Pico's flash chip, as the Pico SDK gives it.
#pragma once

#include <stdint.h>

#define PICO_UNIQUE_BOARD_ID_SIZE_BYTES 8

typedef struct {
  uint8_t id[PICO_UNIQUE_BOARD_ID_SIZE_BYTES];
} pico_unique_board_id_t;

inline void pico_get_unique_board_id(pico_unique_board_id_t* board) {
  for (uint8_t i = 0; i < PICO_UNIQUE_BOARD_ID_SIZE_BYTES; i++) board->id[i] = uint8_t(0xE6 + i);
}
