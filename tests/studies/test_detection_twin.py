"""The twin of the study of detection against closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.detection.detection import Detection, reach
from place_rings.coverage.detection.pieces import PIECES
from place_rings.coverage.sensors.effective_range import Use
from place_rings.coverage.sensors.sensor import Sensor, effective
from place_rings.simulation.twin.light_rays import ROUND, rays_of
from place_rings.simulation.twin.world import TwinBody
from place_rings.studies.detection.trials import piece_body, trial
from place_rings.studies.detection.twin import Twin
from place_rings.studies.engine.scenes import scene_from, setup_from
from scipy.stats import norm

L1X = effective(Use("vl53l1x")).sensor
L5CX = effective(Use("vl53l5cx")).sensor
few = settings(max_examples=5, deadline=None)


def one_sensor(sensor, bodies, occlusion="ignore", piece="hand", link="tool", **keys):
    """A twin of a UR10 with one sensor on a link."""
    scene = scene_from({"occlusion": occlusion}).replace(sensor=sensor)
    setup = setup_from([{"link": link, "count": 1, **keys}], scene)
    return Twin(scene, setup, Detection(PIECES[piece]), bodies)


def at(twin, depth, across=0.0, up=0.0):
    """A place in the frame of the twin's only sensor."""
    eye = twin.eyes[0]
    return eye.apex + eye.frame @ np.array([across, up, depth])


def shown(twin, centre):
    """The light that returns from the first body, level with the sensor, at a place."""
    twin.world.put(0, centre, twin.eyes[0].frame)
    twin.world.place()
    return twin.light(0)


@pytest.mark.parametrize("sensor", [Sensor(), L1X, L5CX], ids=["round", "square", "zones"])
def test_zones_have_equally_many_rays_within_the_beam(sensor):
    rays = rays_of(sensor, sensor.zones, np.random.default_rng(0))
    x, y = (rays.direction[:, i] / rays.direction[:, 2] for i in (0, 1))
    np.testing.assert_allclose(np.linalg.norm(rays.direction, axis=1), 1)
    assert rays.zones == sensor.zones**2
    assert len(set(np.bincount(rays.zone, minlength=rays.zones))) == 1
    edge = math.tan(sensor.fov / 2)
    if sensor.square:
        column = np.floor((x / edge + 1) / 2 * sensor.zones)
        row = np.floor((y / math.tan(sensor.fov_up / 2) + 1) / 2 * sensor.zones)
        np.testing.assert_array_equal(rays.zone, row * sensor.zones + column)
    else:
        inside = (np.hypot(x, y) <= edge / 2).mean()
        assert (len(x), inside) == (ROUND, pytest.approx(0.25, abs=0.01))


@pytest.mark.parametrize("sensor", [Sensor(), L1X, L5CX], ids=["round", "square", "zones"])
@few
@given(depth=st.floats(0.1, 2.0))
def test_a_wall_returns_light_by_the_inverse_square(sensor, depth):
    """The mean of cos² over a zone is within a per cent of that in its middle."""
    twin = one_sensor(sensor, [TwinBody("box", (5.0, 5.0, 1e-4))])
    light, rays = shown(twin, at(twin, depth)), twin.eyes[0].rays
    cosine = np.bincount(rays.zone, rays.direction[:, 2]) / np.bincount(rays.zone)
    wanted = (reach(sensor, twin.detection) * cosine / (depth - 1e-4)) ** 2
    np.testing.assert_allclose(light, wanted, rtol=1e-2)


@few
@given(width=st.floats(0.02, 0.2), across=st.floats(-0.1, 0.1), depth=st.floats(0.3, 1.0))
def test_a_strip_fills_its_share_of_a_square_beam(width, across, depth):
    twin = one_sensor(L1X, [TwinBody("box", (width / 2, 5.0, 1e-4))])
    edge = depth * math.tan(L1X.fov / 2)
    inside = max(min(across + width / 2, edge) - max(across - width / 2, -edge), 0) / (2 * edge)
    wanted = inside * (reach(L1X, twin.detection) / depth) ** 2
    whole = (reach(L1X, twin.detection) / depth) ** 2
    assert shown(twin, at(twin, depth, across)).item() == pytest.approx(wanted, abs=0.03 * whole)


def test_a_disc_fills_its_share_of_a_round_beam():
    """At the quarter of the beam's section."""
    depth, sensor = 0.6, Sensor()
    radius = depth * math.tan(sensor.fov / 2) / 2
    twin = one_sensor(sensor, [TwinBody("cylinder", (radius, 1e-4))])
    wanted = 0.25 * (reach(sensor, twin.detection) / depth) ** 2
    assert shown(twin, at(twin, depth)).item() == pytest.approx(wanted, rel=0.02)


@pytest.mark.parametrize("occlusion", ["ignore", "shadow", "blind"])
def test_the_own_arm_hides_what_is_behind_it(occlusion):
    """A sensor on the upper arm that looks along it past the elbow."""
    twin = one_sensor(
        Sensor(), [TwinBody("box", (5, 5, 1e-4))], occlusion, link="upper_arm", position=0.3,
        tilt_deg=75.0, radius=0.12,
    )  # fmt: skip
    whole = (reach(Sensor(), twin.detection) / 1.2) ** 2
    share = shown(twin, at(twin, 1.2)).item() / whole
    blocked = twin.eyes[0].blocked
    hidden = (blocked < 1.2).mean()
    if occlusion == "ignore":
        assert np.isinf(blocked).all()
        assert share > 0.9
    elif occlusion == "shadow":
        assert 0.02 < hidden < 1
        cosine = twin.eyes[0].rays.direction[:, 2]
        wanted = np.where(blocked * cosine < 1.2, 0.0, cosine**2).mean()
        assert share == pytest.approx(wanted, abs=0.002)
    else:
        assert len(set(blocked)) == 1
        assert share == 0


def test_reports_come_as_often_as_the_noise_makes_them():
    """The plate of a target at the range is reported at the stated rate."""
    twin = one_sensor(L1X, [TwinBody("box", (5.0, 5.0, 1e-4))])
    frames = int(twin._needs.frames[0])
    lights = [(0, np.array([0.7]))]
    each = [twin.seen(lights) for _ in range(3000)]
    signal = 0.7 * (4.0 + twin._quantile[0])
    p = norm.cdf(4.0) - norm.cdf(4.0 - signal)
    wanted = 1 - (1 - p) ** frames
    assert each[0].best == each[0].any == pytest.approx(wanted)
    assert np.mean([s.noticed for s in each]) == pytest.approx(wanted, abs=0.03)


def test_two_of_two_sensors_must_see_where_two_are_needed():
    twin = one_sensor(L1X, [TwinBody("box", (5.0, 5.0, 1e-4))])
    light = np.array([0.5])
    p = twin.seen([(0, light)]).best
    twin.detection = replace(twin.detection, at_least=2)
    assert twin.seen([(0, light)]).best == 0
    assert twin.seen([(0, light), (0, light)]).best == pytest.approx(p * p)


def test_a_piece_out_of_every_beam_is_never_noticed():
    piece = PIECES["hand"]
    twin = one_sensor(L1X, [piece_body(piece)])
    there = trial(twin, piece, at(twin, -0.5))
    assert not there.noticed
    assert there.any == 0


def test_a_sensor_inside_a_piece_reports_nothing():
    piece = PIECES["torso"]
    twin = one_sensor(L5CX, [piece_body(piece)], piece="torso")
    assert trial(twin, piece, at(twin, 0.1)).any == 0 < trial(twin, piece, at(twin, 0.4)).any


def test_a_beam_without_a_flat_end_is_refused():
    dome = Sensor(fov=math.pi, range_m=0.18, shape="dome")
    with pytest.raises(ValueError, match="dome"):
        rays_of(dome, 1, np.random.default_rng(0))
