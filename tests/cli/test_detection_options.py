"""The options of detection as one question, and what they refuse."""

import pytest
from place_rings.cli.options.detection import NO_DETECTION, DetectionOptions
from place_rings.cli.options.groups import SensorOptions
from place_rings.coverage.detection.detection import Detection

from tests.support.refusals import refused

BAD = {
    DetectionOptions("sleeve"): '--detect "sleeve" hand',
    DetectionOptions("rod-0"): '--detect "rod-0" rod-DIAMETER',
    DetectionOptions("0x1"): '--detect "0x1" WIDTHxHEIGHT',
    DetectionOptions("9" * 400 + "x1"): "--detect",
    DetectionOptions(detected_by=2): "--detected-by 2 --detect",
    DetectionOptions("hand:0"): "--detect 0",
    DetectionOptions("hand:nan"): "--detect nan",
    DetectionOptions("hand:"): "--detect SECONDS",
    DetectionOptions("hand", detected_by=0): "--detected-by 0",
    DetectionOptions("hand", crosstalk=1.5): "--crosstalk 1.5",
}


@pytest.mark.parametrize(("options", "parts"), BAD.items(), ids=range(len(BAD)))
def test_a_bad_option_is_one_line(options, parts):
    with refused(parts):
        options.resolve()


def test_options_state_one_question_with_the_light_and_reflectance_of_the_sensor():
    assert NO_DETECTION.resolve() is None
    options = DetectionOptions("rod-55:0.5", detected_by=2, crosstalk=0.01)
    sensing = SensorOptions(ambient="5klx", reflectance=0.018)
    assert options.resolve(sensing) == Detection("rod-55", "5klx", 0.5, 2, 0.018, 0.01)
    with refused("--target-size 0.1x0.2 --detect"):
        options.resolve(SensorOptions(target_size="0.1x0.2"))
