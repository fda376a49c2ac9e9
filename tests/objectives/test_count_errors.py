"""The stated error of a count holds where faces lie on lattice planes, beside guaranteed intervals.

Drawn cells: tables and walls with faces at whole and half voxels, beams along the axes, small boxes
and balls, and weight grids.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from place_rings.coverage.rings.ring import Ring, Setup, named_setup
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.coverage.targets.named import Shell
from place_rings.coverage.targets.own import Box, Sphere
from place_rings.coverage.targets.target import Target
from place_rings.coverage.weight_field import WeightField
from place_rings.objectives.obstacle import Obstacle
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import Verifier

VOXEL = 0.04
UPRIGHT = Pose(np.radians([0.0, -90, 0, -90, -90, 0]))
KINDS = ("table", "walls", "box", "ball", "weights", "beams")


def at_half_voxels(rng, low, high, shape=()):
    """Lengths, m, at multiples of half a voxel: where voxel centres and faces of voxels lie."""
    return rng.integers(round(2 * low / VOXEL), round(2 * high / VOXEL) + 1, shape) * VOXEL / 2


def slab(name, low, high):
    low, high = np.array(low), np.array(high)
    centre, size = (low + high) / 2, high - low
    return Obstacle(name, centre=centre, size=size)


def some_cell(kind, rng) -> tuple[Scene, Setup, Target]:
    """A scene, a layout and a target of this kind, drawn."""
    setup = named_setup(str(rng.choice(["n1_8_0", "n1_16_0"])))
    pose = Pose(
        np.radians(rng.uniform([-180, -120, 20, -150, -120, 0], [180, -40, 110, -60, -60, 1]))
    )
    occlusion = str(rng.choice(["ignore", "shadow", "blind"]))
    scene = replace(Scene.paper(poses=(pose,)), occlusion=occlusion)
    target = Shell(float(rng.choice([0.3, 0.5])))
    table = slab("table", (-1, -1, -0.5), (1, 1, at_half_voxels(rng, -0.1, 0.1)))
    if kind == "table":
        scene = replace(scene, obstacles=(table,))
    elif kind == "walls":
        y = at_half_voxels(rng, 0.2, 0.5)
        x = at_half_voxels(rng, 0.2, 0.5)
        walls = (
            slab("side", (-1, y, -1), (1, y + 0.3, 1)),
            slab("front", (x, -1, -1), (x + 0.3, 1, 1)),
        )
        scene = replace(scene, obstacles=(table, *walls))
    elif kind == "beams":
        flat = math.radians(float(rng.choice([1.0, 3.0, 8.0])))
        sensor = Sensor(math.radians(45), 1.0, None, flat, 8)
        where, links = float(rng.uniform(0.2, 0.8)), ("upper_arm", "forearm")
        setup = Setup(tuple(Ring(link, where, 8, sensor=sensor) for link in links))
        scene = Scene.paper(sensor=sensor, poses=(UPRIGHT,))
    elif kind == "ball":
        target = Sphere(
            rng.uniform(0.05, 0.2), tuple(at_half_voxels(rng, -0.5, 0.5, 3) + np.array([0, 0, 0.6]))
        )
    else:
        low = at_half_voxels(rng, -0.6, 0.1, 3) + np.array([0, 0, 0.3])
        size = at_half_voxels(rng, 0.08, 0.8, 3)
        target = Box(size, low + size / 2)
        if kind == "weights":
            weights = rng.integers(0, rng.choice([2, 5, 1000]), (4, 4, 4)) + (
                rng.random((4, 4, 4)) < 0.1
            )
            weights.flat[0] += 1
            field = WeightField.of(weights.astype(float), low, size / 4)
            target = replace(target, importance=field)
    return replace(scene, targets=(target,)), setup, target


def outside(kind, seed) -> float | None:
    """How far beyond the stated error the count is from a guaranteed interval, in errors; None for
    a target that is empty or inside the robot."""
    scene, setup, target = some_cell(kind, np.random.default_rng(seed))
    try:
        found = Verifier(scene, VOXEL).verify(setup, target)
        width = max(found.error / 3, 5e-4)
        proof = Verifier(scene, None, "certified", width).verify(setup, target)
    except ValueError:
        return None
    assert 0 < found.error <= 1
    return max(proof.low - found.zeta, found.zeta - proof.high) / found.error


@pytest.mark.parametrize("kind", KINDS)
def test_the_stated_error_holds_at_flat_faces(kind):
    assert (outside(kind, 2) or 0) <= 1


@pytest.mark.slow
def test_the_stated_error_holds_as_often_as_stated():
    """Of 200 cells at most one may be beyond 99.9 % errors: two are with a probability of 1.8 %."""
    each = [(kind, seed, outside(kind, seed)) for seed in range(40) for kind in KINDS]
    counted = [one for one in each if one[2] is not None]
    assert len(counted) >= 200
    assert sum(beyond > 1 for _, _, beyond in counted) <= 1, [c for c in counted if c[2] > 1]
