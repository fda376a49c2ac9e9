"""Sensors that the firmware can read: their Arduino libraries, and the boards that carry them."""

import math
from dataclasses import dataclass

from ..sensors.catalogue import MODELS
from ..sensors.effective_range import model_of
from ..sensors.sensor import Sensor
from ..sensors.sensor_model import Supply
from .bus_load import SUPPLY


@dataclass(frozen=True)
class Carrier:
    """Electrical facts of a board that carries a sensor, at its plugs."""

    title: str
    """Name in text."""
    pull_up: float
    """Pull-up of each bus line to the supply, Ω."""
    sensor_pull_up: float
    """Pull-up of each line behind the level shifter, to ``sensor_supply``, Ω."""
    sensor_supply: float
    """Supply behind the level shifter, V."""
    load_pf: float
    """Load on each bus line, pF."""
    peak_ma: float
    """Peak supply current, mA."""
    source: str
    """Sources of the facts."""


@dataclass(frozen=True)
class Driver:
    """A way to read a kind of sensor."""

    name: str
    """Name; its header is ``sensor_NAME.h``."""
    title: str
    """Name of the sensor in text."""
    library: str
    """Arduino library, as the library manager lists it."""
    models: tuple[str, ...]
    """Sensors of the catalogue that it reads."""
    carrier: Carrier
    """Board that carries the sensor."""
    bytes_each: int
    """Bytes on the bus for one reading, with addresses and the polls of one period: an estimate."""
    bytes_zone: int = 0
    """Bytes in addition for each zone; 0: a sensor of one zone."""
    enable: str = "XSHUT"
    """Name of the pin that takes the sensor off the bus."""
    shortest_ms: int = 0
    """Shortest period of readings that the sketch can set, ms; 0: that of the model."""
    firmware_bytes: int | None = None
    """Bytes of firmware that each sensor receives at start-up; None: not known."""
    firmware_source: str = ""
    """Source of that number."""
    ram: int = 500
    """Memory of the controller for each sensor, bytes: an estimate."""

    def bytes_of(self, sensor: Sensor) -> int:
        """Return the bytes on the bus for one reading of all zones."""
        return self.bytes_each + self.bytes_zone * sensor.zones**2

    def shortest_s(self, sensor: Sensor) -> float:
        """Return the shortest period of readings at which the sketch runs the sensor, s."""
        return max(1 / (MODELS[model_name(sensor)].rate_hz or math.inf), self.shortest_ms / 1000)

    def most_hz(self, sensor: Sensor) -> int:
        """Return the highest whole rate of readings at which the sketch runs the sensor, Hz."""
        return int(1 / self.shortest_s(sensor) + 1e-9)


_ADAFRUIT = Carrier(
    title="Adafruit breakout, STEMMA QT",
    pull_up=10_000.0,
    sensor_pull_up=10_000.0,
    sensor_supply=2.8,
    load_pf=20.0,
    peak_ma=40.0,
    source="schematics of the boards: 10 kΩ on both sides of a level shifter (BSS138), regulator to"
    " 2.8 V, a diode at XSHUT; load: 13 pF of the transistor, plugs and traces, an estimate; peak"
    " current: ST, VL53L1X, as quoted by a third party",
)

_SPARKFUN = Carrier(
    title="SparkFun breakout, Qwiic",
    pull_up=2_200.0,
    sensor_pull_up=math.inf,
    sensor_supply=3.3,
    load_pf=20.0,
    peak_ma=130.0,
    source="not verified: 2.2 kΩ without a level shifter, and 130 mA; measure yours",
)

_ROW = (
    Driver(
        name="vl53l1x",
        title="VL53L1X",
        library="VL53L1X by Pololu",
        models=("vl53l1x", "vl53l1x-medium", "vl53l1x-short"),
        carrier=_ADAFRUIT,
        bytes_each=60,
        shortest_ms=38,
    ),
    Driver(
        name="vl53l0x",
        title="VL53L0X",
        library="VL53L0X by Pololu",
        models=("vl53l0x",),
        carrier=_ADAFRUIT,
        bytes_each=50,
        shortest_ms=30,
    ),
    Driver(
        name="vl53l4cd",
        title="VL53L4CD",
        library="STM32duino VL53L4CD by STMicroelectronics",
        models=("vl53l4cd",),
        carrier=_ADAFRUIT,
        bytes_each=80,
        shortest_ms=15,
    ),
    Driver(
        name="vl53l5cx",
        title="VL53L5CX",
        library="SparkFun VL53L5CX Arduino Library",
        models=("vl53l5cx", "vl53l5cx-4x4"),
        carrier=_SPARKFUN,
        bytes_each=240,
        bytes_zone=20,
        enable="LPn",
        firmware_bytes=86_000,
        firmware_source="SparkFun, hookup guide of the VL53L5CX, example 2",
        ram=5000,
    ),
)
DRIVERS = {one.name: one for one in _ROW}
MODES = {"vl53l1x": "Long", "vl53l1x-medium": "Medium", "vl53l1x-short": "Short"}
"""Distance mode of a VL53L1X by the name of its model."""
ASSUMED = "vl53l1x"
"""Model that is assumed of a sensor that names none, such as the paper's."""


def model_name(sensor: Sensor) -> str:
    """Return the name of a sensor's model, or of the one that is assumed."""
    return ASSUMED if sensor.use is None else model_of(sensor.use).name


def supply_of(sensor: Sensor) -> Supply | None:
    """Return the power of a sensor by its model, or at most that of the board that carries it; None
    if neither is known."""
    if sensor.use is None:
        return None
    try:
        stated, carrier = model_of(sensor.use).supply, driver(sensor).carrier
    except ValueError:
        return model_of(sensor.use).supply
    watts = SUPPLY * carrier.peak_ma / 1000
    source = f"peak of the {carrier.title}; {carrier.source}"
    return stated or Supply(power_w=watts, limit=True, source=source)


def driver(sensor: Sensor) -> Driver:
    """Return the driver of a sensor.

    Raises:
        ValueError: if none reads it; the message lists the sensors that one reads.
    """
    name = model_name(sensor)
    own = sensor.use is not None and not isinstance(sensor.use.model, str)
    for one in _ROW:
        if name in one.models and not own:
            return one
    known = ", ".join(model for one in _ROW for model in one.models)
    raise ValueError(f"no firmware reads the sensor {name}; there is one for {known}")
