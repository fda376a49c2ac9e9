"""Records and recordings: what was written is read, through any cut, kill or full disk, and
replayed as it was.
"""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from place_rings.rig.recording.clocks import Lag, align
from place_rings.rig.recording.recording import Recording, RecordingReader
from place_rings.rig.recording.records import (
    MOST_TIME,
    DamagedError,
    Kind,
    Record,
    RecordReader,
)
from place_rings.rig.rings.line_monitor import Event, Happened, Port
from place_rings.rig.rings.protocol import Frame, encode
from place_rings.rig.robot.state import State
from place_rings.rig.robot.vetting import Ended
from place_rings.rig.session.gathering import Gathered, replay

from ..support.refusals import refused
from .tape import rows

records = st.builds(
    Record,
    st.sampled_from(Kind),
    st.integers(0, 255),
    st.floats(-MOST_TIME, MOST_TIME),
    st.binary(max_size=100),
)


@given(st.lists(records, max_size=10), st.lists(st.integers(0, 2000), max_size=10))
def test_records_come_back_however_they_are_cut(wanted, cuts):
    data, reader, found = b"".join(r.pack() for r in wanted), RecordReader(), []
    edges = [0, *sorted(min(c, len(data)) for c in cuts), len(data)]
    for i in range(len(edges) - 1):
        found += reader.feed(data[edges[i] : edges[i + 1]])
    assert found == wanted
    assert not reader.left


def _fed_until_damage(reader, data):
    found = []
    for _ in range(10):
        try:
            found += reader.feed(data)
        except DamagedError:
            return found
        data = bytes(1 << 21)  # whatever length it claims to have
    raise AssertionError("no damage was found")


@given(st.lists(records, min_size=1, max_size=5), st.data())
def test_damage_is_never_taken_for_a_record(wanted, data):
    good = b"".join(r.pack() for r in wanted)
    at = data.draw(st.integers(0, len(good) - 1))
    bad, reader, found = bytearray(good), RecordReader(), list[Record]()
    bad[at] ^= data.draw(st.integers(1, 255))
    found += _fed_until_damage(reader, bytes(bad))
    assert found == wanted[: len(found)]
    assert len(b"".join(r.pack() for r in found)) <= at


@given(st.binary(max_size=300))
def test_any_bytes_are_records_or_damage(data):
    reader = RecordReader()
    try:
        reader.feed(data)
        reader.feed(b"")
    except DamagedError:
        return
    assert reader.left <= len(data)


def test_a_torn_tail_costs_the_last_record_alone(tmp_path):
    whole = [Record(Kind.BYTES, 0, float(i), bytes([i])) for i in range(5)]
    with Recording(tmp_path / "whole", {}) as recording:
        for record in whole:
            recording.put(record)
    data = (tmp_path / "whole").read_bytes()
    size, end = len(whole[0].pack()), len(Record(Kind.END, 0, 0.0).pack())
    for lost in range(1, 5 * size + end):
        (tmp_path / "torn").write_bytes(data[:-lost])
        recorded = RecordingReader(tmp_path / "torn")
        found = [r for r in recorded.records() if r.kind == Kind.BYTES]
        left = max(lost - end, 0)
        assert found == whole[: 5 - -(-left // size)]
        assert not recorded.ended
        assert bool(recorded.damage) == (lost != end and (left == 0 or left % size != 0))
    recorded = RecordingReader(tmp_path / "whole")
    assert list(recorded.records())[1:-1] == whole
    assert recorded.ended
    assert not recorded.damage


@pytest.mark.parametrize(
    "data", [b"", b"PR", b"not a recording", Record(Kind.ABOUT, 0, 0.0, b"[]").pack()]
)
def test_what_is_no_recording_is_refused(tmp_path, data):
    (tmp_path / "file").write_bytes(data)
    with refused(tmp_path / "file"):
        RecordingReader(tmp_path / "file")
    with refused(tmp_path / "nothing"):
        RecordingReader(tmp_path / "nothing")
    with refused(tmp_path / "file"):
        Recording(tmp_path / "file", {})


@pytest.mark.parametrize("time_", [float("nan"), float("inf"), -float("inf"), 1e300])
@pytest.mark.parametrize("kind", [Kind.BYTES, Kind.STATE, Kind.EVENT, Kind.HAPPENED, Kind.OPENED])
def test_a_record_without_a_possible_time_is_damage(tmp_path, kind, time_):
    path, data = tmp_path / "file", encode(0, 1.0, np.ones(3), np.zeros(3, int))
    with Recording(path, {}) as recording:
        recording.put(Record(Kind.BYTES, 0, 1.0, data))
        recording.put(Record(kind, 0, time_, data))
        recording.put(Record(Kind.BYTES, 0, 2.0, data))
    recorded = RecordingReader(path)
    found = replay(recorded.records(), [Port("", 3)])
    assert len(found.frames) == 1
    assert f"{time_:g} s" in recorded.damage


WRITER = """
import sys, time
from pathlib import Path
from place_rings.rig.recording.recording import Recording
from place_rings.rig.recording.records import Kind, Record
recording = Recording(Path(sys.argv[1]), {})
for i in range(10**9):
    recording.put(Record(Kind.BYTES, 0, float(i), bytes(50)))
    if recording.failure: sys.exit(print("full", recording.failure))
    print(i, flush=True)
"""


def test_what_was_put_survives_a_kill(tmp_path):
    with subprocess.Popen(
        [sys.executable, "-c", WRITER, tmp_path / "file"], stdout=subprocess.PIPE
    ) as writer:
        for _ in range(300):
            writer.stdout.readline()
        writer.send_signal(signal.SIGKILL)
        said = writer.stdout.read().splitlines()
    last = int(said[-1]) if said else 299
    times = [r.time for r in RecordingReader(tmp_path / "file").records() if r.kind == Kind.BYTES]
    assert times == [float(i) for i in range(len(times))]
    assert len(times) in (last + 1, last + 2)


def test_a_full_disk_ends_the_recording_at_a_whole_record_and_is_told(tmp_path):
    limit = """
import resource, signal
resource.setrlimit(resource.RLIMIT_FSIZE, (5000, 5000))
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
"""
    command = [sys.executable, "-c", limit + WRITER, tmp_path / "file"]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    assert said[-1].startswith("full")
    recorded = RecordingReader(tmp_path / "file")
    assert len([r for r in recorded.records() if r.kind == Kind.BYTES]) == len(said) - 1
    assert not recorded.damage


def test_a_device_without_room_is_told(tmp_path):
    os.symlink("/dev/full", tmp_path / "full")
    recording = Recording(tmp_path / "new", {})
    os.close(recording._file)
    recording._file = os.open(tmp_path / "full", os.O_WRONLY)
    for _ in range(3):
        recording.put(Record(Kind.NOTE, 0, 0.0))
    recording.close()
    assert "No space left" in recording.failure


def test_a_replay_gathers_what_the_rig_told(tmp_path):
    """A session written by hand: a ring that is plugged in again, a robot that ends by a jump."""
    rng, q = np.random.default_rng(0), np.zeros(6)
    gathered, path = Gathered(), tmp_path / "file"
    with Recording(path, {}) as recording:
        for n in range(500):
            t = 50 + n / 125
            state = State(t, 3 + n / 125, q + 0.001 * n, np.full(6, 0.125))
            if n == 450:
                state = State(t, 3 + n / 125, q + 2, np.zeros(6))
            recording.put(Record(Kind.STATE, 0, t, state.pack()))
            if n % 10 == 0:
                recording.put(
                    Record(
                        Kind.BYTES,
                        0,
                        t,
                        encode(n // 10, 0.5 + n / 125, rng.uniform(0.1, 2, 3), np.zeros(3, int)),
                    )
                )
            if n == 204:
                recording.put(Event(0, Happened.GONE, t, "pulled").record())
                recording.put(Record(Kind.OPENED, 0, t))
        recording.put(Record(Kind.EVENT, 0, 99.0, b'{"what": "rod", "place": [1, 2, 3]}'))
    found = replay(RecordingReader(path).records(), [Port("gone by now", 3)])
    assert found.fault.why == Ended.GARBLED
    assert found.fault.time == 50 + 450 / 125
    assert len(found.states) == 450
    assert [e.what for e in found.events] == [Happened.GONE]
    assert [said for _, said in found.said] == [{"what": "rod", "place": [1, 2, 3]}]
    time_, joints, ring, sensor, distance, status = rows(found)
    assert len(found.frames) == 50
    assert len(time_) == 3 * 45  # none of those after the robot's end
    np.testing.assert_allclose(joints, 0.001 * 125 * (time_ - 50)[:, None] * np.ones(6), atol=1e-5)
    assert sensor.tolist() == [0, 1, 2] * 45
    assert not ring.any()
    assert not status.any()
    assert np.isfinite(distance).all()
    assert len(gathered.readings()) == 0


@example(b"1", Kind.EVENT)
@given(
    st.binary(max_size=60),
    st.sampled_from([Kind.EVENT, Kind.HAPPENED, Kind.STATE, Kind.BYTES, Kind.OPENED, Kind.NOTE]),
)
def test_a_replay_passes_over_what_it_cannot_read(tmp_path_factory, data, kind):
    path = tmp_path_factory.mktemp("replay") / "file"
    with Recording(path, {}) as recording:
        recording.put(Record(kind, 0, 1.0, data))
        recording.put(Record(kind, 200, 1.0, data))
        recording.put(Record(Kind.EVENT, 0, 2.0, b'{"what": "after"}'))
    found = replay(RecordingReader(path).records(), [Port("", 3)])
    assert (found.said[-1][1], found.frames, found.states) == ({"what": "after"}, [], [])
    assert all(isinstance(said, dict) for _, said in found.said)


@given(
    st.integers(0, 2**32 - 1),
    st.floats(-1.5e-4, 1.5e-4),
    st.sampled_from([10.0, 100.0]),
    st.floats(-1e6, 1e6),
)
def test_clocks_are_aligned_through_delays_and_outliers(seed, drift, rate, start):
    rng, n = np.random.default_rng(seed), int(60 * rate)
    clock = np.arange(n) / rate
    delay = rng.exponential(0.002, n) + 0.05 * (rng.random(n) < 0.02)
    time_ = start + (1 + drift) * clock + delay
    wild = rng.random(n) < 0.02
    found = align(time_ + np.where(wild, rng.uniform(-1, 1, n), 0), clock)
    assert found.drift == pytest.approx(drift, abs=5e-5)
    np.testing.assert_allclose(found.host(clock), start + (1 + drift) * clock, atol=3e-3)
    assert found.low <= found.drift <= found.high
    assert align(time_[:9], clock[:9]) is None


def delayed(rng, sent):
    """Arrivals on a machine that pauses now and then for up to 0.3 s; none overtakes another."""
    pause = np.where(rng.random(len(sent)) < 0.05, rng.uniform(0, 0.3, len(sent)), 0.0)
    return np.maximum.accumulate(sent + 0.001 + pause)


def timed(arrived, clock, sequence=None, era=None):
    """The times of measurement of a ring's frames."""
    n, none = len(arrived), np.zeros(1)
    sequence = np.arange(n) if sequence is None else sequence
    era = np.zeros(n) if era is None else era
    gathered = Gathered()
    gathered.frames = [
        (0, Frame(t, c, int(s) % 65536, none, none.astype(int), int(e)))
        for t, c, s, e in zip(arrived, clock, sequence, era, strict=True)
    ]
    states = np.arange(arrived[0] - 1, arrived[-1] + 1, 0.04)
    gathered.states = [State(t, t, np.zeros(6), np.zeros(6)) for t in states]
    return rows(gathered)[0]


@given(st.integers(0, 2**32 - 1), st.floats(0, 65535))
def test_a_frame_that_came_late_has_the_time_of_its_measurement_by_clock_or_by_number(seed, first):
    rng, sent = np.random.default_rng(seed), 50 + np.arange(300) / 20
    arrived, none = delayed(rng, sent), np.full(300, np.nan)
    number = int(first) + np.arange(300)
    for clock in (1.00004 * sent - 7, none):
        some = np.ones(300, bool) if np.isnan(clock).all() else arrived - sent < 0.1  # as lines do
        times = timed(arrived[some], clock[some], number[some])
        np.testing.assert_allclose(np.sort(times), sent[some], atol=0.01)
    uneven = np.cumsum(rng.uniform(0.02, 0.2, 300))  # its numbers are no clock
    arrived = delayed(rng, uneven)
    np.testing.assert_array_equal(timed(arrived, none, number), arrived)


@given(st.integers(0, 2**32 - 1), st.floats(-1e5, 1e5), st.integers(20, 380))
def test_a_clock_that_jumps_moves_no_other_frame(seed, ahead, at):
    rng, sent = np.random.default_rng(seed), 50 + np.arange(400) / 20
    later = np.arange(400) >= at
    arrived = delayed(rng, sent)
    some = arrived - sent < 0.1
    times = timed(arrived[some], (sent + ahead * later)[some], era=later[some])
    np.testing.assert_allclose(np.sort(times), sent[some], atol=0.01)


@given(st.floats(0.05, 5), st.floats(-1e-4, 1e-4))
def test_lag_tells_a_delay_through_an_hour_of_drift(delay, drift):
    lag = Lag()
    for second in range(0, 3600, 5):
        assert abs(lag.delay(1000 + second, 5 + (1 + drift) * second)) < 2e-3
    assert lag.delay(1000 + 3600 + delay, 5 + (1 + drift) * 3600) == pytest.approx(delay, abs=5e-3)


def test_an_event_comes_back():
    event = Event(3, Happened.NOISY, 1.5, "so")
    assert Event.of(event.record()) == event
    for data in (b"", b"[]", json.dumps(["NONE", ""]).encode(), b"[1,2]"):
        with refused(error=ValueError):
            Event.of(Record(Kind.HAPPENED, 0, time.monotonic(), data))
