"""Coverage of dark clothing: the same count with each sensor's range on a target of 17 %."""

from dataclasses import replace

import place_rings as pr
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.sensors.catalogue import MODELS, model
from place_rings.coverage.sensors.effective_range import Use
from place_rings.coverage.sensors.sensor import effective
from place_rings.objectives.dark_clothing import REFLECTANCE
from place_rings.objectives.verify_breakdown import PARTS

VOXEL = 0.08
CAMERA = pr.MountedSensor("base", (0.4, 0.9, 1.2), (0.0, -0.7, -1.0), pr.Sensor(1.0, 2.0))
LIGHTS = [(name, light) for name in sorted(MODELS) for light in model(name).levels]


def laid_out(sensor, cell=()):
    scene = pr.Scene("ur5e", targets=pr.Shell(0.5), sensor=sensor, cell_sensors=cell)
    return pr.Setup((scene.ring("forearm", 0.4, 8, tilt=0.4),)), scene


@settings(max_examples=4)
@given(st.sampled_from(LIGHTS), st.none() | st.floats(0.02, 1.0), st.booleans())
def test_it_is_the_count_of_the_same_layout_with_the_range_on_a_dark_target(light, rho, camera):
    use = Use(light[0], light[1], rho)
    dark = replace(use, reflectance=min(REFLECTANCE, rho or 1.0))
    cell = (CAMERA,) * camera
    here, there = (
        pr.verify(*laid_out(effective(one).sensor, cell), voxel=VOXEL) for one in (use, dark)
    )
    assert here.dark_clothing == there.coverage <= here.coverage
    assert here.records[0].dark_clothing == pytest.approx(there.coverage)


def test_there_is_none_without_figures_of_a_sensor_and_for_an_interval():
    known = pr.sensors["vl53l5cx"]
    setup, scene = laid_out(known)
    mixed = replace(setup, singles=(pr.MountedSensor("tcp", (0.0, 0.0, 0.1), (0.0, 0.0, 1.0)),))
    assert pr.verify(mixed, scene, voxel=VOXEL).dark_clothing is None
    assert pr.verify(*laid_out(pr.Sensor()), voxel=VOXEL).dark_clothing is None
    assert pr.certify(setup, scene, width=30).dark_clothing is None


def test_a_search_states_dark_clothing_and_what_the_cell_covers_alone():
    _, scene = laid_out(pr.sensors["vl53l5cx-4x4"], CAMERA)
    found = pr.search(scene, sensors=4, time=0.2, voxel=VOXEL)
    again = pr.verify(found.setup, scene, voxel=VOXEL)
    record = next(r for r in found.compare() if r.setup == "proposal")
    assert found.dark_clothing == again.dark_clothing
    assert record.dark_clothing == pytest.approx(again.dark_clothing)
    camera = pr.verify(pr.Setup((), (CAMERA,)), scene.replace(cell_sensors=None), voxel=VOXEL)
    alone = pytest.approx(camera.coverage)
    assert found.by_part[PARTS[2]] == alone
    assert record.by_part[PARTS[2]] == alone
