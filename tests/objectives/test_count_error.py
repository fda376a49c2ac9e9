"""The stated error of a count by voxel centres, where beams are thinner than a voxel."""

import math

import numpy as np
import pytest
from place_rings.coverage.rings.ring import Ring, Setup, named_setup
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.coverage.targets import Target
from place_rings.formats.schema.result_models import VerifyResult
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Goal, paper_scene
from place_rings.objectives.verify import Verifier
from place_rings.reporting.tables import flat_beam_line, flat_beam_points, usual_count_error


@pytest.mark.parametrize(("up_deg", "position"), [(1.0, 0.3), (1.0, 0.5), (8.0, 0.3)])
def test_the_error_of_flat_beams_along_the_lattice_is_stated(up_deg, position):
    """Horizontal fans around an arm that stands upright, against a certified interval."""
    sensor = Sensor(math.radians(45), 1.0, None, math.radians(up_deg), 8)
    upright = Pose(np.radians([0, -90, 0, -90, -90, 0]))
    goal, voxel = Target("V_S", 0.5), 0.01
    scene = paper_scene(sensor=sensor, goals=(Goal(goal),), poses=(upright,))
    setup = Setup(tuple(Ring(x, position, 8, sensor=sensor) for x in ("upper_arm", "forearm")))
    proof = Verifier(scene, None, "certified", 5e-4).verify(setup, goal)
    found = Verifier(scene, voxel).verify(setup, goal)
    error = 100 * (found.zeta - (proof.low + proof.high) / 2)
    record = VerifyResult.of("fans", found, scene)
    stated = flat_beam_points(setup, voxel, found.target_voxels * voxel**3)
    assert abs(error) <= stated + usual_count_error(voxel)  # and that of beams that are not flat
    line = flat_beam_line(setup, voxel, [record])
    assert (line is None) == (stated <= usual_count_error(voxel))
    assert line is None or f"about {stated:.1g} points" in line
    assert line is None or up_deg == 1.0


def test_nothing_is_added_for_beams_such_as_the_papers():
    setup, scene = named_setup("n2_16_25"), paper_scene()
    counted = Verifier(scene, 0.05).verify(setup, scene.goals[0].target)
    assert flat_beam_line(setup, 0.05, [VerifyResult.of("n2_16_25", counted, scene)]) is None
