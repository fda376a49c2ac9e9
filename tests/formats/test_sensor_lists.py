"""A list of sensors read back into rings: there and back again, and what is refused."""

import contextlib
import io
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.rings.ring import Ring, Setup, named_setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.robots.built_in import PAPER_ROBOTS, ROBOTS
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.formats.loader import resolve
from place_rings.formats.sensors.sensor_lists import (
    COLUMNS,
    SQUARE_COLUMNS,
    mounted_setup,
    sensor_list,
)
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.reporting.terminal import say_lines

from ..support import drawing
from ..support.refusals import has_parts

PRINTED = 5e-10  # m, and of unit vectors: half the last decimal of a list


def listed(setup: Setup, scene: Scene) -> str:
    """What ``place-rings cones`` prints."""
    with contextlib.redirect_stdout(io.StringIO()) as out:
        say_lines(sensor_list(setup, scene))
    return out.getvalue()


@given(drawing.seeds, st.sampled_from(PAPER_ROBOTS), st.integers(1, 2))
def test_what_cones_lists_is_read_back(seed, robot, poses):
    """Phases are as exact as apexes over the radius. A ring of one sensor may be read as another
    that has the same one.
    """
    rng = np.random.default_rng(seed)
    scene = Scene.paper(
        robot=ROBOTS[robot], poses=tuple(Pose(drawing.pose(rng)) for _ in range(poses))
    )
    setup = drawing.setup(rng)
    again = mounted_setup("list", listed(setup, scene), scene)
    for before, after in zip(setup.rings, again.rings, strict=True):
        assert after.count == before.count
        assert (after.sensor.fov, after.sensor.range_m) == pytest.approx(
            (before.sensor.fov, before.sensor.range_m), abs=2 * PRINTED
        )
        if before.count == 1 and robot == "ur10_dh":
            continue  # links in one plane: which of them has the sensor is not to be seen
        length = scene.robot.mount(before.link).length
        assert after.link == before.link
        assert after.radius == pytest.approx(before.radius, abs=3 * PRINTED)
        assert after.tilt == pytest.approx(before.tilt, abs=1e-8 / before.radius)
        assert after.position * length == pytest.approx(before.position * length, abs=3 * PRINTED)
        assert (
            abs(math.remainder(after.phase - before.phase, 2 * math.pi))
            <= 3 * PRINTED / before.radius
        )
    for pose in scene.poses:
        a, b = (sensor_cones(scene.robot, s, pose.q) for s in (setup, again))
        np.testing.assert_allclose(b.apex, a.apex, atol=1e-8)
        np.testing.assert_allclose(b.axis, a.axis, atol=1e-7)


def test_a_setup_of_the_paper_comes_back_to_a_billionth():
    setup, scene = named_setup("n3_16_55"), Scene.paper()
    again = mounted_setup("list", listed(setup, scene), scene)
    for before, after in zip(setup.rings, again.rings, strict=True):
        assert (after.link, after.count, after.radius) == (before.link, before.count, 0.08)
        assert after.sensor == before.sensor
        places = [(ring.position, ring.tilt) for ring in (after, before)]
        assert places[0] == pytest.approx(places[1], abs=1e-9)
        assert abs(math.remainder(after.phase, 2 * math.pi)) < 1e-8


def test_a_phase_just_short_of_a_turn_is_no_turn():
    text = listed(Setup((Ring("forearm", 0.4, 12, 0.3, -2e-8),)), Scene.paper())
    (ring,) = mounted_setup("list", text, Scene.paper()).rings
    assert ring.phase == pytest.approx(-2e-8, abs=2e-8)


@given(drawing.seeds)
def test_a_measured_setup_comes_back_about_as_well_as_it_was_measured(seed):
    """Errors up to 0.5 mm of apexes and 0.3 degrees of axes stay within the tolerance and average
    out.
    """
    rng, scene = np.random.default_rng(seed), Scene.paper()
    before = Ring("forearm", 0.4, 12, math.radians(-30), 0.1)
    rows = [line.split(",") for line in listed(Setup((before,)), scene).splitlines()]
    for row in rows[1:]:
        row[3:6] = [str(float(v) + rng.uniform(-1, 1) * 0.5e-3) for v in row[3:6]]
        axis = np.array(row[6:9], float) + rng.uniform(-1, 1, 3) * math.radians(0.3)
        row[6:9] = [str(v) for v in axis / np.linalg.norm(axis)]
    order = [0, *(1 + rng.permutation(before.count))]
    (after,) = mounted_setup("list", "\n".join(",".join(rows[i]) for i in order), scene).rings
    assert after.link == "forearm"
    assert after.position == pytest.approx(before.position, abs=0.001)
    assert (after.tilt, after.phase) == pytest.approx(
        (before.tilt, before.phase), abs=math.radians(0.7)
    )


def test_a_list_serves_as_a_proposal(tmp_path):
    (tmp_path / "mounted.csv").write_text(
        "\ufeff" + listed(named_setup("n2_16_25"), Scene.paper()), encoding="utf-8"
    )
    setup, scene = resolve(str(tmp_path / "mounted.csv"), Scene.paper())
    assert [r.count for r in setup.rings] == [16] * 5
    assert scene == Scene.paper(poses=scene.poses)


@given(drawing.seeds)
def test_square_beams_are_read_back(seed):
    """Rings of square beams among those of cones, also where a list turns ``up`` over, which is the
    same beam.
    """
    rng, q = np.random.default_rng(seed), np.radians([10.0, -70, 60, -105, -90, 5])
    scene = Scene.paper(poses=(Pose(q),))
    rings = [replace(ring, count=ring.count + 1) for ring in drawing.setup(rng).rings]
    rings[0] = replace(rings[0], sensor=Sensor(0.5, 1.2, None, float(rng.uniform(0.1, 1.0))))
    text = listed(Setup(tuple(rings)), scene)
    assert text.splitlines()[0] == ",".join(SQUARE_COLUMNS)
    for before, after in zip(rings, mounted_setup("list", text, scene).rings, strict=True):
        assert (after.link, after.count) == (before.link, before.count)
        assert after.sensor.fov == pytest.approx(before.sensor.fov, abs=1e-9)
        assert after.sensor.fov_up == pytest.approx(before.sensor.fov_up, abs=1e-9)
        assert after.tilt == pytest.approx(before.tilt, abs=1e-8 / before.radius)
    rows = [line.split(",") for line in text.splitlines()]
    up = [SQUARE_COLUMNS.index(f"up_{x}") for x in "xyz"]
    for row in rows[1:]:
        for i in up:
            row[i] = str(-float(row[i]))
    over = mounted_setup("list", "\n".join(map(",".join, rows)), scene)
    assert over.rings[0].sensor.fov_up is not None
    axis = [SQUARE_COLUMNS.index(f"axis_{x}") for x in "xyz"]
    for row in rows[1:]:  # rolled about its axis by 45 degrees, which no ring does
        a, u = (np.array([float(row[i]) for i in which]) for which in (axis, up))
        for i, v in zip(up, (u + np.cross(a, u)) / math.sqrt(2), strict=True):
            row[i] = str(v)
    rolled = mounted_setup("list", "\n".join(map(",".join, rows)), scene)
    assert rolled.singles


def edited(change) -> str:
    """The list of n2_3_25 with its fields changed, header and rows, by ``change``."""
    rows = [line.split(",") for line in listed(named_setup("n2_3_25"), Scene.paper()).splitlines()]
    change(rows)
    return "\n".join(",".join(row) for row in rows)


def put(line: int, column: str, value: str):
    return lambda rows: rows[line - 1].__setitem__(COLUMNS.index(column), value)


def cut(start, stop=None):
    return lambda rows: rows.__delitem__(slice(start, stop))


MALFORMED = {
    "empty": (cut(0), "columns"),
    "header alone": (cut(1), "no sensor"),
    "another header": (put(1, "axis_x", "direction_x"), "columns"),
    "a field too few": (lambda rows: rows[4].pop(), "line 5"),
    "a field too many": (lambda rows: rows[4].append("0"), "line 5"),
    "no number": (put(5, "apex_y", "abc"), "line 5 apex_y"),
    "not finite": (put(5, "apex_y", "nan"), "line 5 apex_y"),
    "too wide": (put(5, "fov_deg", "180"), "line 5 fov_deg"),
    "unknown pose": (put(5, "pose", "1"), "line 5 pose"),
    "negative index": (put(5, "sensor", "-1"), "line 5 sensor"),
    "a sensor twice": (put(4, "sensor", "1"), "ring 0 sensor 1"),
    "a sensor missing": (cut(2, 3), "ring 0 sensor 1"),
    "a ring missing": (cut(4, 7), "ring 1"),
    "two kinds of sensors": (put(3, "range_m", "1.4"), "ring 0"),
    "an axis too long": (lambda rows: rows[2].__setitem__(slice(6, 9), ["0.8"] * 3), "length"),
    "quotes": (lambda rows: rows[1].__setitem__(0, '"0'), ""),
}


@pytest.mark.parametrize(("change", "parts"), MALFORMED.values(), ids=MALFORMED.keys())
def test_a_malformed_list_is_one_line_and_exit_code_2(run, change, parts, tmp_path):
    (tmp_path / "mounted.csv").write_text(edited(change))
    code, out, err = run("improve", "mounted.csv", "--out", "better")
    assert (code, out) == (2, "")
    assert has_parts(err, f"mounted.csv {parts}"), err
    assert [path.name for path in tmp_path.iterdir()] == ["mounted.csv"]


def test_a_list_of_another_pose_is_of_single_sensors():
    other = Pose(np.radians([0.0, -80, 60, -105, -90, 0]))
    text = listed(named_setup("n2_16_25"), Scene.paper(poses=(other,)))
    found = mounted_setup("list", text, Scene.paper())
    assert found.sensors == 80
    assert len(found.singles) > 30
