"""The twin reports small spheres as often as the coverage says."""

import numpy as np
import place_rings as pr
import pytest
from place_rings.formats.ring_status import Status

from ..support.twin_probes import ONE_ZONE, ZONES, drawn, reports


@pytest.mark.parametrize("model", ["paper", "vl53l5cx"])
def test_a_sphere_is_found_exactly_where_a_reading_tells_of_it(model):
    """The quick way of the study beside all rays."""
    sensor = {} if model == "paper" else {"sensor": pr.sensors[model]}
    scene = pr.Scene(targets=[pr.Shell(0.5)], **sensor)
    twin = pr.twin("n1_8_0", scene, bodies=[pr.Sphere(0.03)], mask="scene", noise=None)
    points = scene.sample(scene.targets[0].target, 0, 64, 0)
    quick = [reports(twin, twin.looks, point, 0.03) for point in points]
    told = []
    for point in points:
        twin.put(0, point)
        told.append(bool((twin.step(twin.q, 2 * twin.dt).status == Status.VALID).any()))
    told = [*told[1:], bool((twin.step(twin.q, 2 * twin.dt).status == Status.VALID).any())]
    assert quick == told
    assert 0 < sum(told) < len(told)


@pytest.mark.slow
@pytest.mark.parametrize("models", [ONE_ZONE, ZONES], ids=["one-zone", "zones"])
def test_the_share_of_reported_spheres_agrees_with_the_coverage(models):
    """Each interval holds ζ with 95 %; at least 5 of 6 do with 97 %."""
    shares = [drawn(number, models, 300) for number in range(6)]
    assert sum(share.holds for share in shares) >= 5
    less = [share.reported / share.probes - share.zeta for share in shares]
    assert abs(np.mean(less)) < 0.03
