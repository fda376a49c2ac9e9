"""Commercial sensors: the figures of each, and their sources.

Data only; ``effective_range`` derives the range for a use. Ranges are typical values for a target
that fills the beam.
"""

import math

from . import boards
from .sensor_model import DARK, Figure, Light, Model, Supply, side_of_diagonal

WHITE = 0.88  # reflectance of the manufacturers' white target
_SECOND_HAND = "maker's datasheet as quoted by a third party"


def _by_light(unit: str, *pairs: tuple[float, float], white: float = WHITE) -> tuple[Figure, ...]:
    """Return figures of a bright target from pairs of light (0: dark) and range, m."""
    return tuple(Figure(Light(f"{v:g}{unit}", v) if v else DARK, white, r) for v, r in pairs)


_L1X_BEAM = "27° is across the corners: sides of 27°/√2 = 19.1°"
_L1X = (27 / math.sqrt(2), True, 1)
_ROW = (
    Model(
        "vl53l0x",
        "ST VL53L0X",
        25.0,
        False,
        1,
        (Figure(Light("indoors", 1.0), WHITE, 2.0), Figure(Light("overcast", 2.0), WHITE, 0.8)),
        "",
        0.03,
        50.0,
        f"{_SECOND_HAND}; rate and beam: MathWorks, VL53L0X block of the STM32 blockset",
        "rate 5 to 50 Hz by the timing budget",
        boards.VL53L0X,
    ),
    Model(
        "vl53l1x",
        "ST VL53L1X, long mode",
        *_L1X,
        (
            *_by_light("kcps", (0, 3.6), (50, 1.66), (200, 0.73)),
            Figure(DARK, 0.17, 1.70),
        ),
        "kcps",
        0.04,
        50.0,
        _SECOND_HAND,
        _L1X_BEAM,
        boards.VL53L1X,
    ),
    Model(
        "vl53l1x-medium",
        "ST VL53L1X, medium mode",
        *_L1X,
        _by_light("kcps", (0, 2.9), (200, 0.76)),
        "kcps",
        0.04,
        50.0,
        _SECOND_HAND,
        _L1X_BEAM,
        boards.VL53L1X,
    ),
    Model(
        "vl53l1x-short",
        "ST VL53L1X, short mode",
        *_L1X,
        _by_light("kcps", (0, 1.36), (200, 1.35)),
        "kcps",
        0.04,
        50.0,
        _SECOND_HAND,
        _L1X_BEAM,
        boards.VL53L1X,
    ),
    Model(
        "vl53l4cd",
        "ST VL53L4CD",
        18.0,
        False,
        1,
        _by_light("klx", (0, 1.2)),
        "klx",
        0.001,
        100.0,
        "ST, brief of STSW-IMG026",
        board=boards.VL53L4CD,
    ),
    Model(
        "vl53l5cx",
        "ST VL53L5CX, 8×8 zones",
        45.0,
        True,
        8,
        _by_light("klx", (0, 3.5), (5, 1.1)),
        "klx",
        None,
        15.0,
        _SECOND_HAND,
        "ranges of the inner zones",
        boards.VL53L5CX,
    ),
    Model(
        "vl53l5cx-4x4",
        "ST VL53L5CX, 4×4 zones",
        45.0,
        True,
        4,
        _by_light("klx", (0, 4.0), (5, 1.7)),
        "klx",
        None,
        60.0,
        _SECOND_HAND,
        board=boards.VL53L5CX,
    ),
    Model(
        "vl53l7cx",
        "ST VL53L7CX, 8×8 zones",
        60.0,
        True,
        8,
        _by_light("klx", (0, 2.0), (5, 0.5)),
        "klx",
        None,
        15.0,
        _SECOND_HAND,
        "ranges of the inner zones",
    ),
    Model(
        "vl53l8cx",
        "ST VL53L8CX",
        45.0,
        True,
        4,
        _by_light("klx", (0, 4.0)),
        "klx",
        0.02,
        60.0,
        "ST, UM3109 and DS14161",
        "as 4×4 zones, at which 60 Hz hold",
    ),
    Model(
        "tmf8820",
        "ams-OSRAM TMF8820, 3×3 zones",
        side_of_diagonal(63.0),
        True,
        3,
        _by_light("klx", (0, 5.0)),
        "klx",
        0.01,
        30.0,
        "ams-OSRAM, product pages",
        "63° taken across the corners of a square, the smaller reading",
    ),
    Model(
        "teraranger-one",
        "TeraRanger One",
        3.4,
        False,
        1,
        _by_light("klx", (0, 14.0)),
        "klx",
        0.2,
        None,
        "Terabee, ROS driver",
    ),
    Model(
        "teraranger-evo-60m",
        "TeraRanger Evo 60m",
        2.0,
        False,
        1,
        _by_light("klx", (0, 60.0)),
        "klx",
        0.5,
        None,
        "Terabee, ROS driver",
    ),
    Model(
        "teraranger-evo-3m",
        "TeraRanger Evo 3m",
        2.0,
        False,
        1,
        _by_light("klx", (0, 3.0)),
        "klx",
        0.1,
        None,
        "Terabee, ROS driver",
    ),
    Model(
        "teraranger-evo-mini",
        "TeraRanger Evo Mini, 1 px, long",
        20.0,
        False,
        1,
        _by_light("klx", (0, 3.3)),
        "klx",
        0.03,
        None,
        "Terabee, ROS driver",
    ),
    Model(
        "tfmini",
        "Benewake TFmini",
        2.3,
        False,
        1,
        (*_by_light("klx", (0, 12.0), white=0.9), Figure(DARK, 0.1, 5.0)),
        "klx",
        0.3,
        100.0,
        "Benewake, SJ-GU-TFmini-01 (12 m at 90 %, 5 m at 10 %, indoors)",
    ),
    Model(
        "tfmini-s",
        "Benewake TFmini-S",
        2.0,
        False,
        1,
        _by_light("klx", (0, 12.0), white=0.9),
        "klx",
        0.1,
        100.0,
        "Benewake, datasheet",
    ),
    Model(
        "tfmini-plus",
        "Benewake TFmini Plus",
        3.6,
        False,
        1,
        _by_light("klx", (0, 12.0), white=0.9),
        "klx",
        0.1,
        1000.0,
        "Benewake, datasheet (12 m at 90 %, indoors)",
    ),
)
MODELS = {model.name: model for model in _ROW}


def model(name: str) -> Model:
    """Return the catalogue's sensor ``name``; raise a ``ValueError`` that lists the known names."""
    if name not in MODELS:
        raise ValueError(f"unknown sensor {name!r}; known: {', '.join(MODELS)}")
    return MODELS[name]


SUPPLIES = {  # no price is sourced for any sensor
    "tfmini": Supply(0.6, True, "Benewake, SJ-GU-TFmini-T-01 A02, average power"),
    "tfmini-s": Supply(0.7, True, "Benewake, SJ-GU-TFmini-S-01 A00"),
    "tfmini-plus": Supply(0.55, False, "Benewake, SJ-GU-TFmini-Plus-01 A04"),
    "vl53l8cx": Supply(0.215, False, "ST, DS14161, continuous, as quoted by a third party"),
}
