"""Doubtful sensors are never "as proposed": intermittent ones, phantoms, codes of another chip.

Public sources of the faults: https://github.com/stm32duino/VL53L1X/issues/7 (short phantoms with a
valid status); https://github.com/sparkfun/SparkFun_VL53L1X_Arduino_Library/issues/30 and
https://github.com/stm32duino/VL53L4CX/issues/5 (status codes).
"""

import struct
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.formats.ring_status import CHIPS, likely_chip
from place_rings.rig.check.doubt import KINDS, MOST, doubt
from place_rings.rig.poses.clear import drawn
from place_rings.rig.rings.protocol import Status, encode
from place_rings.rig.sensing.expected import expected
from place_rings.rig.sensing.readings import WEAK
from place_rings.rig.simulated_cell.ground_truth import injected
from place_rings.rig.simulated_cell.world import World
from place_rings.simulation.twin.noise import Noise

from ..support.drawing import seeds
from .cell import SCENE, SETUP
from .commands import call, proposed
from .still import checked_still

Q = SCENE.poses[0].q[None]


@cache
def usual():
    return expected(SCENE, SETUP, Q).distance[0]


@cache
def sure():
    return np.flatnonzero((usual() > 0.4) & (usual() < 1.2))


def spoiled(rng, kind, read, which):
    """Readings of which ``which`` are spoiled."""
    distance, status = read.distance.copy(), read.status.copy()
    n = which.sum()
    match kind:
        case "failed":
            distance[which], status[which] = np.nan, Status.FAILED
        case "missing":
            distance[which] = np.nan
            status[which] = Status.NO_TARGET
        case "near":
            distance[which] = rng.uniform(0.001, 0.049, n)
            status[which] = np.where(rng.random(n) < 0.5, status[which], WEAK)
        case "apart":
            distance[which] -= rng.uniform(0.2, 0.3) + rng.normal(0, 0.01, n)
        case "absent":
            return read.only(~which)
        case "together":
            part = np.array_split(rng.permutation(np.flatnonzero(which)), 4)
            for some, each in zip(part, KINDS[:3], strict=False):
                mine = np.zeros(len(which), bool)
                mine[some] = True
                read = spoiled(rng, each, read, mine)
            gone = np.zeros(len(which), bool)
            gone[part[3]] = True
            return read.only(~gone)
    return replace(read, distance=distance, status=status)


@settings(max_examples=20, deadline=None)
@given(seeds, st.sampled_from(KINDS), st.floats(0.25, 0.95), st.integers(20, 80))
def test_a_doubtful_sensor_is_found_by_its_kind_and_no_other_one(seed, kind, share, frames):
    rng, k = np.random.default_rng(seed), int(np.random.default_rng(seed).choice(sure()))
    # beyond, the others are the phantoms, or one kind alone is enough
    share = {"apart": min(share, 0.5), "together": min(share, 0.45)}.get(kind, share)
    read = World(SCENE, SETUP, noise=Noise(lost=0.0)).readings(rng, Q, frames)
    mine = np.flatnonzero(read.wire(SETUP) == k)
    which = np.zeros(len(read), bool)
    which[rng.choice(mine, round(share * len(mine)), replace=False)] = True
    found = doubt(SCENE, SETUP, spoiled(rng, kind, read, which), Q)
    assert found.found[KINDS.index(kind), k]
    assert found.shares[KINDS.index(kind), k] == pytest.approx(share, abs=0.06)
    assert not np.delete(found.found, k, axis=1).any()


@settings(max_examples=15, deadline=None)
@given(seeds, st.floats(0, 0.05), st.integers(20, 40))
def test_usual_noise_and_loss_are_no_doubt(seed, lost, frames):
    joints, rng = np.concatenate([Q, drawn(SCENE, 4, seed % 20)]), np.random.default_rng(seed)
    world = World(SCENE, SETUP, noise=Noise(lost=lost))
    for some in (joints, Q):
        found = doubt(SCENE, SETUP, world.readings(rng, some, frames), some)
        assert not found.found.any()


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 60))
def test_a_ring_that_sits_elsewhere_and_sees_the_robot_is_no_doubt(seed):
    done, rng = injected(SCENE, SETUP, seed), np.random.default_rng(seed)
    joints = np.concatenate([Q, drawn(SCENE, 6, seed)])
    read = done.world(SCENE).readings(rng, joints, 8)
    found = doubt(SCENE, SETUP, read, joints)
    assert np.argwhere(found.found).tolist() == [[KINDS.index("failed"), done.dead]]


def test_a_sensor_without_readings_is_doubtful():
    read = World(SCENE, SETUP).readings(np.random.default_rng(0), Q, 20)
    found = doubt(SCENE, SETUP, read.only(read.wire(SETUP) != 3), Q)
    assert np.argwhere(found.found).tolist() == [[KINDS.index("failed"), 3]]


def packed(n, mm, codes):
    sensors = b"".join(struct.pack("<HB", *each) for each in zip(mm, codes, strict=True))
    return b"\x5a\x5a" + struct.pack("<H", n) + sensors


def mm_of(distance):
    return [round(1000 * d) if np.isfinite(d) else 0 for d in distance]


def split(values):
    return values[:8], values[8:]


def sends(distance):
    """Rings that send the distances (K,) of frame n."""

    def sent(ring, n):
        each = split(distance(n))[ring]
        status = np.where(np.isfinite(each), Status.VALID, Status.NO_TARGET)
        return encode(n, n / 25, np.nan_to_num(each, posinf=0.0), status)

    return sent


def test_a_rig_with_half_phantoms_differs_and_a_good_one_does_not(tmp_path):
    k = int(sure()[0])

    def phantoms(n):
        return np.where((np.arange(14) == k) & (n % 2 == 0), 0.02, usual())

    code, told = checked_still(tmp_path / "good", SCENE, SETUP, sends(lambda n: usual()))
    assert (code, told["reasons"]) == (0, [])
    code, told = checked_still(tmp_path / "bad", SCENE, SETUP, sends(phantoms))
    assert (code, told["verdict"]) == (1, "differs")
    assert len(told["sensors"]) == 14
    (one,) = [each for each in told["sensors"] if each["doubtful"]]
    assert one["sensor"] == f"{0 if k < 8 else 1}:{k if k < 8 else k - 8}"
    assert one["near_percent"] == pytest.approx(50, abs=2)


def test_a_doubtful_sensor_in_files_differs(tmp_path):
    names = [f"tof_0_{i}" for i in range(8)] + [f"tof_1_{i}" for i in range(6)]
    q = ",".join(f"{v:.6f}" for v in Q[0])
    joints = "time,shoulder_pan,shoulder_lift,elbow,wrist_1,wrist_2,wrist_3"
    rows = [joints, *(f"{n / 50:.3f},{q}" for n in range(200))]
    (tmp_path / "joints.csv").write_text("\n".join(rows))
    small = proposed(tmp_path, SETUP, SCENE)
    for k, code, word in (
        (None, 0, ""),
        (int(sure()[-1]), 1, "inf"),
        (int(sure()[-1]), 1, "absent"),
    ):
        read = [
            (n / 25 + i / 1000, name, word if i == k and n % 3 == 0 else usual()[i])
            for n in range(95)
            for i, name in enumerate(names)
        ]
        rows = [f"{t:.4f},{name},{value}" for t, name, value in read if value != "absent"]
        (tmp_path / "readings.csv").write_text("\n".join(["time,sensor,range_m", *rows]))
        words = ["--joints", tmp_path / "joints.csv", "--readings", tmp_path / "readings.csv"]
        out = tmp_path / f"out{word}"
        assert call("check", small, *words, "--part", "self", "--out", out) == code


CODES = {
    "esp32-l5cx": ([5] * 9 + [9], 255),
    "esp32-l1x": ([0] * 9 + [1], 4),
    "esp32-l1x-raw": ([9] * 9 + [6], 4),
}


@pytest.mark.parametrize("name", CODES)
def test_codes_of_a_chip_are_named_and_its_decoder_reads_them(name, tmp_path):
    (valid, none), chip = CODES[name], next(one for one in CHIPS if one.decoder == name)

    def sent(ring, n):
        distance = split(usual())[ring]
        codes = [valid[n % 10] if np.isfinite(d) else none for d in distance]
        return packed(n, mm_of(distance), codes)

    code, told = checked_still(tmp_path / "right", SCENE, SETUP, sent, name)
    assert (code, told["lines"][0]["unknown_codes"]) == (0, {})
    code, told = checked_still(tmp_path / "wrong", SCENE, SETUP, sent, "esp32")
    assert code == 1
    for line in told["lines"]:
        if np.isfinite(split(usual())[line["ring"]]).any():
            assert line["codes_of"] == chip.chip
        shares = line["unknown_codes"]
        for sensor, distance in enumerate(split(usual())[line["ring"]]):
            if np.isfinite(distance) and name != "esp32-l1x":  # whose 0 is known
                assert shares[str(sensor)][str(valid[0])] == pytest.approx(90, abs=3)
            if np.isfinite(distance):
                assert shares[str(sensor)][str(valid[-1])] == pytest.approx(10, abs=3)


def test_codes_of_the_ring_protocol_are_no_doubt_whatever_stands_beside_them(tmp_path):
    """Firmwares leave old distances beside the status of no target; lines spoil a byte."""
    for spoils in (False, True):

        def sent(ring, n, spoils=spoils):
            distance = split(usual())[ring]
            codes = np.where(np.isfinite(distance), Status.VALID, Status.NO_TARGET)
            codes[0] = 4 if spoils and n == 7 else codes[0]
            return packed(n, [mm or 1806 for mm in mm_of(distance)], codes)

        code, told = checked_still(tmp_path / str(spoils), SCENE, SETUP, sent, "esp32")
        found = [
            {key: [*each] for key, each in one["unknown_codes"].items()} for one in told["lines"]
        ]
        assert (code, found) == (0, [{"0": ["4"]} if spoils else {}] * 2)
        assert len(told["warnings"]) == 2 * spoils


def test_codes_that_no_chip_explains_have_no_likely_chip():
    codes = np.zeros(256, int)
    codes[[77, 2]] = 5
    assert likely_chip(codes) is None


def test_a_sensor_of_lines_of_text_that_fails_often_differs(tmp_path):
    k = int(sure()[sure() < 8][0])

    def line(ring, n):
        words = [str(mm or 8190) for mm in mm_of(split(usual())[ring])]
        if ring == 0 and n % 3 == 0 and n > 9:
            words[k] = "-1185"
        return f"{'VL53 ring ready' if n == 20 else ','.join(words)}\n".encode()

    code, told = checked_still(tmp_path, SCENE, SETUP, line, "text", 90)
    assert code == 1
    doubtful = {one["sensor"]: one["failed_percent"] for one in told["sensors"] if one["doubtful"]}
    assert doubtful == {f"0:{k}": pytest.approx(100 / 3, abs=5)}
    assert doubtful[f"0:{k}"] > 100 * MOST
    for one in told["lines"]:
        assert one["corrupt"] == 1
        assert "VL53 ring ready" in one["foreign"]
