"""What a person can touch: arms drawn in continuous space, closed forms, monotony."""

import itertools
import math
from dataclasses import replace

import numpy as np
import place_rings as pr
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.person_reach import LONGER, SHOULDER, SIDE, STEP, Person, person_region
from place_rings.coverage.solids.polyhedra import box, box_of, half_space
from place_rings.coverage.targets.named import Near, Shell
from place_rings.objectives.blind_spots import blind_spots
from place_rings.objectives.obstacle import Obstacle
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import Verifier
from place_rings.objectives.verify_breakdown import where_people_are
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from ..strategies.units import GENERATORS
from ..support.scene_tables import reread

BOX = np.array([[-0.6, -0.6, 0], [0.6, 0.6, 2.6]])
ARM = 0.05  # m, clearance of the drawn arms' axes


def drawn_cell(rng):
    table = box([0, 0, 0.75], [*rng.uniform(0.6, 2.0, 2), rng.uniform(0.005, 0.1)])
    turn = Rotation.from_euler("z", rng.uniform(0, 3)).as_matrix()
    wall = box([*rng.uniform(-1, 1, 2), 1.0], [0.02, rng.uniform(0.5, 3), 2.0], turn)
    shelf = box([*rng.uniform(-1, 1, 2), rng.uniform(0.3, 2.2)], rng.uniform(0.1, 0.8, 3))
    return tuple(b for b in (table, wall, shelf) if rng.random() < 0.7)


def drawn_person(rng):
    height = float(rng.uniform(1.5, 2.0))
    shoulder = float(rng.uniform(0.8, SHOULDER * height))
    area = rng.uniform(-2, 2, (3, 2)).tolist()
    return Person(
        height=height,
        shoulder=shoulder,
        radius=float(rng.uniform(0.1, 0.3)),
        reach=float(rng.uniform(0.1, 0.9)),
        areas=[area] if rng.random() < 0.3 else [],
    )


def gap(bodies, points):
    """Distance (N,) m from the nearest box, in closed form."""
    least = np.full(len(points), np.inf)
    for body in bodies:
        T, size = box_of(body)
        beyond = np.abs((points - T[:3, 3]) @ T[:3, :3]) - size / 2
        least = np.minimum(least, np.linalg.norm(np.maximum(beyond, 0), axis=1))
    return least


def between(a, b, step=0.01):
    return np.linspace(a, b, 2 + int(np.linalg.norm(b - a) / step))


def within(area, place):
    """Whether a place lies in a triangle."""
    a, b, c = np.array(area)
    u, v = np.linalg.solve(np.stack([b - a, c - a], axis=1), place - a)
    return u >= 0 and v >= 0 and u + v <= 1


def hands(rng, bodies, person, wanted=300):
    """Ends of straight and bent arms of people with room for body and arm."""
    ends = []
    for _ in range(wanted):
        place = rng.uniform(-2.2, 2.2, 2)
        stature = rng.uniform(person.shoulder / SHOULDER, person.height)
        if person.areas and not within(person.areas[0], place):
            continue
        low, high = STEP + person.radius, stature - person.radius
        axis = np.array([[*place, z] for z in np.arange(low, high, 0.01)])
        if not (gap(bodies, axis) >= person.radius).all():
            continue
        at = np.array([*place, rng.uniform(person.shoulder, SHOULDER * stature)])
        left = person.radius + person.reach
        for share in (rng.uniform(), 1.0):  # upper arm and forearm
            way = rng.normal(size=3)
            to = at + share * left * rng.uniform() ** 0.2 * way / np.linalg.norm(way)
            if to[2] < ARM or not (gap(bodies, between(at, to)) >= ARM).all():
                break
            left -= np.linalg.norm(to - at)
            at = to
            ends.append(to)
    return np.array(ends).reshape(-1, 3)


@pytest.mark.slow
@settings(max_examples=3, deadline=None)
@given(GENERATORS)
def test_all_that_drawn_arms_touch_belongs_to_the_region(rng):
    bodies, person = drawn_cell(rng), drawn_person(rng)
    region = person_region((*bodies, half_space(0.0)), person, 0.0, BOX)
    ends = hands(rng, bodies, person)
    ends = ends[((ends >= BOX[0]) & (ends <= BOX[1])).all(axis=1)]
    assert ends[~region.holds(ends)].tolist() == []


@settings(max_examples=3, deadline=None)
@given(GENERATORS, st.sampled_from(["reach", "height", "shoulder", "areas"]))
def test_the_region_grows_with_the_person_and_the_floor(rng, key):
    bodies, person = drawn_cell(rng), drawn_person(rng)
    more = {
        "reach": person.reach + 0.2,
        "height": person.height + 0.2,
        "shoulder": person.shoulder - 0.2,
        "areas": (),
    }
    points = rng.uniform(*BOX, (2000, 3))
    less, larger = (
        person_region(bodies, p, 0.0, BOX).holds(points)
        for p in (person, replace(person, **{key: more[key]}))
    )
    assert points[less & ~larger].tolist() == []


def test_people_reach_as_far_as_stated_and_no_farther():
    """At a rail, over its edge, and around the edge of a table: closed forms."""
    person = Person(areas=[[(-3, -3), (3, -3), (3, 0), (-3, 0)]])
    far, cube = person.radius + person.reach, SIDE
    points = np.random.default_rng(0).uniform(*BOX, (4000, 3))
    y, z = points[:, 1], points[:, 2]
    shoulders = np.clip(z, person.shoulder, SHOULDER * person.height)
    distance = np.hypot(np.maximum(y, 0), z - shoulders)
    free = person_region((), person, 0.0, BOX).holds(points)
    body = (y <= person.radius) & (z <= person.height)
    assert free[(distance <= far) | body].all()
    assert not free[(distance > far + 4 * cube) & ~((y < 0.4) & (z < 2.2))].any()
    table = box([0, 5, 0.75], [20, 10, 0.02])  # from the rail on, without an end
    under = z < 0.7
    edge = math.hypot(person.radius, person.shoulder - 0.74)  # to the edge of the table
    behind = person_region((table,), person, 0.0, BOX).holds(points)
    assert not behind[under & (y > LONGER * (far + 3 * cube - edge) + 2 * cube)].any()
    assert behind[under & (z > 0.6) & (y > 0) & (y < far - edge - 0.25)].all()


def test_no_path_is_longer_along_steps_than_stated():
    steps = np.array([s for s in itertools.product(range(-2, 3), repeat=3) if math.gcd(*s) == 1])
    units = steps / np.linalg.norm(steps, axis=1)[:, None]
    assert 1 / -ConvexHull(units).equations[:, 3].max() <= LONGER


def scene_of(*obstacles, person=None):
    return Scene(targets=(Shell(0.4),), obstacles=obstacles, person=person)


def test_nothing_changes_without_obstacles_over_a_low_floor():
    target = Shell(0.4)
    scene = scene_of(person=Person(floor=-0.75))
    counts = [
        Verifier(scene, 0.04).verify(pr.Setup.named("n2_16_25"), t).target_voxels
        for t in (target, replace(target, reachable="person"))
    ]
    assert counts[0] == counts[1]


def test_blind_spots_are_sought_where_a_person_can_be():
    wall = Obstacle("wall", box([0, 0.35, 1.0], [9, 0.02, 6]))
    front = Person(floor=-0.75, areas=[[(-3, -3), (3, -3), (3, 0.3), (-3, 0.3)]])
    setup, target = pr.Setup.named("n1_8_0"), Shell(0.6)
    each = [
        blind_spots(Verifier(scene_of(wall, person=p), 0.04), setup, target, [0])
        for p in (None, front)
    ]
    assert each[1].volume[0] < each[0].volume[0]
    assert min(s.centre[1] + s.radius for s in each[1].spots) < 0.4
    assert max(s.centre[1] for s in each[1].spots) < 0.35 + 2 * SIDE
    assert max(s.centre[1] for s in each[0].spots) > 0.4


@pytest.mark.parametrize(
    ("text", "where"),
    [
        ('[[targets]]\nname = "V_O"\nreachable = "person"\n', "targets[0].reachable"),
        ("[person]\nheight = 1.8\n", "person.floor"),
        ("[person]\nfloor = 0.0\nheight = 1.5\nshoulder = 1.4\n", "person.shoulder"),
        ("[person]\nfloor = 0.0\nareas = [[[0, 0], [1, 0]]]\n", "person.areas[0]"),
    ],
)
def test_faults_name_file_and_key(run, tmp_path, text, where):
    (tmp_path / "scene.toml").write_text(text)
    code, out, err = run("verify", "n1_8_0", "--scene", str(tmp_path / "scene.toml"))
    assert (code, out) == (2, "")
    assert where in err
    assert "scene.toml" in err


def test_a_part_at_one_pose_only_is_weighted_with_that_pose():
    """A person at one side; the arm turns away from it."""
    target, setup = Near(0.1), pr.Setup.named("n1_8_0")
    there, away = (Pose(np.radians([turn, -20, 20, -90, -90, 0]), 3.0) for turn in (0, 180))
    area = [(0.9, -0.6), (2, -0.6), (2, 0.6), (0.9, 0.6)]
    person = Person(floor=-0.7, areas=[area], reach=0.3)

    def part(*poses):
        scene = Scene(poses=poses, targets=(target,), person=person)
        verifier = Verifier(scene, 0.04)
        return where_people_are(verifier, setup, verifier.verify(setup, target))

    alone, turning = part(there), part(there, replace(away, weight=1.0))
    assert alone.share > 0.1
    assert part(away).share == 0
    assert turning.share == pytest.approx(0.75 * alone.share)
    assert turning.zeta == pytest.approx(alone.zeta)


def test_there_and_back():
    scene = pr.Scene(
        targets=pr.Shell(0.5, reachable="person"),
        person=pr.Person(areas=[[(0, 0), (1, 0), (0, 1)]], shoulder=1.0),
        obstacles=pr.Obstacle("floor", floor=-0.7),
    )
    back = reread(scene)
    assert (back.person, back.targets) == (scene.person, scene.targets)
    with pytest.raises(pr.InputError) as error:
        pr.Scene(targets=pr.Shell(0.5, reachable="person"))
    assert "reachable" in str(error.value)
