"""The map of unseen spheres in the viewer: what is drawn is in its bounds, and holds for one state
of the page."""

from dataclasses import replace

import numpy as np
import pytest
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.targets.named import Near
from place_rings.objectives.occlusion import setup_sight
from place_rings.objectives.scene import Scene
from place_rings.objectives.smallest_object import bodies_of
from place_rings.viewer import html as words
from place_rings.viewer.colours import LARGEST, SPHERES
from place_rings.viewer.drawing import Dots
from place_rings.viewer.drawn_parts import Cut, DrawnParts
from place_rings.viewer.long_task import JobStoppedError
from place_rings.viewer.server import Server
from place_rings.viewer.session import ViewerSession
from place_rings.viewer.unseen_spheres import unseen_spheres

from ..support.viser_client import Client

SMALL = Setup((Ring("upper_arm", 0.7, 6, 0.5), Ring("forearm", 0.4, 5, -0.3)))
SCENE = Scene(targets=(Near(0.05),))
CHOICE = DrawnParts(0, SCENE.targets[0], "shadow")


@pytest.fixture(scope="module")
def spheres():
    return unseen_spheres(SCENE, SMALL, CHOICE, lambda *_: None)


def test_each_place_is_drawn_once_in_the_class_of_its_diameter(spheres):
    drawn = [item for item in spheres.items(CHOICE).values() if isinstance(item, Dots)]
    assert sum(len(dots.points) for dots in drawn) == len(spheres.places) > 100
    middle = 1000 * spheres.diameters.mean(axis=0)
    for kind, colour in enumerate(SPHERES):
        points = [dots.points for dots in drawn if dots.colour == colour]
        mine = (middle // spheres.step).clip(max=len(SPHERES) - 1) == kind
        assert np.array_equal(np.concatenate([*points, np.zeros((0, 3))]), spheres.places[mine])
    assert (spheres.diameters[0] <= spheres.largest.high).all()
    assert 0 < spheres.unseen <= 1


def test_the_drawn_sphere_meets_no_beam_and_no_body(spheres):
    drawn = spheres.items(CHOICE)["largest"]
    centre = np.array(spheres.largest.centre)
    away = np.linalg.norm(drawn.vertices - centre, axis=1)
    assert drawn.colour == LARGEST
    assert away.max() <= spheres.largest.low / 2 + 1e-9
    seen = setup_sight(SCENE, SMALL, SCENE.poses[0].q)
    assert (np.asarray(seen(drawn.vertices)) >= -1e-3).all()
    bodies = bodies_of(SCENE, 0, np.stack([centre - 1, centre + 1]))
    assert (np.asarray(bodies(drawn.vertices)) >= -1e-3).all()


def test_a_cut_hides_places_and_another_state_has_another_map(spheres):
    cut = Cut((1.0, 0.0, 0.0), 0.2)
    kept = [i for i in spheres.items(replace(CHOICE, cut=cut)).values() if isinstance(i, Dots)]
    assert sum(len(dots.points) for dots in kept) == cut.keeps(spheres.places).sum()
    assert spheres.of(SMALL, replace(CHOICE, cut=cut, ring=1))
    assert not spheres.of(SMALL, replace(CHOICE, occlusion="ignore"))
    assert not spheres.of(Setup(SMALL.rings[:1]), CHOICE)
    assert spheres.largest.text in words.sphere_legend(spheres)


def test_finding_them_can_be_stopped():
    def tell(what, over):
        raise JobStoppedError

    with pytest.raises(JobStoppedError):
        unseen_spheres(SCENE, SMALL, CHOICE, tell)


@pytest.mark.slow
def test_a_page_finds_them_and_drops_them_with_the_setup():
    with Server(ViewerSession(SCENE, {"small": SMALL})) as server:
        page = Client(server.url)
        page.until(lambda: page.zeta("V_N(0.05)") is not None, "the page says no ζ")
        page.set("Find unseen spheres", True)
        page.until(lambda: "The largest:" in page.words, "no sphere was found")
        page.set("Add a ring on this link", True)
        page.until(lambda: "The largest:" not in page.words, "the map of another setup is shown")
        page.set("Remove this ring", True)
        page.until(lambda: "The largest:" in page.words, "what was found is not shown any more")
        page.close()
