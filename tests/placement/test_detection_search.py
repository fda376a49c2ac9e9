"""The search for detection: its points judge as the exact count does, and its invariants."""

from dataclasses import replace

import numpy as np
import place_rings as pr
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.definitions.errors import InputError
from place_rings.coverage.detection.detection import Detection
from place_rings.coverage.detection.pieces import PIECES
from place_rings.objectives.criterion import Criterion, judge
from place_rings.objectives.detection_share import noticed_in
from place_rings.objectives.named_layouts import ring_layout
from place_rings.objectives.verify import Verifier
from place_rings.placement.search.exchange import share_of
from place_rings.placement.search.exchange_points import Fields
from place_rings.placement.search.schedule import Round
from place_rings.placement.space.design import Space
from place_rings.placement.space.starts import fresh

from ..support.searching import search

SHORT = (Round(1024, 4, 1, 8, 0.2, 8, 1), Round(2048, 2, 1, 8, 0.05))
HAND = Detection()


def scene_of(occlusion="ignore", **fields):
    sensor = pr.sensors["vl53l1x"]
    return pr.Scene(
        robot="ur5e", targets=[pr.Near(0.3)], sensor=sensor, occlusion=occlusion, **fields
    )


@settings(max_examples=4)
@given(
    st.integers(0, 1000),
    st.sampled_from(["ignore", "shadow"]),
    st.sampled_from(["hand", "torso", "rod-40"]),
)
def test_candidates_are_judged_as_by_the_exact_count(seed, occlusion, piece):
    detection = Detection(piece=PIECES[piece])
    scene = scene_of(occlusion)
    space, aim = Space(scene, ring_layout(scene, 1, 6)), Criterion(detection=detection)
    fields = Fields.drawn(space, aim, 2000, seed)
    c = fresh(space, np.random.default_rng(seed))
    (points,) = fields.points.points
    exact = noticed_in(scene, space.setup(c), 0, detection).at(points).mean()
    # steps of 2 % of each sensor; the edges of shadows are sharp for the exchange
    assert share_of(space, fields, c) == pytest.approx(
        exact, abs=0.01 if piece != "torso" else 0.03
    )


@pytest.mark.slow
@pytest.mark.parametrize("budget", [{"layout": True}, {"sensors": 18}])
def test_a_search_keeps_its_budget_and_repeats_itself(budget):
    scene, aim = scene_of("shadow"), Criterion(detection=HAND)
    space = Space(scene, ring_layout(scene, 1, 6)) if "layout" in budget else Space(scene, **budget)
    schedule = tuple(replace(r, trials=40, library=200, beside=4) for r in SHORT)
    given = {"aim": aim, "seed": 2, "schedule": schedule, "voxel": 0.05}
    first, again = (search(space, **given) for _ in range(2))
    assert first.setup == again.setup
    assert first.setup.sensors == 18
    assert first.detection == HAND
    assert first.exact == judge(Verifier(scene, 0.05), first.setup, aim)[1]
    assert first.sampled == pytest.approx(first.exact, abs=0.05)
    start = replace(first, setup=search(space, seed=5, schedule=SHORT, voxel=0.05).setup).setup
    better = search(space, start=[start], **given)
    assert better.exact >= judge(Verifier(scene, 0.05), start, aim)[1] - 0.01


@pytest.mark.parametrize(
    ("given", "line"),
    [
        ({"detect": Detection(seconds=0.001)}, "frame"),
        ({"detect": Detection(at_least=9)}, "at most 8"),
        ({"detect": Detection(ambient="1e9klx")}, "light"),
        ({"detect": HAND, "losing": "ring"}, "losing"),
        ({"detect": HAND, "tolerant": True}, "tolerant"),
        ({"detect": HAND, "gap": True}, "gap"),
        ({"detect": replace(HAND, at_least=2), "redundancy": 3}, "2 sensors"),
    ],
)
def test_what_cannot_be_detected_is_one_line(given, line):
    with pytest.raises(InputError, match=line):
        pr.search(scene_of(), sensors=8, any_rings=True, voxel=0.05, **given)


@pytest.mark.slow
def test_a_proposal_keeps_what_it_was_searched_for(tmp_path):
    aim = Detection(piece=PIECES["arm"], seconds=0.3)
    call = {"sensors": 8, "any_rings": True, "time": 1, "voxel": 0.05, "redundancy": 2}
    proposal = pr.search(scene_of(), detect=aim, **call)
    assert proposal.found.detection == replace(aim, at_least=2)
    read = pr.load(proposal.save(tmp_path / "proposal.toml"))
    assert read.found.detection == proposal.found.detection
    assert read.found.exact == pytest.approx(proposal.value, abs=5e-7)
