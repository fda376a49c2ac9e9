"""Stop conditions: whatever leaves the robot without sight asks for a stop, and what does not, does
not.
"""

from dataclasses import replace
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.rig.rings.line_monitor import Event, Happened
from place_rings.rig.rings.protocol import Frame, Status
from place_rings.rig.rings.zones import Zones
from place_rings.rig.robot.state import RobotMode, State
from place_rings.rig.robot.vetting import Ended, LinkFaultError
from place_rings.rig.session.gathering import Gathered
from place_rings.rig.session.session import Session
from place_rings.rig.session.stop_conditions import RingWatch, StopConditions, StopRules

counts = st.integers(1, 24)
FAR = 0.15  # m, a near stop


def frame(n, distance, status):
    distance = np.where(np.isin(status, (Status.VALID, Status.WEAK)), distance, np.nan)
    return Frame(n / 10, n / 10, n, np.asarray(distance, float), np.asarray(status))


def seeing(n, count, distance=1.0):
    """A frame in which every sensor reads another distance than before."""
    return frame(n, np.full(count, distance + 0.001 * (n % 7)), np.full(count, Status.VALID))


def watched(frames, rules=None, turn=2.0, near=FAR):
    """What each frame asks for, one after another; the robot turns by ``turn`` degrees between."""
    watch = RingWatch(rules or StopRules())
    return [
        watch.fault(f, np.full(1 if f is None else len(f.status), near), np.radians([0, i * turn]))
        for i, f in enumerate(frames)
    ]


@given(counts, st.data())
def test_a_ring_whose_sensors_fail_stops_the_robot_beyond_the_share_that_may(count, data):
    share = data.draw(st.floats(0, 0.5))
    failed = data.draw(st.integers(0, count))
    status = np.where(np.arange(count) < failed, Status.FAILED, Status.VALID)
    status = np.array(data.draw(st.permutations(status.tolist())))
    (said,) = watched([frame(0, np.ones(count), status)], StopRules(failed_share=share))
    if failed == count or (failed > 1 and failed / count > share + 1e-12):
        assert f"{failed} of {count} " in said
    elif failed < 2 or failed / count < share - 1e-12:
        assert said is None


@given(counts)
def test_all_sensors_failed_is_never_waived(count):
    failed = frame(0, np.ones(count), np.full(count, Status.FAILED))
    assert watched([failed], StopRules(failed_share=1.0)) != [None]


@given(counts, st.integers(2, 20), st.integers(0, 10), st.data())
def test_distances_that_do_not_change_stop_it_after_the_stated_frames_and_not_before(
    count, most, before, data
):
    status = np.array(
        data.draw(st.lists(st.sampled_from([0, 1, 2]), min_size=count, max_size=count))
    )
    status[data.draw(st.integers(0, count - 1))] = Status.VALID
    frozen = [frame(before + i, np.full(count, 0.7), status) for i in range(most + 2)]
    said = watched(
        [seeing(n, count) for n in range(before)] + frozen,
        StopRules(failed_share=1.0, frozen_frames=most),
    )
    assert said[: before + most] == [None] * (before + most)  # the first of the frozen ones is new
    assert f"{most} frames" in said[before + most]


@given(st.integers(2, 24), st.data())
def test_some_frozen_sensors_stop_it_beyond_the_share_that_may_fail(count, data):
    frozen = np.array(data.draw(st.lists(st.booleans(), min_size=count, max_size=count)))
    frozen[data.draw(st.integers(0, count - 1))] = False
    frames = [
        frame(
            n,
            np.where(frozen, 0.7, 0.7 + 0.001 * (n % 2)),
            np.where(n % 2, Status.VALID, Status.WEAK) + np.zeros(count, int),
        )
        for n in range(20)
    ]
    said = watched(frames)
    assert said[: StopRules.frozen_frames] == [None] * StopRules.frozen_frames
    beyond = frozen.sum() > 1 and frozen.sum() > StopRules.failed_share * count
    for line in said[StopRules.frozen_frames :]:
        assert (
            (f"{frozen.sum()} of {count} " in line and "6 frames" in line) if beyond else not line
        )


@pytest.mark.parametrize(
    ("distance", "status", "turn"),
    [(0.7, Status.VALID, 0.0), (0.7, Status.NO_TARGET, 2.0), (0.0, Status.VALID, 2.0)],
    ids=["standing", "nothing in range", "covered"],
)
def test_a_robot_that_stands_and_a_ring_that_measures_nothing_are_not_frozen(
    distance, status, turn
):
    frames = [frame(n, np.full(4, distance), np.full(4, status)) for n in range(50)]
    assert watched(frames, turn=turn, near=0.0) == [None] * 50


@given(
    st.floats(0.01, 0.9),
    st.integers(1, 6),
    st.integers(2, 12),
    st.floats(-1, 1),
    st.integers(0, 30),
    st.integers(0, 2**31),
)
def test_a_frozen_ring_stops_it_within_a_degree_however_slowly_it_turns(
    step, joints, most, start, still, seed
):
    """Degrees a frame, of any joint, after any time at rest; encoders have noise."""
    rng, watch = np.random.default_rng(seed), RingWatch(StopRules(frozen_frames=most))
    way = rng.uniform(-1, 1, joints)
    way /= np.abs(way).max()
    frames = still + most + int(1 / step) + 3
    for n in range(frames):
        turned = np.radians(step) * max(n - still, 0)
        q = start + way * turned + rng.uniform(-1e-4, 1e-4, joints)
        said = watch.fault(frame(n, np.full(3, 0.7), np.zeros(3, int)), np.zeros(3), q)
        if n - still < most or turned < np.radians(0.97):
            assert said is None
    assert said is not None


@given(st.integers(0, 2**31), st.floats(0.0, 0.5), st.integers(1, 8), st.integers(1, 8))
def test_a_sensor_fails_with_more_of_its_zones_than_may(seed, share, rows, columns):
    """Whatever the others see: a target, a weak one, or none."""
    rng, n, z = np.random.default_rng(seed), 4, rows * columns
    failing = rng.integers(0, z + 1, n)
    status = rng.choice([Status.VALID, Status.NO_TARGET, Status.WEAK], (n, z))
    for k, count in enumerate(failing):
        status[k, rng.permutation(z)[:count]] = Status.FAILED
    shape = (n, rows, columns, 1)
    zones = Zones.of(np.full(shape, 1.0), status.reshape(shape))
    distance, first = zones.nearest()
    said = RingWatch(StopRules(failed_share=share)).fault(
        Frame(0.0, 0.0, 0, distance, first, zones=zones), np.full(n, FAR), np.zeros(6)
    )
    lost = int((failing / z > share).sum())
    too_many = lost == n or (lost > 1 and lost > share * n)
    assert said == (f"{lost} of {n} sensors report failure" if too_many else None)


def test_zones_that_failed_do_not_say_that_there_is_no_target():
    """15 of 16 failed and one without a target, on every sensor: nothing was seen."""
    status = np.full((3, 4, 4, 1), Status.FAILED)
    status[:, 2, 1] = Status.NO_TARGET
    distance, first = Zones.of(np.zeros(status.shape), status).nearest()
    assert np.isnan(distance).all()
    assert (first == Status.FAILED).all()
    status[:, :3] = Status.NO_TARGET  # a quarter may fail
    assert (Zones.of(np.zeros(status.shape), status).nearest()[1] == Status.NO_TARGET).all()


def test_the_same_frame_asked_for_again_is_no_new_one():
    one = seeing(0, 4)
    assert watched([one] * 100) == [None] * 100
    before, silent, after = watched([one, None, seeing(1, 4)])
    assert silent
    assert before is after is None


@given(
    st.lists(st.tuples(st.floats(0, 3), st.sampled_from([0, 1, 2])), min_size=1, max_size=9),
    st.floats(0.01, 2),
    st.data(),
)
def test_a_near_reading_of_a_sensor_stops_it(readings, least, data):
    near = np.array(
        data.draw(
            st.lists(st.sampled_from([0.0, least]), min_size=len(readings), max_size=len(readings))
        )
    )
    distance, status = (np.array(column) for column in zip(*readings, strict=True))
    said = RingWatch(StopRules()).fault(frame(0, distance, status), near, np.zeros(6))
    wrong = np.flatnonzero((distance < near) & np.isin(status, (Status.VALID, Status.WEAK)))
    assert (said is None) == (len(wrong) == 0)
    assert said is None or f"sensor {wrong[0]} " in said


AT_SPEED = State(0.0, 0.0, np.zeros(6), np.full(6, 0.1))
AT_REST = replace(AT_SPEED, speed=np.zeros(6))


class Link:
    """A link that gives a state, or a fault."""

    def __init__(self, fault, state):
        self.fault, self.state = fault, state

    def latest(self):
        if self.fault:
            raise self.fault
        return self.state


def session(frames, fault=None, trouble="", state=AT_SPEED):
    """A session of which a test says what it says."""
    rings = SimpleNamespace(counts=frames, latest=lambda: frames)
    data, link = Gathered(), Link(fault, state)
    return Mock(spec=Session, link=link, rings=rings, trouble=trouble, gathered=data)


def test_conditions_name_the_ring_and_go_by_where_the_robot_is():
    frames = [seeing(0, 3, 0.5), seeing(0, 2, 0.5)]
    asked = []

    def near(q):
        asked.append(q)
        return [np.full(3, 0.1), np.full(2, 0.6)]

    said = StopConditions(session(frames), near, StopRules())()
    assert all(part in said for part in ("ring 1", "sensor 0", "500 mm", "600 mm"))
    np.testing.assert_array_equal(asked, np.zeros((1, 6)))

    def calm(frames, **more):
        near = [np.zeros(3), np.zeros(2)]
        return StopConditions(session(frames, **more), lambda q: near, StopRules())()

    assert calm(frames) is None
    assert calm([None, None]).startswith("ring 0")
    lost = LinkFaultError(Ended.STALE)
    assert calm(frames, fault=lost) == str(lost)
    assert calm(frames, trouble="the disk is full") == "the disk is full"


def conditions(of):
    return StopConditions(of, lambda q: [np.zeros(3), np.zeros(2)], StopRules(), ["one", "other"])


@pytest.mark.parametrize("mode", list(RobotMode))
def test_a_robot_that_does_not_run_stops_and_its_mode_is_named(mode):
    said = conditions(session([seeing(0, 3), seeing(0, 2)], state=replace(AT_SPEED, mode=mode)))()
    assert (said is None) == (mode == RobotMode.RUNNING)
    assert said is None or mode.name in said


def test_a_mode_that_no_controller_had_is_no_running_one_and_an_unasked_one_is_not_judged():
    for mode, stops in ((42, True), (-7, True), (None, False)):
        of = session([seeing(0, 3), seeing(0, 2)], state=replace(AT_SPEED, mode=mode))
        assert (conditions(of)() is not None) == stops


@given(st.sampled_from(list(Happened)), st.booleans(), st.integers(0, 1), st.integers(0, 3))
def test_a_ring_that_is_another_one_stops_it(what, moving, ring, before):
    """Another board, or two, for good, also before the conditions began: the person who confirmed
    was not told. One that began anew, which may be another, while it moves."""
    of = session([seeing(0, 3), seeing(0, 2)], state=AT_SPEED if moving else AT_REST)
    of.gathered.events += [Event(ring, what, 0.0)] * before
    stops = conditions(of)
    other = what in (Happened.OTHER, Happened.TWO)
    assert (stops() is not None) == (other and before > 0)
    of.gathered.take(Event(ring, what, 1.0, "detail"))
    anew = what in (Happened.RESTARTED, Happened.CLOCK) and moving
    for still in (other or anew, other):
        said = stops()
        assert (said is not None) == still
        assert said is None or said.startswith(("one", "other")[ring])
