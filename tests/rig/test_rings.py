"""The rings' lines: frames as they were sent, and each thing that happens to a line found within
its bound.
"""

import threading
import time
from contextlib import contextmanager
from itertools import repeat

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.rig.recording.records import Kind
from place_rings.rig.rings.identity import serial_text
from place_rings.rig.rings.line_monitor import LATE, SILENT, Event, Happened, Line, Port
from place_rings.rig.rings.ports import RingReaders
from place_rings.rig.rings.protocol import Frame, encode, hello
from place_rings.rig.simulated.ports import SimulatedRing

COUNT = 4
BUSY = 20.0  # s that a thread may take to wake on a busy machine


def stamped(n, clock, count=COUNT):
    """The n-th frame, at ``clock`` s of its ring's clock."""
    return encode(n, clock, np.full(count, 0.5), np.zeros(count, int))


def frame(n):
    return stamped(n, n / 20)


def judged(line, steps):
    """Events and frames of (time, bytes) in turn."""
    found = [each for now, data in steps for each in line.take(data, now)]
    return [e.what for e in found if isinstance(e, Event)], [
        f for f in found if isinstance(f, Frame)
    ]


def test_a_good_line_has_no_events_but_its_first():
    events, frames = judged(Line(0, Port("", COUNT), 0.0), [(n / 20, frame(n)) for n in range(100)])
    assert events == [Happened.BACK]
    assert len(frames) == 100


@given(st.integers(1, 40), st.binary(min_size=1, max_size=20))
def test_silence_and_garble_are_told_once_each_and_so_is_their_end(ticks, noise):
    line = Line(0, Port("", COUNT), 0.0)
    quiet = [(0.02 * n, b"") for n in range(ticks)]
    events, _ = judged(line, [*quiet, (0.02 * ticks + 0.01, frame(0))])
    assert events == [Happened.SILENT] * (0.02 * (ticks - 1) > SILENT) + [Happened.BACK]
    heard = 0.02 * ticks + 0.01
    events, _ = judged(line, [(heard + 0.02 * n, noise) for n in range(1, ticks + 1)])
    assert [e for e in events if e != Happened.NOISY] == [Happened.GARBLED] * (
        0.02 * ticks > SILENT
    )


@given(st.floats(LATE + 0.01, 0.2))
def test_frames_that_waited_on_their_way_are_not_handed_on(delay):
    steps = [(n / 20, frame(n)) for n in range(10)] + [
        (n / 20 + delay, frame(n)) for n in range(10, 15)
    ]
    events, frames = judged(
        Line(0, Port("", COUNT), 0.0), steps + [(n / 20, frame(n)) for n in range(20, 30)]
    )
    assert Happened.LATE in events
    assert [f.sequence for f in frames] == [*range(10), *range(20, 30)]


def test_lost_frames_and_a_restart_are_told():
    line = Line(0, Port("", COUNT), 0.0)
    events, _ = judged(line, [(n / 20, frame(n)) for n in range(40) if n % 4])
    assert events == [Happened.BACK, Happened.NOISY]
    events, frames = judged(line, [(3 + n / 20, frame(n)) for n in range(10)])
    assert events == [Happened.RESTARTED]
    assert len(frames) == 10


@given(st.floats(0.5, 1e6))
def test_a_clock_that_jumps_ahead_is_told_once_and_frames_go_on(ahead):
    steps = [(n / 20, stamped(n, n / 20 + ahead * (n >= 40))) for n in range(100)]
    line = Line(0, Port("", COUNT), 0.0)
    found = [each for now, data in steps for each in line.take(data, now)]
    clock = [e for e in found if isinstance(e, Event) and e.what != Happened.BACK]
    assert [e.what for e in clock] == [Happened.CLOCK]
    assert f"{ahead:.4g} s" in clock[0].detail
    frames = [f for f in found if isinstance(f, Frame)]
    assert [f.sequence for f in frames] == list(range(100))
    assert [f.era for f in frames] == [0] * 40 + [1] * 60


@given(st.floats(1.2, 50))
def test_a_clock_that_runs_fast_is_told_and_no_longer_used(rate):
    events, frames = judged(
        Line(0, Port("", COUNT), 0.0), [(n / 20, stamped(n, rate * n / 20)) for n in range(200)]
    )
    assert events.count(Happened.CLOCK) >= 1
    assert len(frames) == 200
    assert np.isnan(frames[-1].clock) or rate > 5  # each frame a jump


def test_first_frames_that_waited_are_no_wrong_clock():
    steps = [(0.6, stamped(n, n / 20)) for n in range(12)]
    steps += [(n / 20, stamped(n, n / 20)) for n in range(12, 100)]
    events, frames = judged(Line(0, Port("", COUNT), 0.0), steps)
    assert [e for e in events if e != Happened.SILENT] == [Happened.BACK]
    assert not np.isnan([f.clock for f in frames]).any()


def test_two_rings_on_a_line_are_told_by_their_hellos():
    line, steps = Line(0, Port("", COUNT), 0.0), []
    for n in range(100):
        steps.append((n / 20, frame(n)))
        if n % 10 == 0:
            steps.append((n / 20 + 0.01, hello(COUNT, 0xA0 + (n // 10) % 2)))
    events, _ = judged(line, steps)
    assert events[:3] == [Happened.BACK, Happened.OTHER, Happened.TWO]
    assert set(line.counts.serials) == {serial_text(0xA0), serial_text(0xA1)}


@given(st.floats(0, 1000), st.integers(0, 60000))
def test_two_rings_without_hellos_are_told_by_their_clocks(since, sequence):
    """Unless one starts less than 0.5 s after the other: then one ring's frames count as late."""
    line, steps = Line(0, Port("", COUNT), 0.0), []
    sequence = 0 if since < 0.5 else sequence  # else started as one
    for n in range(100):
        steps.append((10 + n / 20, stamped(n, n / 20)))
        steps.append((10.02 + n / 20, stamped(n + sequence, n / 20 + since + 0.001)))
    events, frames = judged(line, steps)
    if sequence == 0 or (8 < sequence < 32000 and since > 1):
        assert Happened.TWO in events
        assert len(frames) < 30
        assert events.count(Happened.TWO) == 1
    else:
        assert set(events) - {Happened.BACK}


def test_another_board_at_the_port_is_told():
    line = Line(0, Port("", COUNT), 0.0)
    steps = [(0.0, hello(COUNT, 7)), *((n / 20, frame(n)) for n in range(10))]
    assert judged(line, steps)[0] == [Happened.BACK]
    line.opened(1.0)
    steps = [(1.0, hello(COUNT, 8)), *((1 + n / 20, frame(n)) for n in range(10))]
    events, frames = judged(line, [*steps, (1.5, hello(COUNT, 8))])
    assert events == [Happened.OTHER]
    assert len(frames) == 10


def test_a_ring_of_another_size_is_told():
    line = Line(0, Port("", COUNT), 0.0)
    found = [
        each
        for n in range(20)
        for each in line.take(stamped(n, n / 20, COUNT + 2), n / 20)
        if isinstance(each, Event) and each.what == Happened.GARBLED
    ]
    assert all(str(count) in found[0].detail for count in (COUNT, COUNT + 2))
    assert line.counts.sizes == {COUNT + 2: 20}


class Watch:
    """What rings tell, to be waited for."""

    def __init__(self):
        self.events, self.frames, self.records, self.changed = [], [], [], threading.Condition()

    def keep(self, where, what):
        with self.changed:
            where.append(what)
            self.changed.notify_all()

    def wait(self, check, seconds=BUSY):
        with self.changed:
            assert self.changed.wait_for(check, seconds), self.events
            return check()

    def rings(self, ports):
        return RingReaders(
            ports,
            lambda ring, frame: self.keep(self.frames, (ring, frame)),
            lambda event: self.keep(self.events, event),
            lambda record: self.keep(self.records, record),
        )

    def event(self, what):
        return self.wait(lambda: next((e for e in self.events if e.what == what), None))


@contextmanager
def sending(folder, distances, **faults):
    """A simulated ring at a port, and how it sends the next of ``distances`` 100 times a second."""
    device = SimulatedRing(folder / "ring", "place-rings", np.random.default_rng(0))
    for name, value in faults.items():
        setattr(device, name, value)
    ended = threading.Event()

    def send():
        while not ended.wait(0.01):
            device.send(time.monotonic() - 100, next(distances), np.zeros(COUNT, int))

    sender = threading.Thread(target=send)
    try:
        yield device, sender.start
    finally:
        ended.set()
        if sender.ident:
            sender.join()
        device.unplug()


def test_a_ring_is_read_unplugged_and_read_again(tmp_path):
    watch, rng = Watch(), np.random.default_rng(0)
    sent = np.round(rng.uniform(0.1, 3, (5000, COUNT)), 3)
    ports = [Port(str(tmp_path / name), COUNT) for name in ("ring", "none")]
    with sending(tmp_path, iter(sent)) as (device, start), watch.rings(ports) as rings:
        assert watch.event(Happened.GONE).ring == 1
        watch.wait(lambda: any(r.kind == Kind.OPENED for r in watch.records))
        start()
        watch.wait(lambda: len(watch.frames) >= 10)
        for ring, got in watch.frames[:10]:
            assert ring == 0
            np.testing.assert_allclose(got.distance, sent[got.sequence])
        assert rings.latest()[1] is None
        watch.wait(lambda: rings.latest()[0])
        watch.events.clear()
        device.unplug()
        watch.event(Happened.GONE)
        device.plug()
        watch.event(Happened.BACK)
        watch.events.clear()
        device.silent = True
        watch.event(Happened.SILENT)
        assert rings.latest()[0] is None
    kept = b"".join(r.data for r in watch.records if r.kind == Kind.BYTES)
    assert len([*judged(Line(0, Port("", COUNT), 0.0), [(0.0, kept)])[1]]) >= 10


def test_a_port_in_use_is_not_shared(tmp_path):
    watch, other, port = Watch(), Watch(), Port(str(tmp_path / "ring"), COUNT)
    with sending(tmp_path, iter(())), watch.rings([port]):
        watch.wait(lambda: any(r.kind == Kind.OPENED for r in watch.records))
        with other.rings([port]):
            assert "lock" in other.event(Happened.GONE).detail


@pytest.mark.parametrize(
    ("fault", "told"),
    [
        ({"corrupt": 0.01}, Happened.NOISY),
        ({"disorder": 0.2}, Happened.NOISY),
        ({"garble": True}, Happened.GARBLED),
    ],
)
def test_a_spoiled_line_is_told(tmp_path, fault, told):
    watch, true = Watch(), np.array([0.1, 0.2, 0.3, 0.4])
    port = Port(str(tmp_path / "ring"), COUNT)
    with sending(tmp_path, repeat(true), **fault) as (_, start), watch.rings([port]):
        start()
        watch.event(told)
    assert all(np.array_equal(f.distance, true) for _, f in watch.frames)
    assert [f.sequence for _, f in watch.frames] == sorted({f.sequence for _, f in watch.frames})
