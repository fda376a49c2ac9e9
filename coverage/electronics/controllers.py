"""Boards that read a ring: their headers, the pins for I2C and XSHUT, and the pins that are taken.

Facts only, from the boards' own documents: SDA, SCL, TX and RX from the ``pins_arduino.h`` of their
Arduino cores; headers and exclusions from the makers' user guides and datasheets.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

USB_MA = 500  # of a USB 2.0 port
_FLASH = "wired to the flash chip"
_UART = "the serial line to the USB bridge"
_USB = "USB data"
_JTAG = "JTAG, for a debugger"


@dataclass(frozen=True)
class ControllerBoard:
    """A controller board."""

    name: str
    """Name in options."""
    title: str
    """Name in text."""
    core: str
    """Arduino core and board, as the Arduino tools name them."""
    guard: str
    """Condition of the preprocessor that holds for this chip only, as its core defines it."""
    prefix: str
    """Text before a pin's number on the board."""
    sda: int
    """Pin of ``Wire``'s data line, as the core has it."""
    scl: int
    """Pin of ``Wire``'s clock line, as the core has it."""
    lines: tuple[int, ...]
    """Free pins for XSHUT and reset lines, in the order of use."""
    excluded: Mapping[int, str]
    """Pins that must stay free, each with the reason."""
    left: tuple[int | str, ...]
    """Left header from the end without USB to the USB socket: pin numbers and names of supplies."""
    right: tuple[int | str, ...]
    """Right header, likewise."""
    supply: str
    """Name of the 3.3 V pin on the header."""
    supply_ma: int
    """Current that the 3.3 V pin can give to sensors, mA."""
    own_ma: int
    """Current that the board draws itself, without radio, mA: an estimate."""
    ram: int
    """Memory for variables, bytes, as its core states it (``maximum_data_size``)."""
    port: str
    """Socket that carries the frames."""
    source: str
    """Sources of the facts."""

    @property
    def spare_ma(self) -> int:
        """Current for sensors at the 3.3 V pin while the board is fed by a USB 2.0 port, mA."""
        return min(self.supply_ma, USB_MA - self.own_ma)

    def label(self, pin: int) -> str:
        """Return the name of a pin as the board has it."""
        return f"{self.prefix}{pin}"


def _header(pins: str) -> tuple[int | str, ...]:
    """Return a header from the words of its pins."""
    return tuple(int(pin) if pin.isdecimal() else pin for pin in pins.split())


_S3_TAKEN = (
    dict.fromkeys((0, 3, 45, 46), "strapping pin: its level at reset selects the boot mode")
    | dict.fromkeys((19, 20), _USB)
    | dict.fromkeys(range(26, 33), _FLASH)
    | dict.fromkeys((33, 34, 35, 36, 37), "wired to the octal flash or PSRAM of some modules")
    | dict.fromkeys((38, 48), "the RGB LED (38 on boards v1.1, 48 on v1.0)")
    | dict.fromkeys((39, 40, 41, 42), _JTAG)
    | {43: _UART, 44: _UART, 47: "at 1.8 V on modules with octal flash"}
)
_ESP32_TAKEN = (
    dict.fromkeys((0, 2, 5), "strapping pin: its level at reset selects the boot mode")
    | {1: _UART, 3: _UART}
    | dict.fromkeys(range(6, 12), _FLASH)
    | {12: "strapping pin: its level at reset selects the flash's voltage"}
    | {13: _JTAG, 14: _JTAG, 15: "strapping pin, and JTAG"}
    | dict.fromkeys(range(34, 40), "input only, without a pull-up")
)
_PICO_TAKEN = {
    0: "the default serial line UART0",
    1: "the default serial line UART0",
    23: "mode of the supply on the board",
    24: "sense of USB power",
    25: "the LED",
    29: "measures the supply voltage",
}

_ROW = (
    ControllerBoard(
        name="esp32-s3-devkitc-1",
        title="ESP32-S3-DevKitC-1",
        core="esp32:esp32:esp32s3 (arduino-esp32), USB CDC On Boot: Disabled",
        guard="CONFIG_IDF_TARGET_ESP32S3",
        prefix="GPIO",
        sda=8,
        scl=9,
        lines=(4, 5, 6, 7, 15, 16, 17, 18, 10, 11, 12, 13, 14, 1, 2, 21),
        excluded=_S3_TAKEN,
        left=_header("3V3 3V3 RST 4 5 6 7 15 16 17 18 8 3 46 9 10 11 12 13 14 5V GND"),
        right=_header("GND 43 44 1 2 42 41 40 39 38 37 36 35 0 45 48 47 21 20 19 GND GND"),
        supply="3V3",
        supply_ma=500,
        own_ma=100,
        ram=327680,
        port="the socket marked UART",
        source="arduino-esp32, variants/esp32s3; Espressif, user guide of the ESP32-S3-DevKitC-1"
        " v1.1; what the regulator has left: an estimate",
    ),
    ControllerBoard(
        name="esp32-devkit",
        title="ESP32-DevKitC (ESP32-WROOM-32)",
        core="esp32:esp32:esp32 (arduino-esp32)",
        guard="CONFIG_IDF_TARGET_ESP32",
        prefix="IO",
        sda=21,
        scl=22,
        lines=(32, 33, 25, 26, 27, 23, 19, 18, 4, 16, 17),
        excluded=_ESP32_TAKEN,
        left=_header("3V3 EN 36 39 34 35 32 33 25 26 27 14 12 GND 13 9 10 11 5V"),
        right=_header("GND 23 22 1 3 21 GND 19 18 5 17 16 4 0 2 15 8 7 6"),
        supply="3V3",
        supply_ma=500,
        own_ma=100,
        ram=327680,
        port="its only USB socket",
        source="arduino-esp32, variants/esp32; Espressif, guide of the ESP32-DevKitC V4 and page"
        " on GPIO of the ESP32; what the regulator has left: an estimate",
    ),
    ControllerBoard(
        name="pico",
        title="Raspberry Pi Pico",
        core="rp2040:rp2040:rpipico (arduino-pico by Earle Philhower)",
        guard="defined(ARDUINO_ARCH_RP2040) && !defined(ARDUINO_ARCH_MBED)",
        prefix="GP",
        sda=4,
        scl=5,
        lines=(2, 3, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 26, 27, 28),
        excluded=_PICO_TAKEN,
        left=_header("16 17 GND 18 19 20 21 GND 22 RUN 26 27 GND 28 VREF 3V3 3V3_EN GND VSYS VBUS"),
        right=_header("15 14 GND 13 12 11 10 GND 9 8 7 6 GND 5 4 3 2 GND 1 0"),
        supply="3V3",
        supply_ma=300,
        own_ma=50,
        ram=262144,
        port="its only USB socket",
        source="arduino-pico, variants/rpipico; Raspberry Pi, Pico datasheet: pinout, and at most"
        " 300 mA from its 3V3 pin",
    ),
)
CONTROLLERS = {one.name: one for one in _ROW}
ControllerName = Literal["esp32-s3-devkitc-1", "esp32-devkit", "pico"]
DEFAULT_CONTROLLER: ControllerName = "esp32-s3-devkitc-1"
