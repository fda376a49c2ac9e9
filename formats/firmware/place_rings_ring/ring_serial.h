// Serial number of the board, which a ring says in its hello. Its digits are those of the board's USB serial number, where USB is
// the board's own: the MAC address of an ESP32, the flash's number of an RP2040.
#pragma once

#include <stdint.h>

#if defined(ARDUINO_ARCH_RP2040)
#include <pico/unique_id.h>
#endif

inline uint64_t board_serial() {
  uint64_t serial = 0;
#if defined(ARDUINO_ARCH_ESP32)
  const uint64_t mac = ESP.getEfuseMac();  // its first byte is the lowest
  for (int i = 0; i < 6; i++) serial = serial << 8 | uint8_t(mac >> 8 * i);
#elif defined(ARDUINO_ARCH_RP2040)
  pico_unique_board_id_t id;
  pico_get_unique_board_id(&id);
  for (int i = 0; i < PICO_UNIQUE_BOARD_ID_SIZE_BYTES; i++) serial = serial << 8 | id.id[i];
#endif
  return serial;  // 0: none
}
