"""Data of a long check: what its steps read stays, live and replayed alike."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.rig.rings.protocol import Frame
from place_rings.rig.robot.state import State
from place_rings.rig.session import retention as module
from place_rings.rig.session.retention import EVERY, Retention

MARGIN = 1.5
SECONDS = 40.0


def state(time):
    return State(time, time, np.zeros(6), np.zeros(6))


def frame(ring, n, time):
    return ring, Frame(time, time, n, np.ones(2), np.zeros(2, int))


def session(seed, steps):
    """States, frames of two rings, and notes of steps, of which some are cut off."""
    rng = np.random.default_rng(seed)
    states = [state(t) for t in np.cumsum(rng.uniform(0.05, 0.2, int(SECONDS / 0.1)))]
    frames = [
        frame(ring, n, t)
        for ring in range(2)
        for n, t in enumerate(np.cumsum(rng.uniform(0.02, 0.1, int(SECONDS / 0.05))))
    ]
    notes, at = [], 0.0
    for _ in range(steps):
        begin, end = at + rng.exponential(6.0), 0.0
        end = begin + rng.exponential(2.0)
        notes.append((begin, {"what": "begin", "step": "mount", "number": 0}))
        if rng.random() < 0.8:
            notes.append((end, {"what": "end"}))
        at = end
    return states, frames, notes


def within(time, notes):
    """Whether a step reads data of this time, as slowly as can be."""
    ends = [*(at for at, _ in notes[1:]), np.inf][: len(notes)]
    return any(
        begin - MARGIN <= time <= end + MARGIN
        for (begin, said), end in zip(notes, ends, strict=True)
        if said["what"] == "begin"
    )


def thinned(states, frames, notes, every):
    """What stays of data that arrives in order of time, thinned out after ``every`` states."""
    retention, kept_states, kept_frames, count = Retention(MARGIN), [], [], itertools.count(1)
    items = [(s.time, s) for s in states] + [(f[1].time, f) for f in frames] + list(notes)
    for time, item in sorted(items, key=lambda i: i[0]):
        if isinstance(item, dict):
            retention.note(time, item)
        elif isinstance(item, tuple):
            kept_frames.append(item)
        else:
            kept_states.append(item)
            if next(count) % every == 0:
                retention.discard(kept_states, kept_frames, time)
    retention.discard(kept_states, kept_frames)
    assert retention.states == len(states) - len(kept_states)
    return [s.time for s in kept_states], [(r, f.sequence) for r, f in kept_frames]


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**31), st.integers(0, 5), st.integers(1, 400))
def test_what_a_step_reads_stays_and_little_else_whenever_it_is_decided(seed, steps, every):
    states, frames, notes = session(seed, steps)
    times, numbers = thinned(states, frames, notes, every)
    assert (times, numbers) == thinned(states, frames, notes, 10**9)
    assert {s.time for s in states if within(s.time, notes)} <= set(times)
    assert {states[0].time, states[-1].time} <= set(times)
    rest = [t for t in times if not within(t, notes)]
    assert len(rest) <= SECONDS * 1.6 + 2  # one a second
    assert set(numbers) == {
        (r, f.sequence) for r, f in frames if within(f.time, notes) or f.sequence % EVERY == 0
    }
    assert numbers == sorted(numbers, key=numbers.index)


def test_a_session_without_steps_keeps_little():
    states = [state(n / 125) for n in range(125 * 120)]
    frames = [frame(0, n, n / 25) for n in range(25 * 120)]
    times, numbers = thinned(states, frames, [], 1000)
    assert len(times) <= 122
    assert len(numbers) == -(-25 * 120 // EVERY)


@pytest.mark.parametrize("end", [None, 100.0])
def test_of_a_long_step_the_last_part_stays_and_no_more_while_it_lasts(monkeypatch, end):
    """A self check of an hour, or a person who is away in the middle of a step."""
    longest = 5.0
    monkeypatch.setattr(module, "LONGEST", longest)
    states = [state(n / 125) for n in range(125 * 120)]
    frames = [frame(0, n, n / 25) for n in range(25 * 120)]
    begin = (10.0, {"what": "begin", "step": "self", "number": 0})
    notes = [begin, *([(end, {"what": "end"})] if end else [])]
    times, numbers = thinned(states, frames, notes, 1000)
    assert (times, numbers) == thinned(states, frames, notes, 10**9)
    last = end or states[-1].time
    first = last - longest - MARGIN
    assert {s.time for s in states if first <= s.time <= last + MARGIN} <= set(times)
    assert len([t for t in times if not first <= t <= last + MARGIN]) <= 122
    retention, kept = Retention(MARGIN), []
    retention.note(*begin)
    for n, one in enumerate(states):
        kept.append(one)
        if n % 1000 == 999:
            retention.discard(kept, [], one.time)
            assert len(kept) <= 125 * (longest + MARGIN) + 122
