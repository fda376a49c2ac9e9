"""The report: what it says against what is counted, lengths against geometry, and a page that
nothing leads out of.
"""

import hashlib
import io
import json
import re
import shlex
import signal
import sys
from contextlib import redirect_stdout, suppress
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from place_rings.cli import app as command_line
from place_rings.coverage.definitions.escaping import printable
from place_rings.coverage.rings.ring import Ring, Setup, named_setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.robots.built_in import ROBOTS
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.sensors.catalogue import MODELS
from place_rings.coverage.sensors.effective_range import Use
from place_rings.coverage.sensors.sensor import effective
from place_rings.coverage.solids.spheres import sphere
from place_rings.coverage.voxels.octree import voxels
from place_rings.formats.loader import how_found, resolve
from place_rings.formats.ring_frame import frame_length
from place_rings.formats.schema.written_models import ReportResult
from place_rings.objectives.blind_spots import Beside, BlindSpot
from place_rings.objectives.detection_share import detected
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import Verifier
from place_rings.reporting import comparison
from place_rings.reporting.lines.detection import detected_text, open_text, question_text
from place_rings.reporting.pages import code, command, escaped, html, table
from place_rings.reporting.setup_report.bill_of_materials import materials
from place_rings.reporting.setup_report.blind_spot_section import coarse
from place_rings.reporting.setup_report.directions import bearing, heading, height, whereabouts
from place_rings.reporting.setup_report.facts import QUESTIONS, looked_at, standing_for
from place_rings.reporting.setup_report.mounting_guide import seat_list
from place_rings.reporting.text import with_error

HOSTILE = (
    "<img src=x onerror=alert(1)> ![p](http://192.0.2.1/a.png) [l](javascript:alert(1)) `c` |"
    " **b** \\"
)
UNPRINTABLE = "\x1b]0;owned\x07\x1b[31m\u202egnp\u009b31m\u200b\ufeff\x7f"


class Read(HTMLParser):
    """Tags with their attributes, the text of all, and the cells of tables row by row."""

    def __init__(self, page):
        super().__init__()
        self.tags, self.text, self.rows, self.cell = [], "", [], False
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")
            self.cell = True

    def handle_endtag(self, tag):
        self.cell = self.cell and tag not in ("td", "th")

    def handle_data(self, data):
        self.text += data
        if self.cell:
            self.rows[-1][-1] += data


def led_out(read):
    """What of a page refers to something that is not in it."""
    keys = ("src", "href", "srcset", "data", "action", "poster", "background")
    return [
        v for _, a in read.tags for k, v in a.items() if k in keys and not v.startswith("data:")
    ]


@example("0\xa0")  # a space that is no printable character
@given(st.text(st.characters(exclude_categories=("Cs", "Cc")), max_size=60))
def test_what_a_user_wrote_is_shown_as_it_is(tmp_path_factory, text):
    """In a paragraph, in a cell and in a block: no markup of it is heeded, none of it is lost."""
    text = f"{text}{HOSTILE}"
    page = html(
        f"{escaped(text)}\n\n{table(('a', 'b'), [(escaped(text), 'x')])}\n{code(text)}",
        tmp_path_factory.getbasetemp(),
        text,
    )
    read = Read(page)
    body = [tag for tag, _ in read.tags][-13:]
    assert " ".join(body) == "body p table thead tr th th tbody tr td td pre code"
    said = printable(" ".join(text.split()))
    block = " ".join(" ".join(printable(line) for line in text.splitlines()).split())
    assert read.rows[-1] == [said, "x"]
    found = " ".join(read.text.split())
    assert found.count(said) == 3 + block.count(said)
    assert block in found
    assert led_out(read) == []


def test_a_page_leads_nowhere(tmp_path):
    (tmp_path / "mine.png").write_bytes(b"png")
    markdown = (
        "![m](mine.png) ![n](none.png) ![o](http://192.0.2.1/o.png) [p](http://192.0.2.1) <b>q</b>"
        " ![r](../r.png)\n"
    )
    read = Read(html(markdown, tmp_path, "<t>"))
    assert [a["src"][:22] for t, a in read.tags if t == "img"] == ["data:image/png;base64,"]
    assert led_out(read) == []
    wanted = {"html", "head", "meta", "title", "style", "body", "p", "img"}
    assert {t for t, _ in read.tags} == wanted


@given(st.sampled_from(sorted(ROBOTS)), st.integers(0, 2**32 - 1))
def test_millimetres_lead_from_the_joint_to_the_ring(name, seed):
    """From the joint's origin, along and aside of the mount axis, to the middle of the ring's
    sensors, at any pose.
    """
    rng, robot = np.random.default_rng(seed), ROBOTS[name]
    q = np.clip(rng.uniform(-1, 1, len(robot.chain)), *robot.limits.T)
    rings = [
        Ring(link, rng.uniform(), int(rng.integers(2, 9)), rng.uniform(-1, 1), rng.uniform(0, 6))
        for link in robot.links
    ]
    scene, setup = Scene.paper(robot=robot, poses=(Pose(q),)), Setup(tuple(rings))
    cones, frames, first = sensor_cones(robot, setup, q), forward(robot.chain, q), 0
    for seat in seat_list(scene, setup):
        mount = robot.mount(seat.ring.link)
        T = frames[(*robot.chain.joints, "TCP").index(seat.joint)]
        middle = cones.apex[first : first + seat.ring.count].mean(axis=0)
        axis = T[:3, :3] @ mount.axis
        way = middle - T[:3, 3]
        assert way @ axis == pytest.approx(seat.along, abs=1e-9)
        assert np.linalg.norm(way - (way @ axis) * axis) == pytest.approx(seat.aside, abs=1e-9)
        assert seat.look == pytest.approx(cones.axis[first])
        first += seat.ring.count


@given(st.integers(0, 2**32 - 1))
def test_words_say_where_a_direction_points(seed):
    v = np.random.default_rng(seed).normal(size=3)
    v /= np.linalg.norm(v)
    said = heading(v)
    assert ("up" in said) == (v[2] >= 0.35)
    assert ("down" in said) == (v[2] <= -0.35)
    for i, axis in enumerate("xy"):
        assert (f"+{axis}" in said) == (v[i] >= 0.35)
        assert (f"−{axis}" in said) == (v[i] <= -0.35)
    azimuth, elevation = (np.radians(float(n)) for n in re.findall(r"[+-]?\d+", bearing(v)))
    across = np.cos(elevation)
    told = [across * np.cos(azimuth), across * np.sin(azimuth), np.sin(elevation)]
    assert np.linalg.norm(told - v) < 0.013  # a degree and a half


def test_words_say_where_a_blind_spot_lies():
    def spot(way, z, body="forearm"):
        where = Beside(body, 0.3, np.array(way) / np.linalg.norm(way))
        return BlindSpot(0, (0,), np.array([0.5, 0.2, z]), 0.2, where)

    assert whereabouts(spot([0, 0.6, 0.6], 1.0)) == "left of and above the forearm"
    assert whereabouts(spot([-1, 0, 0.1], 1.0, "wrist_1")) == "behind wrist 1"
    assert height(spot([1, 0, 0], 0.5)) == "0.30 to 0.70 m high"
    assert height(spot([1, 0, 0], 0.1)) == "0.10 m below to 0.30 m above the base"
    assert height(spot([1, 0, 0], -0.5)) == "0.30 to 0.70 m below the base"


@given(st.lists(st.sampled_from(["--to", "-x"]) | st.text(max_size=9), min_size=1, max_size=9))
def test_a_shown_command_is_the_command(words):
    """Its lines break before options only, and a shell, which joins them, reads the same words."""
    words = ["place-rings", *(printable(" ".join(word.split())) for word in words)]
    lines = [line[4:] for line in command(words).splitlines() if line]
    assert all(line.endswith(" \\") for line in lines[:-1])
    assert (
        shlex.split(" ".join(line.removesuffix("\\") for line in lines[:-1]) + lines[-1]) == words
    )
    assert len(lines) == 1 + sum(word.startswith("-") for word in words)


def test_a_verdict_has_its_colour(tmp_path):
    for word, name in (("Passes.", "passes"), ("Fails.", "fails"), ("No.", None)):
        read = Read(html(f"> **{word}** Because.\n\n> {escaped('**Fails.**')}\n", tmp_path, "t"))
        quotes = [a.get("class") for t, a in read.tags if t == "blockquote"]
        assert quotes == [name, None]


def test_materials_add_up():
    known, nominal = effective(Use("tfmini-s")).sensor, Ring("forearm", 0.5, 7)
    setup = Setup((Ring("forearm", 0.2, 5, sensor=known), Ring("tool", 0.0, 6, sensor=known)))
    said = "\n".join(materials(Scene.paper(), setup))
    hostile, mount = "<b>`a`</b>*", ROBOTS["ur10"].mount("forearm")
    odd = replace(ROBOTS["ur10"], mounts=(replace(mount, link=hostile),))
    assert escaped(hostile) in "\n".join(
        materials(Scene.paper(robot=odd), Setup((replace(nominal, link=hostile),)))
    )
    power, sent = 11 * MODELS["tfmini-s"].supply.power_w, 100 * (frame_length(5) + frame_length(6))
    for part in (f"{power:.2f} W", f"{11 * 100:,} distances", f"{sent:,} bytes"):
        assert part in said
    said = "\n".join(materials(Scene.paper(), Setup((nominal,))))
    assert re.search(r"^\| 7 \| .* \| 1\.50 \| ", said, re.M)


def test_many_poses_are_stood_for_by_few():
    scene = Scene.paper(poses=tuple(Pose(np.full(6, 0.01 * i), 1 + i % 3) for i in range(50)))
    few = standing_for(scene, 16)
    assert len(few.poses) <= 16
    assert few.pose_weights.sum() == pytest.approx(1)
    assert standing_for(few, 16) is few
    at = looked_at(scene, 33)
    assert 33 in at
    assert {0, 49} <= set(at)
    assert len(at) <= 8
    assert looked_at(few, 0) == list(range(len(few.poses))) if len(few.poses) <= 8 else True


def test_a_piece_drawn_in_larger_voxels_is_where_it_was():
    ball = voxels(sphere(np.array([0.3, -0.2, 0.5]), 0.2), 0.01)
    drawn = coarse(ball, 1000)
    assert drawn.voxel == pytest.approx(0.04)
    assert drawn.volume == pytest.approx(ball.volume, rel=0.1)
    assert drawn.centres().mean(axis=0) == pytest.approx(ball.centres().mean(axis=0), abs=0.01)
    assert coarse(ball, 10**6) is ball


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The report of a proposal whose every text is hostile, of two poses: (its page, read; what was
    printed, the file).
    """
    folder = tmp_path_factory.mktemp("report")
    file = folder / f"{HOSTILE.replace('/', '÷')}.toml"
    quoted = json.dumps(HOSTILE + UNPRINTABLE).replace("\x7f", "\\u007f")
    file.write_text(
        f"""rings = [{{ link = "forearm", position = 0.3, count = 2 }}, {{ link = "upper_arm", \
position = 0.6, count = 1 }}]
[scene]
poses = [{{ q_deg = [0, -45, 60, -105, -90, 0] }}, {{ q_deg = [40, -45, 60, -105, -90, 0] }}]
targets = [{{ name = "V_S", radius = 0.4, at_least = 99 }}]
obstacles = [{{ name = {json.dumps(HOSTILE)}, centre = [0.6, 0, -0.6], size = [0.8, 1.2, 0.05] }}]
[found]
outcome = {quoted}
seed = 1
soft_percent = 1
exact_percent = 1
width = 1
starts = 1
evaluations = 1
seconds = 1
command = {quoted}
created = {quoted}
versions = {{ {quoted} = {quoted} }}
""",
        "utf-8",
    )
    words = ["report", str(file), "--voxel", "0.1", "--draws", "1", "--out", str(folder / "out")]
    words += ["--seed=0", "--occlusion", "ignore", "--json"]
    out = io.StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(out), suppress(SystemExit):
        patch.setattr(comparison, "PAPER_SETUPS", ("n1_4_0",))
        patch.setattr(comparison, "PAPER_TARGETS", ())
        patch.setattr(sys, "argv", ["place-rings", *words])
        patch.setattr(signal, "signal", lambda *_: None)
        command_line.main()
    assert [p.name for p in (folder / "out").iterdir()] == ["report.html"]
    written = ReportResult.model_validate_json(out.getvalue())
    assert [r.target for r in written.zeta] == ["V_S"]
    return Read(Path(written.page).read_text("utf-8")), file


def test_the_report_stands_alone_whatever_its_texts_are(made):
    read, file = made
    assert led_out(read) == []
    tags = [t for t, _ in read.tags]
    assert not {"script", "link", "iframe", "object", "a", "base", "form"} & set(tags)
    assert not any(key.startswith("on") for _, a in read.tags for key in a)
    assert any("default-src 'none'" in a.get("content", "") for t, a in read.tags if t == "meta")
    assert tags.count("img") == 7  # setup, section, detection, blind spots, firing, two links
    assert read.text.count(HOSTILE) >= 5
    assert read.text.count(printable(UNPRINTABLE)) >= 4
    assert all(c.isprintable() or c == "\n" for c in read.text)
    assert how_found(str(file)).command == HOSTILE + UNPRINTABLE


def test_the_report_says_how_to_count_again_what_was_asked(made):
    read, file = made
    line = re.search(r"place-rings verify(?:.*\\\n)+.*", read.text)[0].replace("\\\n", "")
    wanted = ["--occlusion", "ignore", "--target", "V_S:0.4", "--rule", "certified"]
    assert shlex.split(line) == ["place-rings", "verify", str(file), *wanted]


def test_the_report_says_what_is_counted(made):
    read, file = made
    setup, scene = resolve(str(file), None)
    counted = Verifier(scene, 0.1).verify(setup, scene.targets[0].target)
    assert f"{with_error(100 * counted.zeta, counted.error)} %" in read.text
    assert "Fails." in read.text
    bounds = re.search(r"proved: ([\d.]+) to ([\d.]+) %", read.text)
    certified = Verifier(scene, None, "certified", 0.02).verify(setup, scene.targets[0].target)
    assert float(bounds[1]) <= 100 * certified.high
    assert float(bounds[2]) >= 100 * certified.low
    centred = Verifier(scene, 0.1, "centre").verify(setup, scene.targets[0].target)
    unseen = [(p.target_voxels - p.covered_voxels) * 1000 * 0.1**3 for p in centred.poses]
    for litres in unseen:
        assert f"{litres:,.1f} litres" in read.text
    rows = {row[0]: row for row in read.rows}
    assert rows["this setup"][1] == "3"
    assert rows["n1_4_0"][1] == str(named_setup("n1_4_0").sensors)
    assert rows["ζ"] == ["ζ", f"{100 * counted.zeta:.2f}"]
    for question in QUESTIONS:
        share = detected(Verifier(scene, 0.1), setup, scene.targets[0].target, question)
        assert 0 < share.assumed_low < share.zeta < share.assumed_high
        cell = f"{detected_text(share)} ({open_text(share)})"
        assert rows[question_text(question)][1] == cell
    long = 1000 * scene.robot.mount("forearm").length
    forearm = next(row for row in read.rows if row[1:2] == ["forearm"])
    assert forearm[2:4] == [f"{0.3 * long:.1f}", f"{0.7 * long:.1f}"]
    assert hashlib.sha256(file.read_bytes()).hexdigest() in {row[-1] for row in read.rows}
