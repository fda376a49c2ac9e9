"""The front door: lazy, typed, and the same answers as the commands give."""

import json
import re
import subprocess
import sys
import tomllib
from dataclasses import replace
from doctest import DocTestFinder, DocTestRunner
from functools import partial
from inspect import getdoc, isclass, isfunction
from unittest.mock import Mock

import jax
import jax.numpy as jnp
import numpy as np
import place_rings as pr
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings._placement import Placement
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import Verifier
from place_rings.placement.redesign import redesign
from place_rings.placement.redesign.beam_search import BeamPlan, Stage
from place_rings.placement.search import search as searching
from place_rings.placement.search.schedule import Round
from place_rings.reporting import comparison

from ..support.rooms import ROOT

HEAVY = ("numpy", "jax", "scipy", "matplotlib", "pydantic", "viser", "trimesh", "rich")
NEAR = pr.Scene(targets=[pr.Shell(0.5)])
PAPER = pr.Scene.paper(targets=[pr.Shell(0.5)])  # compiles in an eighth of the time
QUICK = (Round(512, 2, 2, 4, 0.2, 4, 4),)
TINY = BeamPlan(24, 256, 0.05, 3, (Stage(0.03, 8, 2),), 512, 1)


@pytest.fixture(scope="module", autouse=True)
def quick():
    """Searches of few steps: what they find need not be good."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(searching, "usual", lambda *_: QUICK)
        patch.setattr(comparison, "PAPER_SETUPS", ("n1_4_0",))
        patch.setattr(redesign, "BeamPlan", lambda: TINY)
        yield


def python(*words, cwd):
    return subprocess.run(
        [sys.executable, *words], cwd=cwd, check=True, capture_output=True, text=True
    ).stdout


def test_importing_loads_nothing_heavy_and_takes_a_tenth_of_a_second(tmp_path):
    text = (
        "import sys, time; a = time.process_time(); import place_rings;"
        f" print(time.process_time() - a, [m for m in {HEAVY} if m in sys.modules])"
    )
    took, loaded = zip(
        *(python("-c", text, cwd=where).split(" ", 1) for where in (ROOT, tmp_path)), strict=True
    )
    assert set(loaded) == {"[]\n"}
    assert min(map(float, took)) < 0.1


def test_every_public_name_is_there_documented_and_completes():
    assert sorted(pr.__all__) == pr.__all__
    assert len(pr.__all__) <= 72  # a small front door; each kind of target has a name of its own
    assert {*pr.__all__, "__version__"} <= set(dir(pr))
    for name in pr.__all__:
        assert getdoc(getattr(pr, name)), name
    with pytest.raises(AttributeError, match="nothing"):
        pr.nothing  # noqa: B018


def test_type_checkers_see_the_same_names():
    import ast

    tree = ast.parse((ROOT / "api" / "__init__.py").read_text())
    block = next(
        node for node in tree.body if isinstance(node, ast.If) and node.test.id == "TYPE_CHECKING"
    )
    seen = {(node.module, alias.name) for node in block.body for alias in node.names}
    from place_rings import _WHERE

    assert {(module, name) for name, module in _WHERE.items()} == seen
    assert {name for _, name in seen} == set(pr.__all__)


def run_examples(name):
    one = getattr(pr, name)
    if not (isclass(one) or isfunction(one)):
        one = type(one)
    runner = DocTestRunner(verbose=False)
    for test in DocTestFinder().find(one, name, globs={}):
        assert not runner.run(test).failed, test.name


COSTLY = ("certify", "coverage_fraction", "improve", "report", "safety", "search")


@pytest.mark.parametrize("name", [name for name in pr.__all__ if name not in COSTLY])
def test_the_examples_of_docstrings_run(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # some write files
    run_examples(name)


@pytest.mark.slow  # they compile and draw much
def test_the_costly_examples_of_docstrings_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in COSTLY:
        run_examples(name)


def test_the_facade_has_examples():
    for name in pr.__all__:
        one = getattr(pr, name)
        result = isclass(one) and (issubclass(one, Placement) or name == "StudyReport")
        if one.__module__.startswith("place_rings._") and not result:
            assert ">>>" in getdoc(one if isclass(one) or isfunction(one) else type(one)), name


@given(
    radius=st.sampled_from([0.4, 0.5, 1.0]),
    count=st.integers(1, 12),
    rings=st.integers(1, 3),
    tilt=st.integers(-60, 60),
)
@settings(max_examples=5)
def test_verify_is_the_verifier(radius, count, rings, tilt):
    name = f"n{rings}_{count}_{tilt}"
    scene = pr.Scene.paper(targets=[pr.Shell(radius)])
    core = Scene.paper(targets=(scene.targets[0].target,))
    counted = pr.verify(name, scene, voxel=0.05)
    expected = Verifier(core, 0.05).verify(pr.Setup.named(name), scene.targets[0].target)
    assert counted.coverage == expected.zeta
    assert counted.each[0].covered_voxels == expected.covered_voxels
    assert counted.by_target == {f"V_S({radius:g})": expected.zeta}
    assert float(counted) == counted.low == counted.high == counted.coverage


def test_verify_gives_what_the_command_prints(run):
    code, out, _ = run("verify", "n1_8_0", "--target", "V_S:0.5", "--voxel", "0.05", "--json")
    (record,) = pr.verify("n1_8_0", NEAR, voxel=0.05).records
    said, ours = json.loads(out), record.model_dump(mode="json")
    assert code == 0
    for one in (said, ours):
        one.pop("seconds")
    assert said == ours


def test_an_interval_holds_the_count():
    proof = pr.certify("n1_8_0", NEAR, width=3.0)
    assert proof.low <= pr.verify("n1_8_0", NEAR, voxel=0.03).coverage <= proof.high
    assert proof.high - proof.low <= 0.03
    assert "…" in repr(proof)


def test_robustness_gives_what_the_command_prints(run):
    options = ("--draws", 3, "--voxel", 0.05, "--k", 2, "--json")
    code, out, _ = run("robustness", "n1_8_0", "--target", "V_S:0.5", *options)
    seen = []
    report = pr.robustness(
        "n1_8_0", NEAR, draws=3, voxel=0.05, k=2, progress=lambda *done: seen.append(done)
    )
    said, ours = json.loads(out), report.records[0].model_dump(mode="json")
    for one in (said, ours):
        one.pop("seconds")
    assert code == 0
    assert said == ours
    assert seen == [(0, 3), (1, 3), (2, 3), (3, 3)]


@pytest.fixture(scope="module")
def proposal():
    return pr.search(PAPER, sensors=12, any_rings=True, voxel=0.05)


def test_a_search_saves_what_the_command_writes(run, tmp_path, proposal):
    options = (
        "--paper",
        "--sensors",
        12,
        "--any-rings",
        "--voxel",
        0.05,
        "--out",
        tmp_path / "out",
    )
    code, _, _ = run("--target", "V_S:0.5", *options)
    assert code == 0
    theirs = tomllib.loads((tmp_path / "out" / "proposal.toml").read_text())
    ours = tomllib.loads(proposal.save(tmp_path / "proposal.toml").read_text())
    for one in (theirs, ours):
        for key in ("command", "created", "seconds", "start_up_seconds", "count_seconds"):
            one["found"].pop(key, None)  # absent where it is 0
        for stage in one["found"]["stages"]:
            stage.pop("seconds")
        for zeta in one["zeta"]:
            zeta.pop("seconds")
    assert theirs == ours


def test_the_count_that_chose_a_proposal_is_not_repeated(proposal, monkeypatch):
    counted = []
    verify = Verifier.verify

    def listening(self, setup, target):
        counted.append((setup, self.scene.occlusion))
        return verify(self, setup, target)

    monkeypatch.setattr(Verifier, "verify", listening)
    assert replace(proposal).coverage == proposal.coverage
    assert not counted
    proposal.compare()
    assert (proposal.setup, proposal.scene.occlusion) not in counted
    assert (proposal.setup, "blind") in counted


def test_a_proposal_reads_back(tmp_path, proposal):
    path = proposal.save(tmp_path / "proposal.toml")
    again = pr.load(path)
    assert isinstance(again, pr.Proposal)
    assert again.setup == proposal.setup
    assert again.found.seed == 0
    assert again.coverage == pr.verify(proposal, voxel=0.01).coverage
    second = again.save(tmp_path / "second.toml")
    assert tomllib.loads(second.read_text())["found"] == tomllib.loads(path.read_text())["found"]


def test_a_result_draws_exports_and_shows(tmp_path, proposal):
    assert proposal.plot(tmp_path / "p.png").png == (tmp_path / "p.png").read_bytes()
    assert "data:image/png" in proposal._repr_html_()
    files = proposal.export("json", "csv", folder=tmp_path)
    assert [file.name for file in files] == ["sensors.json", "sensors.csv"]
    assert pr.verify(tmp_path / "sensors.csv", PAPER, voxel=0.05).coverage == pytest.approx(
        proposal.coverage, abs=1e-3
    )
    with proposal.view(browser=False, wait=False) as page:
        assert page.url.startswith("http://127.0.0.1:")


@pytest.mark.slow
def test_the_fewest_sensors_are_sought_with_progress():
    counts = []
    few = pr.search(NEAR, reach=3, voxel=0.1, time=5, progress=lambda p: counts.append(p.sensors))
    assert few.coverage >= 0.03
    assert few.reach.reached
    assert set(counts) >= {few.setup.sensors}


def test_ctrl_c_returns_the_best_until_then():
    pressed = []

    def interrupt(progress):
        if progress.stage >= 1 and not pressed:
            pressed.append(progress.stage)
            raise KeyboardInterrupt

    found = pr.search(NEAR, sensors=12, voxel=0.05, progress=interrupt)
    assert found.outcome is pr.Outcome.INTERRUPTED
    assert found.setup.sensors == 12


def test_a_search_passes_on_what_it_is_given(monkeypatch):
    fake = Mock(spec=searching.search, side_effect=ValueError("floors"))
    monkeypatch.setattr(searching, "search", fake)
    start = pr.Setup.named("n1_4_0")
    with pytest.raises(pr.InputError, match="floors"):
        pr.search(NEAR, sensors=12, rings=2, seed=3, time=5, redundancy=2, start=[start])
    _, options, context = fake.call_args.args
    assert (options.seed, options.start, context.brake.limit) == (3, (start,), 5)
    assert context.aim.seen == 2


def test_a_scene_is_what_its_file_says(tmp_path):
    scene = pr.Scene(
        robot="panda",
        targets=[pr.Shell(0.5, weight=2, at_least_percent=40), pr.ReachAndToolSpheres()],
        poses=[[0, -0.5, 0, -2, 0, 1.5, 0.7], [0.3, -0.5, 0, -2, 0, 1.5, 0.7]],
        sensor=pr.sensors.under("vl53l1x", ambient="50kcps"),
        ring_radius=0.09,
        mounts={"forearm": pr.Limits(position=(0.2, 0.8))},
        rules=pr.Rules(spacing=0.05),
        obstacles=[pr.Obstacle("table", size=[1, 1, 0.1], centre=[0.9, 0, 0])],
        over_poses="worst",
        occlusion="shadow",
    )
    again = pr.load(pr.save(scene, tmp_path / "scene.toml"))
    assert again.targets == scene.targets
    assert again.mounts.keys() == scene.mounts.keys()
    assert repr(again) == repr(scene)
    assert again.rules == scene.rules
    np.testing.assert_allclose(again.poses[1].q, scene.poses[1].q)
    assert again.ring_radius == 0.09
    assert again.sensor == scene.sensor


def test_none_stands_for_a_default():
    plain, table = pr.Scene(), pr.Obstacle("table", size=[1, 1, 0.1], centre=[0.9, 0, 0])
    full = {
        "targets": pr.ToolSphere(),
        "poses": np.zeros(6),
        "sensor": pr.sensors["vl53l5cx"],
        "ring_radius": 0.1,
        "mounts": {"tool": pr.Limits(tilt=(0, 0.1))},
        "rules": pr.Rules(spacing=0.1),
        "obstacles": table,
        "safety": pr.Safety(reaction=1.0),
    }
    scene = pr.Scene(**full)
    assert scene.obstacles == (table,)
    assert scene.ring_radius == 0.1
    assert scene.replace(**dict.fromkeys(full)) == plain
    assert pr.Scene(**dict.fromkeys(full)) == plain


def test_trajectories_compare_and_hash_as_objects():
    one, same = (pr.Trajectory([0, 1], [[0] * 6, [0.1] * 6]) for _ in range(2))
    assert one == one
    assert one != same
    assert len({one, same}) == 2


def test_a_scene_does_not_change():
    with pytest.raises(AttributeError):
        NEAR.robot = pr.robots["ur3"]
    other = NEAR.replace(robot="ur3", targets=[pr.ToolSphere()])
    assert other.robot.name == "ur3"
    assert NEAR.robot.name == "ur10"
    assert np.array_equal(other.poses[0].q, pr.robots["ur3"].rest)


REFUSED = """
robot ur9 ur10 <- pr.Scene(robot="ur9")
radius 0.1 0.15 <- pr.Scene(targets=[pr.Shell(0.1)])
targets V_S Shell <- pr.Scene(targets=["V_S"])
targets 5 Shell <- pr.Scene(targets=5)
poses 6 <- pr.Scene(poses=[0, 1])
poses numbers <- pr.Scene(poses="x")
poses () <- pr.Scene(poses=5)
poses numbers <- pr.Scene(poses=object())
shoulder_pan <- pr.Scene(poses=[7.0] * 6)
occlusion dark ignore shadow blind <- pr.Scene(occlusion="dark")
occlusion 3 <- pr.Scene(occlusion=3)
sensor <- pr.Scene(sensor=3)
mounts leg ur10 <- pr.Scene(mounts={"leg": pr.Limits()})
mounts list table <- pr.Scene(mounts=[1])
mounts "abc" <- pr.Scene(mounts="abc")
mounts.tool 3 <- pr.Scene(mounts={"tool": 3})
obstacles 5 obstacle <- pr.Scene(obstacles=5)
robots <- pr.Scene().replace(robots="ur3")
-1 <- pr.Shell(-1)
weight -1 <- pr.Shell(0.5, weight=-1)
weight "a" <- pr.Shell(0.5, weight="a")
size file points floor <- pr.Obstacle("a")
size 3 <- pr.Obstacle(size=3)
position 2 <- pr.verify(pr.Setup([pr.Ring("forearm", 2, 8)]))
position "a" <- pr.Ring("forearm", "a", 8)
tilt 90 rad <- pr.Ring("forearm", 0, 8, tilt=90)
count 8.5 <- pr.Ring("forearm", 0, 8.5)
link 3 <- pr.Ring(3, 0, 8)
sensor "vl53l5cx" Sensor <- pr.Ring("forearm", 0, 8, sensor="vl53l5cx")
'leg' <- pr.Scene().ring("leg", 0, 8)
fov 25 rad <- pr.Sensor(fov=25)
range_m nan <- pr.Sensor(range_m=float("nan"))
vl53l1x 9klx <- pr.sensors.under("vl53l1x", ambient="9klx")
rings[0] Ring <- pr.Setup(["n2_16_25"])
rings 3 list <- pr.Setup(3)
setup <- pr.verify(pr.Setup(()))
no.csv <- pr.Trajectory.from_csv("no.csv")
time_s <- pr.Trajectory([0, 0], [[0], [1]])
time_s q numbers <- pr.Trajectory("a", "b")
poses 2.5 <- pr.Trajectory([0, 1], [[0], [1]], poses=2.5)
setup int <- pr.verify(3, pr.Scene())
voxel -1 <- pr.verify("n1_8_0", pr.Scene(), voxel=-1)
voxel 'a' <- pr.verify("n1_8_0", pr.Scene(), voxel="a")
rule centre <- pr.verify("n1_8_0", pr.Scene(), rule="corners")
width certified <- pr.verify("n1_8_0", pr.Scene(), width=1)
scene str Scene <- pr.verify("n1_8_0", "scene.toml")
nowhere.toml <- pr.verify("nowhere.toml")
ur10 <- pr.verify(pr.Setup([pr.Ring("leg", 0, 1)]))
width 0 <- pr.certify("n1_8_0", pr.Scene(), width=0)
width 'a' <- pr.certify("n1_8_0", pr.Scene(), width="a")
k 0 <- pr.robustness("n1_8_0", pr.Scene(), k=0)
draws 1.5 <- pr.robustness("n1_8_0", pr.Scene(), draws=1.5)
law 'x' uniform normal <- pr.robustness("n1_8_0", pr.Scene(), law="x")
rings_per_link 2 sensors 9 <- pr.search(pr.Scene(), sensors=9, rings_per_link=2)
sensors reach <- pr.search(pr.Scene(), sensors=9, reach=50)
seed -1 <- pr.search(pr.Scene(), seed=-1)
seed 1.5 <- pr.search(pr.Scene(), seed=1.5)
losing ring redundancy <- pr.search(pr.Scene(), redundancy=2, losing="ring")
losing 'x' ring sensor <- pr.search(pr.Scene(), losing="x")
sensors 8.0 1 2000 <- pr.search(pr.Scene(), sensors=8.0)
sensors 'a' <- pr.search(pr.Scene(), sensors="a")
rules <- pr.search(pr.Scene(), sensors=1)
start 'n1_8_0' Setup <- pr.search(pr.Scene(), start=["n1_8_0"])
start 3 <- pr.search(pr.Scene(), start=[3])
start 3 <- pr.search(pr.Scene(), start=3)
time 'a' <- pr.search(pr.Scene(), time="a")
to dwg <- pr.export("n1_8_0", to="dwg")
pose 1.5 <- pr.export("n1_8_0", to="csv", pose=1.5)
folder /proc/nope <- pr.export("n1_8_0", to="csv", folder="/proc/nope")
folder /proc/nope <- pr.report("n1_8_0", voxel=0.1, draws=1, folder="/proc/nope")
nowhere.toml <- pr.load("nowhere.toml")
Scene Robot <- pr.save(3, "x.toml")
count 1.5 <- pr.sample_points(pr.Scene(), 1.5)
changes 0 1 20 <- pr.improve("n1_8_0", changes=0)
add_sensors 1.5 <- pr.improve("n1_8_0", add_sensors=1.5)
time 0 <- pr.improve("n1_8_0", time=0)
setup int <- pr.improve(3)
approaches 0 1 100000 <- pr.safety("n1_8_0", approaches=0)
rate 0 <- pr.safety("n1_8_0", rate=0)
latency 9 <- pr.safety("n1_8_0", latency=9)
occlusion 'dark' <- pr.safety("n1_8_0", occlusion="dark")
trajectory 'task.csv' <- pr.safety("n1_8_0", trajectory="task.csv")
q 1 6 <- pr.safety("n1_8_0", trajectory=pr.Trajectory([0, 1], [[0], [1]]))
name 'sweep' bound convergence <- pr.study("sweep")
seed 1 convergence <- pr.study("convergence", seed=1)
targets pareto <- pr.study("bound", targets=(pr.Shell(1), pr.Shell(2)))
V_S(1) <- pr.study("pareto", targets=(pr.Shell(1), pr.Shell(1)))
targets <- pr.study("pareto", targets=3)
radius 0.1 0.15 <- pr.study("pareto", targets=(pr.Shell(0.1), pr.Shell(1)))
workers 0 <- pr.study("paper", workers=0)
scheduler 'here' <- pr.study("paper", scheduler="here")
/proc/nope <- pr.study("paper", folder="/proc/nope")
"""  # what a refusal names, and the call


def test_what_cannot_be_used_is_refused_in_one_line(tmp_path):
    # in a process of its own, in which nothing but the front door looks at types
    named, calls = zip(*(line.split(" <- ") for line in REFUSED.strip().splitlines()), strict=True)
    lines = [
        "import json, place_rings as pr",
        "said = []",
        *(
            f"try: said.append(repr({text}))\nexcept ValueError as error: said.append(str(error))"
            for text in calls
        ),
        "print(json.dumps(said))",
    ]
    script = tmp_path / "refused.py"
    script.write_text("\n".join(lines))
    said = json.loads(python(str(script), cwd=tmp_path))
    for parts, text, line in zip(named, calls, said, strict=True):
        assert [part for part in parts.split() if part not in line] == [], (text, line)
        assert "\n" not in line, text
    assert [file.name for file in tmp_path.iterdir()] == ["refused.py"]


def test_catalogues_name_what_they_have():
    with pytest.raises(KeyError, match="ur10"):
        pr.robots["ur9"]
    with pytest.raises(KeyError, match="vl53l0x"):
        pr.sensors["eye"]
    assert len(pr.robots) == len(list(pr.robots))
    assert "ur3e" in repr(pr.robots)


def test_values_go_there_and_back():
    setup = pr.Setup.named("n2_8_25")
    assert setup.with_values(setup.values) == setup
    with pytest.raises(ValueError, match=r"\(3, 5\)"):
        setup.with_values(np.zeros((3, 4)))


def fraction_of(setup, scene, points, width=0.03):
    return lambda values: pr.coverage_fraction(setup, scene, points, width, values=values)


SQUARE = replace(pr.Sensor(), fov_up=0.5, zones=4)
MOTION = [[0, -0.8, 1, -1.8, -1.6, 0], [0.5, -0.8, 1.4, -1.8, -1.6, 0.3]]
BOX = pr.Obstacle(size=[0.4, 0.4, 0.4], centre=[0.6, 0, 0.4])
TOOL = (
    pr.Attached(link="forearm", centre=[0.2, 0, 0.2], size=[0.05, 0.3, 0.1]),
    pr.Attached(start=[0, 0.1, 0], end=[0, 0.3, 0], radius=0.06),
)
EYE = pr.MountedSensor("base", (0.5, 0.0, 1.5), (0, 0, -1), SQUARE, (0, 1, 0))
PAD = pr.MountedSensor("forearm", (0.0, 0.1, 0.2), (0.0, 1.0, 0.0))
CASES = {
    "cones, two targets, two poses, an obstacle": (
        PAPER.replace(
            targets=[pr.Shell(0.5, weight=2), pr.ToolSphere()], poses=MOTION, obstacles=[BOX]
        ),
        pr.Setup.named("n1_4_25"),
    ),
    "shadow, square beams, single sensors": (
        NEAR.replace(occlusion="shadow", cell_sensors=[EYE]),
        pr.Setup(pr.Setup.named("n1_4_25", SQUARE, radius=0.1).rings, (PAD,)),
    ),
    "blind, a tool": (
        NEAR.replace(occlusion="blind", attached=TOOL),
        pr.Setup.named("n1_4_25", radius=0.1),
    ),
}


def check_gradient(case):
    """Check the slopes of a case against finite differences."""
    scene, setup = CASES[case]
    points = pr.sample_points(scene, 256, 1)
    both = jax.jit(jax.value_and_grad(fraction_of(setup, scene, points, 0.1)))
    values = jnp.asarray(setup.values) + jnp.array([[0.02], [0.01], [0.03]])
    values = values.at[0].set(jnp.clip(values[0], 0.01, 0.99))
    (_, slope), step = both(values), 3e-3  # 32 bit
    for index in np.ndindex(*values.shape):
        above, below = (both(values.at[index].add(s * step))[0] for s in (1, -1))
        expected = float(above - below) / (2 * step)
        assert float(slope[index]) == pytest.approx(expected, abs=2e-3), (index, case)


def check_same(found, expected):
    for (value, slope), (other, by) in zip(found, expected, strict=True):
        assert float(value) == pytest.approx(float(other), abs=1e-6)
        np.testing.assert_allclose(slope, by, atol=1e-6)


def test_the_gradient_is_that_of_finite_differences():
    check_gradient(next(iter(CASES)))


@pytest.mark.slow  # they compile for ten seconds each
def test_the_gradient_with_self_occlusion_is_that_of_finite_differences():
    for case in list(CASES)[1:]:
        check_gradient(case)


@pytest.mark.slow
def test_jit_and_vmap_give_the_same_and_an_objective_of_ones_own_composes():
    setup, points = pr.Setup.named("n1_4_25"), pr.sample_points(PAPER, 64)
    both = jax.value_and_grad(fraction_of(setup, PAPER, points))
    values = jnp.asarray(np.asarray(setup.values) + np.arange(3)[:, None, None] * 0.01)
    each = [both(v) for v in values]
    check_same([jax.jit(both)(v) for v in values], each)
    check_same(zip(*jax.jit(jax.vmap(both))(values), strict=True), each)
    check_same(zip(*jax.vmap(both)(values), strict=True), each)

    def objective(values):
        return fraction_of(setup, PAPER, points)(values) - 0.1 * jnp.sum(values[1] ** 2)

    expected = each[0][1].at[1].add(-0.2 * values[0][1])
    np.testing.assert_allclose(jax.jit(jax.grad(objective))(values[0]), expected, atol=1e-6)


@pytest.mark.slow
def test_a_sharp_fraction_is_the_share_of_the_points_and_own_points_serve():
    setup, points = pr.Setup.named("n1_8_25"), pr.sample_points(NEAR, 4096)
    exact = pr.verify(setup, NEAR, voxel=0.03).coverage
    sharp = float(pr.coverage_fraction(setup, NEAR, points, 1e-6))
    assert sharp == pytest.approx(exact, abs=0.02)
    own = float(pr.coverage_fraction(setup, NEAR, points.points[0], 1e-6))
    assert own == pytest.approx(sharp, abs=1e-6)


def test_the_width_is_a_constant_and_other_shapes_are_refused():
    setup, points = pr.Setup.named("n1_4_25"), pr.sample_points(PAPER, 64)
    assert jax.grad(lambda w: pr.coverage_fraction(setup, PAPER, points, w))(0.05) == 0
    for width, values, says in ((0.05, np.zeros((3, 2)), "values"), (0, None, "width")):
        with pytest.raises(pr.InputError, match=says):
            pr.coverage_fraction(setup, NEAR, points, width, values=values)
    with pytest.raises(pr.InputError, match="points"):
        pr.coverage_fraction(setup, NEAR, np.zeros((4, 2)), 0.05)


def test_a_command_names_options_where_the_api_names_arguments(run):
    with pytest.raises(pr.InputError) as refused:
        pr.search(sensors=20, rings_per_link=2)
    assert refused.value.argument == "rings_per_link"
    assert "--" not in str(refused.value)
    code, _, err = run("--sensors", 20, "--rings-per-link", 2)
    assert code == 2
    assert "--rings-per-link: " in err
    assert "--sensors 20" in err


def test_rules_that_leave_no_setup_are_told_apart_from_bad_arguments():
    crowded = NEAR.replace(rules=pr.Rules(spacing=3.0))
    with pytest.raises(pr.InfeasibleError):
        pr.search(crowded, rings_per_link=3)
    with pytest.raises(pr.InfeasibleError):
        pr.search(crowded, sensors=2000)


@pytest.mark.parametrize(
    ("old", "new", "call"),
    [
        ("time_cap", "time", partial(pr.search, NEAR)),
        ("reach_percent", "reach", partial(pr.search, NEAR)),
        ("within_points", "within", partial(pr.search, NEAR)),
        ("time_cap", "time", partial(pr.improve, "n1_8_0", NEAR)),
        ("time_cap", "time", partial(pr.study, "layouts")),
        ("memory_gb", "memory", partial(pr.verify, "n1_8_0", NEAR)),
    ],
)
def test_a_former_name_of_an_argument_means_the_same(old, new, call):
    """Both are refused alike for a value out of range, and never accepted together."""
    with pytest.raises(pr.InputError) as today:
        call(**{new: -1})
    with pytest.warns(DeprecationWarning, match=new), pytest.raises(pr.InputError) as former:
        call(**{old: -1})
    assert (str(former.value), former.value.argument) == (str(today.value), new)
    with pytest.raises(pr.InputError, match=old):
        call(**{old: -1, new: -1})


WRONG = {
    "rules.spacing": lambda x: {"rules": pr.Rules(spacing=-x)},
    "rules.sensors": lambda x: {"rules": pr.Rules(sensors=(int(9 + x), 3))},
    "limits.tilt": lambda x: {"mounts": {"forearm": pr.Limits(tilt=(-10 * x, 0.1))}},
    "limits.position": lambda x: {"mounts": {"forearm": pr.Limits(position=(0.0, 1 + x))}},
    "safety.human": lambda x: {"safety": pr.Safety(human=-x)},
    "poses[1].q[0]": lambda x: {"poses": [[0.0] * 6, [30.0 + x] + [0.0] * 5]},
    "ring_radius": lambda x: {"ring_radius": -x},
}


@pytest.mark.parametrize("named", WRONG)
@given(x=st.floats(1.0, 50.0))
@settings(max_examples=5, deadline=None)
def test_a_refusal_names_what_python_calls_it(named, x):
    """Attributes of the classes, never keys and units of a file."""
    with pytest.raises(pr.InputError) as refused:
        pr.Scene(targets=[pr.Shell(0.5)], **WRONG[named](x))
    line = str(refused.value)
    place = line.partition(" found")[0].lower().replace(": ", ".")  # of the class or the scene
    assert named in place
    assert not any(key in line for key in ("_deg", "sensors_per_ring", "_m:"))


@given(degrees=st.integers(4, 360), sign=st.sampled_from([-1, 1]))
def test_degrees_given_as_radians_are_recognised(degrees, sign):
    wanted = f"math.radians({sign * degrees})"
    for call in (
        lambda: pr.Ring("forearm", 0.5, 8, tilt=sign * degrees),
        lambda: pr.Sensor(fov=sign * degrees),
        lambda: NEAR.replace(mounts={"forearm": pr.Limits(tilt=(0.0, sign * degrees))}),
    ):
        with pytest.raises(ValueError, match=re.escape(wanted)):
            call()


@given(counts=st.lists(st.integers(1, 9), min_size=1, max_size=4), fov=st.floats(0.1, 1.0))
def test_a_setup_prints_a_common_sensor_once(counts, fov):
    sensor = pr.Sensor(fov=fov)
    rings = tuple(pr.Ring("forearm", i / 4, n, sensor=sensor) for i, n in enumerate(counts))
    assert str(pr.Setup(rings)).count("Sensor(") == 1
    mixed = pr.Setup((*rings, pr.Ring("tool", 0.0, 3, sensor=pr.Sensor(fov=fov + 0.1))))
    assert str(mixed) == repr(mixed)
    assert str(mixed).count("Sensor(") == len(mixed.rings)
