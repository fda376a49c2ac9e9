"""The study of robots: what it asks of its searches, what it counts and what it says of it."""

import csv
import io
import time
import tomllib
from types import SimpleNamespace

import pytest
import tomli_w
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.formats.loader import read_proposal
from place_rings.placement.search.progress import Outcome
from place_rings.placement.space.design import Space
from place_rings.studies.engine import tasks as searching
from place_rings.studies.engine.runner import TASKS
from place_rings.studies.engine.scenes import scene_from
from place_rings.studies.robots import report as robots_report
from place_rings.studies.robots import study as robots

RINGS = [
    {"link": "upper_arm", "position": 0.5, "count": 12, "tilt_deg": 30.0, "radius": 0.08},
    {"link": "tool", "count": 4, "tilt_deg": 20.0, "radius": 0.08},
]


@pytest.fixture
def small(monkeypatch):
    monkeypatch.setattr(robots, "ROBOTS", ("panda",))
    monkeypatch.setattr(robots, "PAPERS", ("n1_8_0",))
    monkeypatch.setattr(robots, "VOXEL", 0.1)
    asked = []

    def run(heading, cells):
        asked.extend(cells)
        searched = {
            "rings": RINGS,
            "processor_seconds": 12.3,
            "wall_seconds": 20.0,
            "finished": False,
        }
        return [
            searched if cell.work == "place in time" else TASKS[cell.work](**cell.arguments)
            for cell in cells
        ]

    return robots.measure(run), asked


@pytest.mark.slow
@pytest.mark.parametrize("robot", robots.ROBOTS)
def test_its_sensors_fit_on_real_mounts_of_each_robot(robot):
    """80 did not fit on a Panda and an iiwa, and the study ended there after minutes."""
    for name in ("ignore_mounted", "shadow"):
        scene = scene_from(robots.where(robot, robots.SEARCHES[name]))
        assert sum(Space(scene, sensors=robots.SENSORS).largest()) >= robots.SENSORS


def test_each_robot_is_searched_under_each_model_and_seen_under_all(small, tmp_path):
    rows, asked = small
    scenes = [cell.arguments["scene"] for cell in asked if cell.work == "place in time"]
    assert [(s["robot"], s["occlusion"]) for s in scenes] == [
        ("panda", model) for model in ("ignore", "ignore", "shadow", "blind")
    ]
    assert [scene_from(s).real for s in scenes] == [False, True, True, True]
    assert len(rows) == 4 + 1
    for row in rows:
        assert row.blind <= row.shadow <= row.ignore  # each model hides what the one before does
        assert row.unseeing <= row.sensors
        assert row.searched == (row.name in robots.SEARCHES)
    by_name = {(row.robot, row.name): row for row in rows}
    assert by_name["panda", "n1_8_0"].sensors == 24
    assert by_name["panda", "n1_8_0"].shadow < by_name["panda", "n1_8_0"].ignore

    files = robots_report.write(rows, tmp_path)
    assert (tmp_path / "robots.png").stat().st_size > 10_000
    records = list(csv.DictReader(io.StringIO(files["data.csv"])))
    assert [float(r["shadow_percent"]) for r in records] == [row.shadow for row in rows]
    page, row = files["README.md"], by_name["panda", "shadow"]
    assert f"| 16 | 2 | {row.ignore:.2f} | {row.shadow:.2f} | {row.blind:.2f} |" in page
    assert "12 * (20)" in page  # cut short
    assert "nan" not in page
    (tmp_path / "panda.toml").write_text(
        tomli_w.dumps(tomllib.loads(files["setups.toml"])["panda"])
    )
    setup, scene, _ = read_proposal(tmp_path / "panda.toml")
    assert (scene.robot.name, scene.occlusion, setup.sensors) == ("panda", "shadow", 16)


@pytest.mark.parametrize("outcome", list(Outcome))
def test_a_search_in_time_says_whether_it_came_to_its_end(outcome, monkeypatch):
    caps = []

    def found(space, options, context):
        caps.append(context.brake.limit)
        assert context.brake.clock() == pytest.approx(time.process_time(), abs=1)
        return SimpleNamespace(setup=Setup((Ring("tool", 0.0, 4),)), outcome=outcome)

    monkeypatch.setattr(searching, "searching", found)
    if outcome is Outcome.INTERRUPTED:
        with pytest.raises(KeyboardInterrupt):
            TASKS["place in time"]({}, 0, 4, 10.0)
        return
    answer = TASKS["place in time"]({}, 0, 4, 10.0)
    assert answer["finished"] == (outcome is Outcome.FINISHED)
    assert answer["rings"][0]["count"] == 4
    assert 0 < caps[0] < 10  # time is left to count
