"""Zeta of detection: against a plain loop over voxels and sensors, limits, laws and bad input."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.detection.aspect import SLANT
from place_rings.coverage.detection.detection import Detection, bounds, detectors
from place_rings.coverage.detection.detectors import Detectors
from place_rings.coverage.detection.noticed import NEGLIGIBLE, noticed
from place_rings.coverage.detection.pieces import PIECES
from place_rings.coverage.occlusion.first_return import Beam, capsule_in_beam
from place_rings.coverage.occlusion.occluders import beams
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.link_bodies import robot_capsules
from place_rings.coverage.sensors.effective_range import Use
from place_rings.coverage.sensors.sensor import Sensor, effective
from place_rings.coverage.solids.capsule_shadows import behind, capsule_shadow
from place_rings.coverage.solids.cones import Cones
from place_rings.coverage.solids.sensor_beams import MixedBeams
from place_rings.coverage.targets.own import Box
from place_rings.coverage.voxels.sample_points import samples_of
from place_rings.coverage.voxels.voxel_set import ranges
from place_rings.coverage.weight_field import WeightField
from place_rings.objectives.detection_share import at_pose, noticed_in
from place_rings.objectives.occlusion import occluders
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import EmptyTargetError, Verifier
from scipy.optimize import minimize_scalar
from scipy.stats import norm

from ..strategies.scenes import CELLS, NEAR, scenes

POSE = Pose(np.radians([0.0, -60, 80, -110, -90, 0]))
PYRAMID = Sensor(math.radians(40), 1.2, None, math.radians(30), 4)
CATALOGUE = effective(Use("vl53l5cx", "dark")).sensor
BOX = Box((0.8, 0.6, 0.8), (0.5, 0.1, 0.5))


def scene_of(occlusion="shadow", target=BOX, **keys):
    return replace(Scene.paper(poses=(POSE,)), occlusion=occlusion, targets=(target,), **keys)


def setup_of(*sensors, count=6):
    places = (("upper_arm", 0.6, 0.3), ("forearm", 0.5, -0.2), ("forearm", 0.9, 0.0))
    return Setup(
        tuple(
            Ring(link, where, count, tilt=tilt, sensor=sensor)
            for (link, where, tilt), sensor in zip(places, sensors, strict=False)
        )
    )


def zeta(scene, setup, detection, voxel=0.1, rule="sampled"):
    return at_pose(Verifier(scene, voxel, rule), setup, scene.targets[0].target, 0, detection)


def plain_chance(scene, setup, detection, points):
    """The probability at each point by loops over points, sensors, zones and all bodies."""
    q = scene.poses[0].q
    cones, piece = sensor_cones(scene.robot, setup, q), detection.piece
    of = detectors([g.sensor for g in setup.groups for _ in range(g.count)], detection)
    bodies = robot_capsules(scene.robot, forward(scene.robot.chain, q))
    ups = np.asarray(cones.sides(np.arange(len(cones)))[1])
    result, hide = [], [hiding(scene, cones, k, bodies) for k in range(len(cones))]
    for point in points:
        tail = np.array([1.0])  # probabilities of 0, 1, ... sensors
        for k in range(len(cones)):
            frame = np.array([np.cross(ups[k], cones.axis[k]), ups[k], cones.axis[k]])
            own = Detectors(*(a[k] for a in of))
            s, part, cover = unhidden(frame @ (point - cones.apex[k]), frame[:, 2], piece, own)
            part = cones.apex[k] + part @ frame
            hidden = max((function(part) for function in hide[k]), default=-np.inf)
            s *= min(max((cover[0] / 2 - hidden) / cover[1], 0.0), 1.0)
            b, z = of.threshold[k, 0], of.quantile[k, 0]
            p = 1 - norm.cdf(b - s * (b + z)) / norm.cdf(b)
            p = 1 - (1 - p) ** of.frames[k]
            tail = np.convolve(tail, [1 - p, p])
        result.append(tail[detection.at_least :].sum())
    return np.array(result)


def hiding(scene, cones, k, bodies):
    """Functions of a point that are negative where a body leaves it in view of sensor ``k``."""
    apex, axis, functions = cones.apex[k], cones.axis[k], []
    single = not bool(np.asarray(cones.is_zoned())[k])
    for i in range(len(bodies.radius)) if scene.occlusion != "ignore" else ():
        ends = bodies.start[i], bodies.end[i], bodies.radius[i]
        if scene.occlusion == "blind" and single:
            half = np.asarray(cones.outer_angle())[k]
            stop = float(capsule_in_beam(Beam(apex, axis, half, np.array(20.0)), *ends)[0])
            functions.append(lambda p, stop=stop: np.linalg.norm(p - apex) - stop)
        else:
            shadow = capsule_shadow(apex, *ends)
            functions.append(lambda p, shadow=shadow: -float(behind(p, shadow)))
    return functions


def unhidden(v, up, piece, of):
    """The signal of a piece at ``v`` in a beam's frame, of which nothing is hidden; the part of its
    axis that is nearest to the beam's; and its width in the beam and in a zone, m."""
    r, half = piece.width_m / 2, piece.height_m / 2
    weights = np.array([1.0, 1.0, SLANT])
    t = minimize_scalar(
        lambda t: np.sum((weights * (v + t * up)) ** 2),
        bounds=(-half, half),
        method="bounded",
        options={"xatol": 1e-12},
    ).x
    t = min((t, -half, half), key=lambda t: np.sum((weights * (v + t * up)) ** 2))
    part, sine = v + t * up, math.hypot(*up[:2])
    if of.round:
        ways = np.array([[up[1], -up[0]], up[:2]]) / sine
        edge, zones = [of.edge[0]] * 2, [1, 1]
    else:
        order = [0, 1] if abs(up[1]) >= abs(up[0]) else [1, 0]
        ways, edge, zones = np.eye(2)[order], of.edge[order], of.zones.astype(int)[order]
    steep = ways[1] @ up[:2]
    wide = r * sine / abs(steep) if zones[0] > 1 else r
    aside, lengthwise = ways @ part[:2]
    middle = lengthwise - math.copysign(1.0, steep) * sine * t
    if part[2] <= 0:
        return 0.0, part, (1.0, 1.0)
    share, off = 1.0, 0.0
    for i, (x, size) in enumerate(((aside, wide), (middle, half * sine + r * abs(up[2])))):
        ends = part[2] * np.linspace(-edge[i], edge[i], zones[i] + 1)
        inside = np.minimum(x + size, ends[1:]) - np.maximum(x - size, ends[:-1])
        share *= max(inside.max(), 0.0) / (ends[1] - ends[0])
        if i == 0:
            off = abs(x - (ends[1:] + ends[:-1]) / 2).min()
    front = max(part[2] - r * sine * max(1 - (off / r) ** 2, 0.0), 0.0)
    away = math.sqrt(max(abs(aside) - r, 0.0) ** 2 + lengthwise**2 + front**2)
    beam = 2 * edge[0] * part[2]
    cover = min(2 * r, beam), min(2 * r, beam, beam / zones[0])
    height = v @ up
    inside = abs(height) < half and math.sqrt(v @ v - height**2) < r
    if away < of.least or inside:
        return 0.0, part, cover
    return share * (of.reach / away) ** 2, part, cover


@pytest.mark.parametrize(
    ("occlusion", "rule", "detection"),
    [
        ("ignore", "sampled", Detection(PIECES["hand"])),
        ("shadow", "centre", Detection(PIECES["torso"], at_least=2, seconds=0.5)),
        ("blind", "sampled", Detection(PIECES["torso"], reflectance=0.002)),
    ],
)
def test_is_the_mean_of_a_plain_loop(occlusion, rule, detection):
    scene, setup = scene_of(occlusion), setup_of(PYRAMID, Sensor(math.radians(30)), CATALOGUE)
    verifier = Verifier(scene, 0.2, rule)
    (wanted, _), *_ = verifier.pieces(BOX, 0)
    points = wanted.centres()
    if rule == "sampled":
        points = samples_of(ranges(wanted.start, wanted.stop), 0.2)
    plain = plain_chance(scene, setup, detection, points)
    assert 0.01 < plain.mean() < 0.99
    counted = at_pose(verifier, setup, BOX, 0, detection)
    assert abs(counted.zeta - plain.mean()) <= 18 * NEGLIGIBLE
    law = noticed_in(scene, setup, 0, detection)
    assert np.abs(law.at(points) - plain).max() <= 18 * NEGLIGIBLE


SEEDS = st.integers(0, 2**32)


@given(scenes(targets=NEAR, obstacles=CELLS), st.sampled_from(sorted(PIECES)), SEEDS)
@settings(max_examples=10)
def test_bounds_hold_in_every_ball_and_no_shadow_is_lost(drawn, name, seed):
    """Also where a body beyond the sides of a beam hides a part of the piece in it; by the law and
    by both ends of its assumptions, together as alone."""
    detection, rng = Detection(PIECES[name]), np.random.default_rng(seed)
    sensors = [g.sensor for g in drawn.setup.groups for _ in range(g.count)]
    if not sensors:
        return
    each = detectors(sensors, detection), *bounds(sensors, detection)
    own = [noticed(drawn.cones, drawn.occluders, "shadow", of, detection) for of in each]
    law = noticed(drawn.cones, drawn.occluders, "shadow", each[0], detection, *each[1:])
    index = rng.integers(0, len(law), 400)
    middle = law.cones.apex[index] + law.cones.axis[index] * rng.uniform(0, 1.5, (400, 1))
    middle += rng.normal(0, 0.2, (400, 3))
    reach = float(rng.choice([0.002, 0.02, 0.2]))
    ends = law.chances(middle, index, reach)
    way = rng.normal(size=(20, 400, 3))
    way /= np.linalg.norm(way, axis=-1, keepdims=True)
    points = middle + reach * way * rng.random((20, 400, 1)) ** (1 / 3)
    chance = law.chance(points, index)
    assert (ends.low[:, None] - 1e-12 <= chance).all()
    assert (chance <= ends.high[:, None] + NEGLIGIBLE + 1e-12).all()
    assert (chance[1] - 1e-12 <= chance[0]).all()
    assert (chance[0] <= chance[2] + 1e-12).all()
    single = [law.chance(at[None], index) for at in points]
    assert np.array_equal(chance, np.concatenate(single, axis=1))
    assert np.array_equal(chance, np.concatenate([one.chance(points, index) for one in own]))
    everywhere = Cones(
        law.cones.apex - 100 * law.cones.axis,
        law.cones.axis,
        np.full(len(law), 1.4),
        np.full(len(law), 300.0),
    )
    seen = beams(law.cones, drawn.occluders, "shadow", looks=everywhere)
    assert np.array_equal(chance, replace(law, seen=seen).chance(points, index))


@given(scenes(targets=NEAR, obstacles=CELLS), st.sampled_from(["shadow", "blind"]), SEEDS)
@settings(max_examples=15)
def test_in_the_limit_places_in_view_are_certain_and_others_impossible(drawn, occlusion, seed):
    """A piece of 1 mm, so bright that any part of it suffices, but within its diagonal of the
    surface of what is in view."""
    detection = Detection(replace(PIECES["hand"], width_m=1e-3, height_m=1e-3))
    rng = np.random.default_rng(seed)
    sensors = [replace(g.sensor, near_m=0.0) for g in drawn.setup.groups for _ in range(g.count)]
    if not sensors:
        return
    of = detectors(sensors, detection)
    of = of._replace(reach=np.full(len(sensors), 1e5), least=np.zeros(len(sensors)))
    law = noticed(drawn.cones, drawn.occluders, occlusion, of, detection)
    square = np.flatnonzero(~(of.flat & of.round))  # a round beam counts as a square as large
    if len(square) == 0:
        return
    index = rng.choice(square, 1000)
    points = law.cones.apex[index] + rng.normal(0, 0.5, (1000, 3))
    cones = law.cones  # which end where nothing is detected any more, and begin at the apex
    cones = replace(cones, near=None) if isinstance(cones, MixedBeams) else cones
    value = beams(cones, drawn.occluders, occlusion).part(points, index)
    chance = law.chance(points[None], index)[0, 0]
    diagonal = 1e-3 * 2**0.5
    assert (chance[value <= -diagonal] >= 1 - 1e-6).all()
    assert (chance[value > diagonal] == 0).all()


LARGER = {
    "range": lambda s, d: (s.with_sensors(lambda x: replace(x, range_m=1.3 * x.range_m)), d),
    "reflectance": lambda s, d: (s, replace(d, piece=replace(d.piece, reflectance=0.9))),
    "time": lambda s, d: (s, replace(d, seconds=2 * d.seconds)),
    "k": lambda s, d: (s, replace(d, at_least=d.at_least - 1)),
}


@given(
    st.sampled_from(sorted(LARGER)),
    st.sampled_from(sorted(PIECES)),
    st.integers(2, 4),
    st.sampled_from(["ignore", "shadow", "blind"]),
    st.lists(st.integers(10, 60), min_size=2, max_size=3),
)
@settings(max_examples=12)
def test_grows_with_each_of_its_causes(cause, name, k, occlusion, fov_deg):
    sensors = [Sensor(math.radians(f), 1.0, None, math.radians(f / 2), 3) for f in fov_deg]
    scene, setup = scene_of(occlusion), setup_of(*sensors)
    detection = Detection(PIECES[name], at_least=k)
    more_setup, more = LARGER[cause](setup, detection)
    less, more = zeta(scene, setup, detection).zeta, zeta(scene, more_setup, more).zeta
    assert 0 <= less <= more + 18 * NEGLIGIBLE <= 1 + 18 * NEGLIGIBLE


@given(
    st.sampled_from(sorted(PIECES)), st.lists(st.integers(10, 60), min_size=2, max_size=3), SEEDS
)
@settings(max_examples=15)
def test_grows_with_the_width_of_what_no_body_hides_and_no_sensor_is_in(name, fov_deg, seed):
    sensors = [Sensor(math.radians(f), 1.0, None, math.radians(f / 2), 3) for f in fov_deg]
    scene, setup, piece = scene_of("ignore"), setup_of(*sensors), PIECES[name]
    wider = replace(piece, width_m=1.2 * piece.width_m)
    less, more = (noticed_in(scene, setup, 0, Detection(p)) for p in (piece, wider))
    points = np.random.default_rng(seed).uniform([0.1, -0.2, 0.1], [0.9, 0.4, 0.9], (300, 3))
    aside = np.linalg.norm((points[:, None] - less.cones.apex)[..., :2], axis=-1)
    points = points[(aside > 0.3).all(axis=1)]
    assert (less.at(points) <= more.at(points) + 18 * NEGLIGIBLE).all()


@pytest.mark.parametrize("rule", ["sampled", "centre"])
def test_one_count_has_the_ends_that_counts_of_each_assumption_have(rule):
    scene, setup = scene_of(), setup_of(PYRAMID, Sensor(math.radians(30)), CATALOGUE)
    detection, verifier = Detection(PIECES["torso"], at_least=2), Verifier(scene, 0.1, rule)
    one = at_pose(verifier, setup, BOX, 0, detection, assumed=True)
    assert one.assumed_low < one.zeta < one.assumed_high
    assert one.zeta == at_pose(verifier, setup, BOX, 0, detection).zeta
    sensors = [g.sensor for g in setup.groups for _ in range(g.count)]
    (wanted, _), *_ = verifier.pieces(BOX, 0)
    points = wanted.centres()
    if rule == "sampled":
        points = samples_of(ranges(wanted.start, wanted.stop), 0.1)
    law = noticed_in(scene, setup, 0, detection)
    for end, value in zip(
        bounds(sensors, detection), (one.assumed_low, one.assumed_high), strict=True
    ):
        own = noticed(law.cones, occluders(scene, POSE.q), "shadow", end, detection)
        assert abs(own.at(points).mean() - value) <= 18 * NEGLIGIBLE


def test_falls_with_light_and_unknown_light_is_refused():
    scene, setup = scene_of(), setup_of(CATALOGUE)
    dark, bright = (
        zeta(scene, setup, Detection(PIECES["hand"], light)).zeta for light in ("dark", "5klx")
    )
    assert dark > bright > 0
    with pytest.raises(ValueError, match="500klx"):
        zeta(scene, setup, Detection(PIECES["hand"], "500klx"))


def test_an_empty_setup_detects_nothing_and_an_empty_target_is_refused():
    assert zeta(scene_of(), Setup(()), Detection()).zeta == 0
    with pytest.raises(EmptyTargetError):
        zeta(
            scene_of(target=Box((1e-3, 1e-3, 1e-3), (0.5, 0, 0.5))), setup_of(PYRAMID), Detection()
        )
    with pytest.raises(ValueError, match="touch"):
        zeta(scene_of(), setup_of(PYRAMID), Detection(), rule="touch")


def test_weights_count_and_equal_weights_change_nothing():
    setup, low = setup_of(PYRAMID, CATALOGUE), np.array([0.1, -0.2, 0.1])
    plain = zeta(scene_of(), setup, Detection())
    halves = np.ones((2, 1, 1)) * np.array([[[1.0]], [[0.0]]])
    fields = [WeightField.of(w, low, np.array([0.4, 0.6, 0.8])) for w in (1 + 0 * halves, halves)]
    same, half = (
        zeta(scene_of(target=replace(BOX, importance=f)), setup, Detection()) for f in fields
    )
    assert (same.zeta, same.error) == (pytest.approx(plain.zeta), pytest.approx(plain.error))
    near = zeta(scene_of(target=Box((0.4, 0.6, 0.8), (0.3, 0.1, 0.5))), setup, Detection())
    assert half.zeta == pytest.approx(near.zeta)
    assert half.zeta != pytest.approx(plain.zeta)


def test_large_targets_are_counted_region_by_region():
    scene, setup = scene_of(), setup_of(PYRAMID, CATALOGUE)
    whole, parts = (
        at_pose(Verifier(scene, 0.05, memory=m), setup, BOX, 0, Detection()) for m in (None, 2e5)
    )
    assert (parts.zeta, parts.error) == (pytest.approx(whole.zeta), pytest.approx(whole.error))


@pytest.mark.parametrize("occlusion", ["ignore", "shadow", "blind"])
def test_errors_and_guaranteed_intervals_hold_the_count_of_finer_voxels(occlusion):
    scene = scene_of(occlusion)
    setup = setup_of(PYRAMID, Sensor(math.radians(30)), Sensor(1.0, 0.4, shape="dome"))
    for detection in (Detection(PIECES["torso"]), Detection(PIECES["hand"], at_least=2)):
        count, few = zeta(scene, setup, detection, 0.02), zeta(scene, setup, detection)
        assert abs(few.zeta - count.zeta) <= few.error + count.error < 0.2
        coarse, fine = (zeta(scene, setup, detection, v, "certified") for v in (0.1, 0.04))
        for proof in (coarse, fine):
            assert proof.low <= count.zeta + count.error
            assert proof.high >= count.zeta - count.error
        assert fine.high - fine.low < coarse.high - coarse.low
