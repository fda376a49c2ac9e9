"""The viewer with single sensors: a setup of nothing else opens, is edited, counted and saved."""

import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.occlusion.occlusion_mode import OCCLUSIONS
from place_rings.coverage.rings.mounted_sensor import MountedSensor
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.rings.rounding import rounded
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.coverage.targets.named import Shell
from place_rings.formats.loader import read_proposal
from place_rings.objectives.scene import Scene
from place_rings.viewer import page_tasks
from place_rings.viewer.drawing import Drawing
from place_rings.viewer.drawn_parts import DrawnParts
from place_rings.viewer.edited_setup import NEW_COUNT, EditedSetup, SinglePose
from place_rings.viewer.quick_estimate import QuickEstimate
from place_rings.viewer.server import Server
from place_rings.viewer.session import ViewerSession
from place_rings.viewer.tasks import prove, search_from

from ..strategies.singles import mixed_setups, singles
from ..support.viser_client import Client

NEAR = Shell(0.5)
PYRAMID = Sensor(math.radians(45), 1.5, None, math.radians(30), 16)
PAD = MountedSensor("forearm", (0.0, 0.12, 0.2), (0.0, 1.0, 0.0), name="pad")
EYE = MountedSensor("tool", (0.0, 0.12, 0.0), (0.0, 1.0, 0.2), PYRAMID, (0.0, 0.0, 1.0))
ALONE = rounded(Setup((), (PAD, EYE)), Sensor())


@given(one=singles())
def test_a_pose_reads_back_as_the_sensor(one):
    pose = SinglePose.of(one)
    np.testing.assert_array_equal(pose.placed(one).T_link_sensor, one.T_link_sensor)
    twice = replace(pose, azimuth_deg=pose.azimuth_deg + 360.0).placed(one)
    np.testing.assert_allclose(twice.T_link_sensor, one.T_link_sensor, atol=1e-6)
    assert twice.sensor == one.sensor
    assert twice.link == one.link


@given(one=singles(), angle=st.integers(-180, 180))
def test_a_roll_turns_about_the_beam_and_an_azimuth_about_z(one, angle):
    pose = SinglePose.of(one)
    T, c, s = one.T_link_sensor, math.cos(math.radians(angle)), math.sin(math.radians(angle))
    rolled = replace(pose, roll_deg=pose.roll_deg + angle).placed(one).T_link_sensor
    np.testing.assert_allclose(rolled[:3, 2], T[:3, 2], atol=1e-6)
    right_handed = T[:3, :3] @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    np.testing.assert_allclose(rolled[:3, :3], right_handed, atol=1e-6)
    if abs(pose.elevation_deg) < 89.9:  # at z itself an azimuth is that of the beam's up
        turned = replace(pose, azimuth_deg=pose.azimuth_deg + angle).placed(one).T_link_sensor
        about_z = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        np.testing.assert_allclose(turned[:3, :3], about_z @ T[:3, :3], atol=1e-6)


@pytest.mark.parametrize("pose", [{"x": math.nan}, {"roll_deg": math.inf}, {"z": 1e9}])
def test_a_pose_that_cannot_be_is_refused(pose):
    with pytest.raises(ValueError, match=r"finite|at most"):
        EditedSetup(Scene.paper(), ALONE).moved(0, **pose)


def test_edits_concern_one_sensor_and_rings_may_join_it():
    draft = EditedSetup(Scene.paper(), ALONE)
    moved = draft.moved(1, x=0.05).setup
    assert moved.singles[0] == ALONE.singles[0]
    assert moved.singles[1] == replace(ALONE.singles[1], position=(0.05, 0.12, 0.0))
    lifted = Setup((), (replace(ALONE.singles[0], lifted=0.01),))
    assert EditedSetup(Scene.paper(), lifted).moved(0, x=0.05).setup.singles[0].lifted == 0
    both = draft.added("forearm")
    assert [g.count for g in both.setup.groups] == [NEW_COUNT, 1, 1]
    assert both.removed(0).setup == ALONE
    assert both.removed(2).setup.singles == ALONE.singles[:1]
    assert both.changed(0, tilt_deg=5.0).setup.singles == ALONE.singles
    with pytest.raises(IndexError):
        both.moved(0, x=0.0)
    with pytest.raises(ValueError, match="last sensor cannot"):
        draft.removed(1).removed(0)


@settings(max_examples=6)
@given(setup=mixed_setups(), cones=st.sampled_from(["off", "this ring", "this link", "all"]))
def test_every_sensor_is_drawn_and_can_be_selected(setup, cones):
    drawing = Drawing(QuickEstimate(Scene.paper(), [NEAR]))
    for i, group in enumerate(setup.groups):
        drawn = drawing.rings(setup, DrawnParts(0, NEAR, "ignore", cones, i))
        wanted = {
            k
            for k, other in enumerate(setup.groups)
            if cones == "all"
            or (cones == "this ring" and k == i)
            or (cones == "this link" and other.link == group.link)
        }
        assert {int(n[5:]) for n in drawn if n.startswith("cones")} == wanted
        assert "chosen" in drawn
        clicked = {item.ring for item in drawn.values() if getattr(item, "ring", None) is not None}
        assert clicked == set(range(len(setup.groups)))


def test_a_room_says_which_sensor_lies_in_a_body():
    deep = Setup((), (replace(PAD, position=(0.0, 0.0, 0.2)), EYE))
    (fault,) = ViewerSession(Scene(), {"deep": deep}).broken(deep, OCCLUSIONS[1])
    assert fault.rings == (0,)
    assert fault.text.startswith("sensor pad (forearm) lies 4")
    assert fault.text.endswith("mm within forearm_1 and sees nothing")
    with pytest.raises(ValueError, match="no ring to search from"):
        search_from(Scene.paper(), ALONE, lambda *_: None, lambda: False)


def test_a_page_of_single_sensors_moves_one_and_saves_it(tmp_path, monkeypatch):
    monkeypatch.setattr(page_tasks, "prove", partial(prove, voxel=0.1, width=0.3))
    with Server(ViewerSession(Scene.paper(), {"skin": ALONE}, tmp_path)) as server:
        page = Client(server.url)
        page.until(lambda: page.zeta("V_S(0.5)") is not None, "the page says no ζ")
        before = page.zeta("V_S(0.5)")
        assert "2 sensors on 0 rings" in page.words
        assert page.value("Ring") == "0: pad (forearm)"
        assert not page.visible("Tilt, °")
        page.set("Ring", "1: sensor (tool)")
        steep = pytest.approx(math.degrees(math.atan(0.2)), abs=1e-5)
        page.until(lambda: page.value("Elevation, °") == steep, "the controls are the first's")
        page.set("Link", "upper_arm")  # the link of a ring to come: the sensor stays on its own
        page.set("z, mm", 40.0)
        page.set("Elevation, °", -60.0)
        page.until(lambda: page.zeta("V_S(0.5)") != before, "another elevation did not change ζ")
        page.set("Add a ring on this link", True)
        page.until(lambda: "10 sensors on 1 ring " in page.words, "no ring came")
        page.until(lambda: page.visible("Tilt, °"), "the ring has no tilt")
        page.set("Remove this ring", True)
        page.until(lambda: "2 sensors on 0 rings" in page.words, "the ring stayed")
        page.set("Save as a new proposal", True)
        page.until(lambda: "saved as proposal.toml" in page.words, "nothing was saved")
        page.close()
    setup, _, _ = read_proposal(tmp_path / "proposal.toml")
    assert setup.rings == ()
    assert setup.singles[0] == ALONE.singles[0]
    assert setup.singles[1].link == "tool"
    assert setup.singles[1].position == (0.0, 0.12, 0.04)
    assert setup.singles[1].direction[2] == pytest.approx(-math.sin(math.radians(60)))


def test_a_ring_is_opened_beside_single_sensors():
    both = Setup((Ring("forearm", 0.4, 5),), (PAD,))
    with Server(ViewerSession(Scene.paper(), {"both": both})) as server:
        page = Client(server.url)
        page.until(lambda: page.zeta("V_S(0.5)") is not None, "the page says no ζ")
        assert (page.visible("Tilt, °"), page.visible("Roll, °")) == (True, False)
        page.set("Ring", "1: pad (forearm)")
        page.until(lambda: page.visible("Roll, °"), "the sensor's controls do not come")
        assert not page.visible("Tilt, °")
        page.close()
