"""The search by its invariants: bounds kept, never worse than the start, repeatable, always an
answer.
"""

import _thread
import math
import signal
from dataclasses import replace

import numpy as np
import pytest
from place_rings.coverage.rings.ring import named_setup
from place_rings.coverage.targets.named import Near, Shell
from place_rings.objectives.mount_rules import Limits
from place_rings.objectives.named_layouts import ring_layout
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import Verifier
from place_rings.placement.search import global_stage
from place_rings.placement.search.exchange import Exchange
from place_rings.placement.search.progress import Outcome
from place_rings.placement.search.ruin_recreate import RuinRecreate
from place_rings.placement.search.schedule import Round
from place_rings.placement.space.design import Space
from place_rings.placement.space.starts import fresh

from ..support.searching import search

SHORT = (Round(1024, 4, 1, 8, 0.2, 8, 1), Round(2048, 2, 1, 8, 0.05))
NEAR_AND_FAR = (Near(0.4, weight=0.7), Shell(1.2, weight=0.3))


@pytest.fixture(scope="module")
def scene():
    """Two poses, two goals, limits of one link."""
    poses = (
        Pose(np.radians([0.0, -45, 60, -105, -90, 0]), 2.0),
        Pose(np.radians([40.0, -80, 90, -105, -90, 0]), 1.0),
    )
    return Scene.paper(
        poses=poses, targets=NEAR_AND_FAR, mounts={"forearm": Limits((0.3, 0.6), (-0.5, 0.2))}
    )


@pytest.fixture(scope="module")
def told():
    """Progress of the search: stage, value of the best setup so far, and that setup."""
    return []


@pytest.fixture(scope="module")
def found(scene, told):
    def tell(progress):
        told.append((progress.stage, progress.best, progress.setup))

    space = Space(scene, ring_layout(scene, 2, 6))
    return search(space, seed=3, schedule=SHORT, voxel=0.05, tell=tell)


def test_bounds_are_kept(scene, found):
    for ring in found.setup.rings:
        limits = scene.limits_of(ring.link)
        if ring.link == "tool":
            assert ring.position == 0
        else:
            assert limits.position[0] <= ring.position <= limits.position[1]
        assert limits.tilt[0] - 1e-6 <= ring.tilt <= limits.tilt[1] + 1e-6
        assert 0 <= ring.phase <= 2 * math.pi / ring.count


def test_value_is_the_verifiers(scene, found):
    assert found.exact == pytest.approx(Verifier(scene, 0.05).judge(found.setup)[1], abs=1e-12)
    assert found.outcome is Outcome.FINISHED
    assert found.starts == 4
    assert found.sampled == pytest.approx(found.exact, abs=0.05)


def test_progress_is_a_setup_from_the_first_round_on_and_gets_better_only(scene, found, told):
    shares = [share for _, share, _ in told]
    assert shares == sorted(shares)
    in_rounds = [one for one in told if one[0] >= 1][1:]  # the first has no setup yet
    assert {stage for stage, *_ in in_rounds} == {1, 2}
    assert all(share > 0 and setup is not None for _, share, setup in in_rounds)
    verifier = Verifier(scene, 0.05)
    for share, setup in {share: (share, setup) for _, share, setup in in_rounds}.values():
        # of 256 points in each goal at each pose
        assert verifier.judge(setup)[1] == pytest.approx(share, abs=0.05)
        assert [r.link for r in setup.rings] == [r.link for r in found.setup.rings]


def test_same_seed_same_answer(scene, found):
    again = search(Space(scene, ring_layout(scene, 2, 6)), seed=3, schedule=SHORT, voxel=0.05)
    assert again.setup == found.setup
    assert (again.sampled, again.exact) == (found.sampled, found.exact)


@pytest.mark.parametrize("effort", [0.1, 2.0, 3.0])
def test_effort_multiplies_the_candidates(scene, found, effort):
    space = Space(scene, ring_layout(scene, 2, 6))
    other = search(space, seed=3, schedule=SHORT, voxel=0.05, effort=effort)
    usual, known = found.starts, 3  # layouts of the paper always start
    assert other.starts == max(round(effort * usual), known)
    assert other.sampled is not None
    assert other.setup.sensors == found.setup.sensors


@pytest.mark.parametrize("occlusion", ["ignore", pytest.param("blind", marks=pytest.mark.slow)])
def test_never_worse_than_a_known_setup_and_the_papers_tilts(occlusion):
    scene = replace(Scene.paper(targets=NEAR_AND_FAR), occlusion=occlusion)
    space, known = Space(scene, ring_layout(scene, 2, 6)), named_setup("n2_6_40")
    found = search(space, schedule=SHORT, voxel=0.05, start=[known])
    setups = (known, *(named_setup(f"n2_6_{tilt}") for tilt in (0, 25, 55)))
    assert found.exact >= max(Verifier(scene, 0.05).judge(s)[1] for s in setups)
    assert found.sampled == pytest.approx(found.exact, abs=0.02)
    assert found.outcome is Outcome.FINISHED


def test_a_time_cap_still_gives_an_answer(scene):
    capped = search(Space(scene, ring_layout(scene, 2, 6)), cap=1e-6, schedule=SHORT, voxel=0.1)
    assert capped.outcome is Outcome.TIME
    assert 0 < capped.exact < 1


def test_a_time_cap_in_the_first_round_still_gives_an_answer():
    scene = Scene.paper(targets=(Shell(0.5),))
    capped = search(Space(scene, sensors=24), cap=1e-6, voxel=0.05)
    assert capped.outcome is Outcome.TIME
    assert capped.sampled == pytest.approx(capped.exact, abs=0.02)
    assert 0 < capped.start_up < capped.seconds
    assert 0 < capped.counting < capped.seconds


def test_a_time_cap_ends_an_exchange_after_a_ring(monkeypatch):
    now, real = [0.0], Exchange.put

    def put(self, *args):
        now[0] += 1
        return real(self, *args)

    monkeypatch.setattr(Exchange, "put", put)
    scene = Scene.paper()
    rounds = Round(256, 8, 0, 0, 0.0, trials=5, library=100), Round(256, 8, 4, 8, 0.1, 4, 8)
    limits = {"clock": lambda: now[0], "cap": 40.5}
    capped = search(Space(scene, sensors=48), schedule=rounds, voxel=0.1, **limits)
    assert capped.outcome is Outcome.TIME
    # a pair of rings is put before the next look at the clock
    assert 41 <= now[0] <= 41 + 3


def test_a_time_cap_that_passes_while_the_answer_is_counted_did_not_bite(scene):
    now = [0.0]

    def tell(progress):
        now[0] = 1e9 * (progress.to_count > 0)

    space = Space(scene, ring_layout(scene, 2, 6))
    found = search(space, cap=1.0, schedule=SHORT, voxel=0.1, tell=tell, clock=lambda: now[0])
    assert now[0] > 1
    assert found.outcome is Outcome.FINISHED


@pytest.mark.parametrize("round_", [1, 2])
def test_an_interrupt_keeps_the_best_so_far(scene, round_):
    told = []

    def tell(progress):
        told.append((progress.stage, progress.climbed))
        if [stage for stage, _ in told].count(round_) == 1 and progress.stage == round_:
            raise KeyboardInterrupt

    space = Space(scene, ring_layout(scene, 2, 6))
    stopped = search(space, schedule=SHORT, voxel=0.1, tell=tell)
    assert stopped.outcome is Outcome.INTERRUPTED
    assert all(0 <= climbed <= len(SHORT) for _, climbed in told)
    assert 0 < stopped.exact < 1


@pytest.fixture
def interruptible():
    """Ctrl-C interrupts the main thread, also in a process that was started to ignore it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("interruptible")
@pytest.mark.parametrize(("module", "name"), [(Exchange, "put"), (RuinRecreate, "improved")])
def test_ctrl_c_keeps_what_was_found(scene, monkeypatch, module, name):
    real, calls = getattr(module, name), []

    def interrupted(self, *args):
        calls.append(1)
        if len(calls) == 4:
            _thread.interrupt_main()
        return real(self, *args)

    monkeypatch.setattr(module, name, interrupted)
    rounds = Round(256, 6, 1, 8, 0.2, trials=20, library=100), Round(256, 4, 50, 8, 0.1, 8)
    space, verifier = Space(scene, sensors=60), Verifier(scene, 0.1)
    stopped = search(space, schedule=rounds, voxel=0.1)
    assert stopped.outcome is Outcome.INTERRUPTED
    assert 4 <= len(calls) <= 40  # of more than a thousand
    rng = np.random.default_rng(0)
    assert stopped.exact > max(verifier.judge(space.setup(fresh(space, rng)))[1] for _ in range(4))


def test_a_missed_floor_is_no_share_of_points():
    far = Shell(1.5, weight=0.5, at_least_percent=99)
    scene, told = Scene.paper(targets=(Shell(0.5, weight=0.5), far)), []
    space = Space(scene, ring_layout(scene, 1, 8))
    found = search(space, schedule=SHORT, voxel=0.1, tell=lambda p: told.append((p.best, p.setup)))
    assert found.short > 0
    assert found.sampled is None
    assert all(best == 0.0 for best, _ in told)
    assert told[-1][1] is not None


def test_an_interrupt_while_counting_keeps_one_count(scene, monkeypatch):
    real, calls = Verifier.verify_goals, []

    def interrupted(self, setup):
        calls.append(setup)
        if len(calls) in (1, 3):
            raise KeyboardInterrupt
        return real(self, setup)

    with monkeypatch.context() as patched:
        patched.setattr(Verifier, "verify_goals", interrupted)
        stopped = search(Space(scene, ring_layout(scene, 2, 6)), schedule=SHORT, voxel=0.1)
    assert stopped.outcome is Outcome.INTERRUPTED
    assert stopped.setup == calls[1]
    assert (stopped.short, stopped.exact) == Verifier(scene, 0.1).judge(stopped.setup)


def test_an_interrupt_while_points_are_evaluated_keeps_what_came_before(scene, monkeypatch):
    real, calls = global_stage.share_of, []

    def interrupted(*args):
        calls.append(1)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return real(*args)

    monkeypatch.setattr(global_stage, "share_of", interrupted)
    stopped = search(Space(scene, sensors=24), schedule=SHORT, voxel=0.1)
    assert stopped.outcome is Outcome.INTERRUPTED
    assert stopped.setup.sensors == 24
    assert stopped.exact == Verifier(scene, 0.1).judge(stopped.setup)[1]


def test_a_floor_is_met_where_it_can_be():
    """Far coverage of 35 % beside near: without the floor the same search gives less of it."""
    far = Shell(1.5)
    scene = Scene.paper(targets=(Shell(0.5), replace(far, weight=0.0, at_least_percent=35)))
    rounds = *SHORT, Round(16384, 2, 2, 8, 0.02)
    found = search(Space(scene, ring_layout(scene, 2, 16)), schedule=rounds, voxel=0.05)
    assert found.short == 0
    assert Verifier(scene, 0.05).verify(found.setup, far).zeta >= 0.35
