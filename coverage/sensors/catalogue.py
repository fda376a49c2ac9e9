"""Commercial sensors: the figures of each, and their sources.

Data only; ``effective_range`` derives the range for a use. Ranges are typical values for a target
that fills the beam. An entry is a sensor in one mode: range, least range, zones and rate belong
together. A figure that no source states is absent.
"""

from dataclasses import replace

from . import boards
from .sensor_model import DARK, Model, Range, Supply

WHITE = 0.88  # reflectance of the manufacturers' white target
_SECOND_HAND = "maker's datasheet as quoted by a third party"


def _by_light(unit: str, *pairs: tuple[float, float], white: float = WHITE) -> tuple[Range, ...]:
    """Return ranges of a bright target from pairs of light (0: dark) and range, m."""
    return tuple(
        Range(ambient=f"{v:g}{unit}" if v else DARK, reflectance=white, range_m=r) for v, r in pairs
    )


_L1X = Model(
    name="vl53l1x",
    title="ST VL53L1X, long mode",
    ranges=(
        *_by_light("kcps", (0, 3.6), (50, 1.66), (200, 0.73)),
        Range(reflectance=0.17, range_m=1.70),
    ),
    source=f"{_SECOND_HAND}; beam: 27° full angle; wavelength: ST, DocID031281, features",
    diagonal_deg=27.0,
    corners="sines",
    least_m=0.04,
    rate_hz=50.0,
    below_least="wrong",
    detection_source="ST, user manual of the STEVAL-BCN002V1, as hosted by a third party: nearer"
    " than 40 mm a target is detected, but its distance is not accurate",
    wavelength_nm=940.0,
    life_cycle="in full production (ST, DocID031281 of 2018)",
    note="27° is taken across the corners",
    board=boards.VL53L1X,
)
_L5CX = Model(
    name="vl53l5cx",
    title="ST VL53L5CX, 8×8 zones",
    ranges=_by_light("klx", (0, 3.5), (5, 1.1)),
    source=f"{_SECOND_HAND}; targets: ST's user manual as quoted by a third party",
    fov_deg=45.0,
    fov_up_deg=45.0,
    diagonal_deg=65.0,
    corners="sines",
    zones=8,
    rate_hz=15.0,
    targets=4,
    separation_m=0.6,
    life_cycle="supplied until July 2028 (ST's commitment, as quoted by a third party)",
    note="ranges of the inner zones",
    board=boards.VL53L5CX,
)
_L7CX = Model(
    name="vl53l7cx",
    title="ST VL53L7CX, 8×8 zones",
    ranges=_by_light("klx", (0, 2.0), (5, 0.5)),
    source=_SECOND_HAND,
    fov_deg=60.0,
    fov_up_deg=60.0,
    diagonal_deg=90.0,
    corners="sines",
    zones=8,
    rate_hz=15.0,
    note="ranges of the inner zones",
)
_L8CX = Model(
    name="vl53l8cx",
    title="ST VL53L8CX, 4×4 zones",
    ranges=_by_light("klx", (0, 4.0)),
    source="ST, UM3109 and DS14161; least range and power of DS14161 as quoted by a third party",
    fov_deg=45.0,
    fov_up_deg=45.0,
    diagonal_deg=65.0,
    corners="sines",
    zones=4,
    least_m=0.02,
    rate_hz=60.0,
    targets=4,
    separation_m=0.6,
    life_cycle="active (datasheet of July 2025)",
    note="no range in light is quoted",
    supply=Supply(power_w=0.215, source="ST, DS14161, continuous, as quoted by a third party"),
)
_L9CX = Model(
    name="vl53l9cx-precision",
    title="ST VL53L9CX, precision mode",
    ranges=_by_light("klx", (0, 8.8)),
    source="ST, AN6522 and DS14879 revisions 6 and 7, as quoted by third parties",
    fov_deg=55.0,
    fov_up_deg=42.0,
    diagonal_deg=71.0,
    corners="sines",
    zones=54,
    zones_up=42,
    least_m=0.05,
    rate_hz=100.0,
    life_cycle="mass production announced for July 2026",
    note="light is not stated; 100 Hz at full resolution only through MIPI",
)
_TMF882 = Model(
    name="tmf8820",
    title="ams-OSRAM TMF8820, 3×3 zones",
    ranges=_by_light("klx", (0, 5.0)),
    source="ams-OSRAM, product pages; histogram: a distributor's page",
    diagonal_deg=63.0,
    zones=3,
    least_m=0.01,
    rate_hz=30.0,
    histogram=True,
    note="63° taken across the corners, the smaller reading",
)
_TERARANGER = Model(
    name="teraranger-one",
    title="TeraRanger One",
    ranges=_by_light("klx", (0, 14.0)),
    source="Terabee, ROS driver",
    fov_deg=3.4,
    least_m=0.2,
    life_cycle="legacy: whether it is still made is not confirmed",
)
_ROW = (
    Model(
        name="vl53l0x",
        title="ST VL53L0X",
        ranges=(
            Range(ambient="indoors", range_m=2.0),
            Range(ambient="overcast", range_m=0.8),
        ),
        source=f"{_SECOND_HAND}; rate and beam: MathWorks, VL53L0X block of the STM32 blockset;"
        " wavelength: ST, DocID029104, features",
        wavelength_nm=940.0,
        fov_deg=25.0,
        least_m=0.03,
        rate_hz=50.0,
        note="rate 5 to 50 Hz by the timing budget",
        board=boards.VL53L0X,
    ),
    _L1X,
    replace(
        _L1X,
        name="vl53l1x-medium",
        title="ST VL53L1X, medium mode",
        ranges=_by_light("kcps", (0, 2.9), (200, 0.76)),
    ),
    replace(
        _L1X,
        name="vl53l1x-short",
        title="ST VL53L1X, short mode",
        ranges=_by_light("kcps", (0, 1.36), (200, 1.35)),
    ),
    Model(
        name="vl53l3cx",
        title="ST VL53L3CX",
        ranges=_by_light("klx", (0, 3.0)),
        source="ST, datasheet of the VL53L3CX, features; targets: ST, user manual of its driver",
        wavelength_nm=940.0,
        fov_deg=25.0,
        below_least="reported",
        detection_source="ST, driver of the VL53L3CX, as quoted by a third party: a range status of"
        " its own marks targets nearer than the least distance",
        targets=4,
        note="targets: the driver's default; a status marks targets below the least range, which is"
        " not stated",
    ),
    Model(
        name="vl53l4cd",
        title="ST VL53L4CD",
        ranges=_by_light("klx", (0, 1.2)),
        source="ST, brief of STSW-IMG026",
        fov_deg=18.0,
        least_m=0.001,
        rate_hz=100.0,
        board=boards.VL53L4CD,
    ),
    Model(
        name="vl53l4cx",
        title="ST VL53L4CX",
        ranges=_by_light("klx", (0, 6.0)),
        source="ST, brief of STSW-IMG029; histogram: ST, community forum; targets: ST, constant"
        " VL53LX_MAX_RANGE_RESULTS of its driver",
        fov_deg=18.0,
        targets=4,
        separation_m=0.8,
        histogram=True,
        note="separation: beyond 80 cm ST states immunity to the return of a cover glass, so that"
        " nearer returns merge with it; the driver computes distances from the histogram",
    ),
    _L5CX,
    replace(
        _L5CX,
        name="vl53l5cx-4x4",
        title="ST VL53L5CX, 4×4 zones",
        ranges=_by_light("klx", (0, 4.0), (5, 1.7)),
        zones=4,
        rate_hz=60.0,
        note="",
    ),
    _L7CX,
    replace(
        _L7CX,
        name="vl53l7cx-4x4",
        title="ST VL53L7CX, 4×4 zones",
        ranges=_by_light("klx", (0, 3.5)),
        source="ST, brief of STSW-IMG036",
        zones=4,
        rate_hz=60.0,
        note="the range is the largest that is stated for any mode",
    ),
    _L8CX,
    replace(
        _L8CX,
        name="vl53l8cx-8x8",
        title="ST VL53L8CX, 8×8 zones",
        zones=8,
        rate_hz=15.0,
        note="4 m is stated for each zone of both modes; no range in light is quoted",
    ),
    _L9CX,
    replace(
        _L9CX,
        name="vl53l9cx-ambient",
        title="ST VL53L9CX, ambient mode",
        ranges=_by_light("klx", (0, 8.5)),
        least_m=0.45,
    ),
    _TMF882,
    replace(
        _TMF882,
        name="tmf8821",
        title="ams-OSRAM TMF8821, 4×4 zones",
        source="ams-OSRAM, DS000693, as quoted by distributors",
        zones=4,
        rate_hz=None,
        life_cycle="active (a distributor's page)",
    ),
    replace(
        _TMF882,
        name="tmf8828",
        title="ams-OSRAM TMF8828, 8×8 zones",
        source="ams-OSRAM, DS000693, as quoted by distributors",
        zones=8,
        rate_hz=None,
        note="63° taken across the corners, the smaller reading; 8×8 zones are four measurements of"
        " 4×4 one after the other, so the rate is at most a quarter of theirs",
    ),
    Model(
        name="afbr-s50mv85g",
        title="Broadcom AFBR-S50MV85G",
        ranges=_by_light("klx", (0, 10.0)),
        source="Broadcom, datasheet, and a distributor's parameters",
        fov_deg=4.0,
        fov_up_deg=4.0,
        rate_hz=3000.0,
        note="the 4° by 4° that its transmitter lights up, as one zone; its 32 pixels view 12.4° by"
        " 6.2°; target and light of the 10 m are not stated",
    ),
    Model(
        name="safevisionary2",
        title="SICK safeVisionary2",
        ranges=_by_light("klx", (0, 2.0)),
        source="SICK, operating instructions 8025919, tables 4 and 5",
        fov_deg=68.0,
        fov_up_deg=42.0,
        safety="PL c (ISO 13849-1), SIL 1 (IEC 61508)",
        note="protective field, 4 m with increased scanning range; the number of pixels is not"
        " stated there, so it counts as one zone",
    ),
    _TERARANGER,
    replace(
        _TERARANGER,
        name="teraranger-evo-60m",
        title="TeraRanger Evo 60m",
        ranges=_by_light("klx", (0, 60.0)),
        fov_deg=2.0,
        least_m=0.5,
    ),
    replace(
        _TERARANGER,
        name="teraranger-evo-3m",
        title="TeraRanger Evo 3m",
        ranges=_by_light("klx", (0, 3.0)),
        fov_deg=2.0,
        least_m=0.1,
    ),
    replace(
        _TERARANGER,
        name="teraranger-evo-mini",
        title="TeraRanger Evo Mini, 1 px, long",
        ranges=_by_light("klx", (0, 3.3)),
        fov_deg=20.0,
        least_m=0.03,
    ),
    Model(
        name="tfmini",
        title="Benewake TFmini",
        ranges=(*_by_light("klx", (0, 12.0), white=0.9), Range(reflectance=0.1, range_m=5.0)),
        source="Benewake, SJ-GU-TFmini-01 (12 m at 90 %, 5 m at 10 %, indoors)",
        fov_deg=2.3,
        least_m=0.3,
        rate_hz=100.0,
        supply=Supply(
            power_w=0.6, limit=True, source="Benewake, SJ-GU-TFmini-T-01 A02, average power"
        ),
    ),
    Model(
        name="tfmini-s",
        title="Benewake TFmini-S",
        ranges=_by_light("klx", (0, 12.0), white=0.9),
        source="Benewake, datasheet",
        fov_deg=2.0,
        least_m=0.1,
        rate_hz=100.0,
        supply=Supply(power_w=0.7, limit=True, source="Benewake, SJ-GU-TFmini-S-01 A00"),
    ),
    Model(
        name="tfmini-plus",
        title="Benewake TFmini Plus",
        ranges=_by_light("klx", (0, 12.0), white=0.9),
        source="Benewake, datasheet (12 m at 90 %, indoors)",
        fov_deg=3.6,
        least_m=0.1,
        rate_hz=1000.0,
        supply=Supply(power_w=0.55, source="Benewake, SJ-GU-TFmini-Plus-01 A04"),
    ),
)
MODELS = {model.name: model for model in _ROW}


def model(name: str) -> Model:
    """Return the catalogue's sensor ``name``; raise a ``ValueError`` that lists the known names."""
    if name not in MODELS:
        raise ValueError(f"unknown sensor {name!r}; known: {', '.join(MODELS)}")
    return MODELS[name]
