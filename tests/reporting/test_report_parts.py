"""Parts of the report beside the counts: requirements, cables, drawings and the PDF."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.definitions.errors import UserError
from place_rings.coverage.rings.ring import Ring, Setup, named_setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.robots.built_in import ROBOTS
from place_rings.coverage.sensors.effective_range import Use
from place_rings.coverage.sensors.sensor import effective
from place_rings.coverage.targets.named import Shell
from place_rings.formats.fingerprints import scene_sha256
from place_rings.formats.firmware.cabling import cable_run, crossings
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import Verifier
from place_rings.reporting import pdf
from place_rings.reporting.pages import html
from place_rings.reporting.setup_report.bill_of_materials import DENSITY, printed_parts
from place_rings.reporting.setup_report.cable_section import bus_cable, wirings
from place_rings.reporting.setup_report.facts import decide, requirement_sentence

from ..support.browser import CHROMIUM

NEAR = Shell(0.5)


@given(st.sampled_from(sorted(ROBOTS)), st.integers(0, 2**32 - 1))
def test_a_cable_reaches_its_ring_at_every_pose(name, seed):
    """The straight lengths of the links are at least the distance from the base to the ring, and a
    loop holds what slips across its joint."""
    rng, robot = np.random.default_rng(seed), ROBOTS[name]
    q = np.clip(rng.uniform(-2, 2, (3, len(robot.chain))), *robot.limits.T)
    poses = tuple(map(Pose, q))
    scene = Scene.paper(robot=robot, poses=poses)
    crossed = crossings(scene)
    for joint, q in zip(
        crossed, robot.chain.settled(np.array([p.q for p in poses])).T, strict=True
    ):
        assert joint.motion == pytest.approx(np.ptp(q))
        assert joint.loop >= joint.slip
    for link in robot.links:
        ring = Ring(link, rng.uniform(), 3)
        run = cable_run(scene, ring)
        for pose in poses:
            cones = sensor_cones(robot, Setup((ring,)), pose.q)
            assert np.linalg.norm(cones.apex.mean(axis=0)) <= run.along + 1e-9
        assert run.length >= run.along + sum(joint.slip for joint in crossed[: run.joints])
        assert run.usb == (run.length <= 5 + 1e-9)


def test_one_pose_plans_for_one_turn_at_most():
    for joint in crossings(Scene.paper()):
        assert 0 < joint.motion <= math.tau


def test_bus_cables_are_those_of_the_wiring():
    sensor = effective(Use("vl53l1x")).sensor
    setup = Setup(tuple(Ring("forearm", 0.5, n, sensor=sensor) for n in (3, 20)))
    (direct, switched), reasons = wirings(Scene(), setup)
    assert not reasons
    assert bus_cable(direct) == direct.bus.segments[0].cable_m
    trunk, channel = switched.bus.segments[:2]
    assert bus_cable(switched) == pytest.approx(trunk.cable_m + 20 * channel.cable_m)


@pytest.fixture(scope="module")
def proof():
    """A guaranteed interval of another width than those that decide a requirement."""
    return Verifier(Scene.paper(), None, "certified", 0.01).verify(named_setup("n1_8_0"), NEAR)


@pytest.mark.parametrize("margin", [-0.2, 0.2])
def test_a_requirement_is_decided_by_proof(proof, margin):
    required = (proof.high if margin > 0 else proof.low) + margin / 100
    scene = Scene.paper(targets=(replace(NEAR, at_least_percent=100 * required),))
    (one,) = decide(scene, named_setup("n1_8_0"))
    assert one.passes == (margin < 0)
    assert one.low_percent <= 100 * proof.high
    assert one.high_percent >= 100 * proof.low
    assert f"{100 * required:g} %" in requirement_sentence(one)
    assert decide(Scene.paper(targets=(NEAR,)), named_setup("n1_8_0")) == []


def test_printed_parts_are_counted():
    sensor = effective(Use("vl53l1x")).sensor
    scene = Scene(sensor=sensor)
    rings = tuple(Ring("forearm", p, 8, 0.3, radius=0.08, sensor=sensor) for p in (0.4, 0.6))
    one, two = (printed_parts(scene, Setup(rings[:n])) for n in (1, 2))
    assert (one.rings, two.rings, two.reasons) == (1, 2, [])
    assert two.grams == pytest.approx(2 * one.grams, rel=1e-3)  # other lettering
    assert 20 * DENSITY < one.grams < 500 * DENSITY
    assert two.hardware == one.hardware + one.hardware
    assert sum(one.hardware.values()) >= 2
    nominal = printed_parts(Scene(), Setup((Ring("forearm", 0.5, 8),)))
    assert nominal.rings == 0
    assert nominal.reasons


def test_a_scene_has_a_hash_of_its_own():
    scene = Scene()
    assert scene_sha256(scene) == scene_sha256(Scene())
    assert scene_sha256(scene) != scene_sha256(replace(scene, occlusion="ignore"))


def test_without_a_browser_nothing_is_written(run, tmp_path, monkeypatch):
    monkeypatch.setattr(pdf.shutil, "which", lambda _: None)
    code, out, err = run("report", "n1_8_0", "--pdf", "--out", tmp_path / "out")
    assert (code, out) == (2, "")
    assert "PATH" in err
    assert err.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_a_browser_that_fails_is_reported(tmp_path):
    page = tmp_path / "page.html"
    page.write_text("<p>")
    with pytest.raises(UserError, match=r"/bin/false"):
        pdf.write_pdf("/bin/false", page, tmp_path / "page.pdf")
    assert not (tmp_path / "page.pdf").exists()


@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium on this machine")
def test_a_page_is_printed(tmp_path):
    """A thematic break ends a page."""
    page, file = tmp_path / "page.html", tmp_path / "page.pdf"
    page.write_text(html("# One\n\n---\n\n## Two\n", tmp_path, 'a "title" </style>'))
    pdf.write_pdf(pdf.find_browser(), page, file)
    data = file.read_bytes()
    assert data.startswith(b"%PDF")
    assert len(re.findall(rb"/Type\s*/Page\b", data)) == 2
