"""Small spheres at random places of a target, and which of them a twin reports."""

from dataclasses import dataclass

import numpy as np
import place_rings as pr
from place_rings.placement.space.design import Space
from place_rings.placement.space.starts import fresh
from place_rings.simulation.twin.look import looks
from scipy import stats

RADIUS = 1e-3
"""Radius of a sphere, m."""
FINER = 32
"""Factor on the twin's rays, at which one meets every sphere within a beam, up to its range."""
ONE_ZONE, ZONES = ("paper", "vl53l1x"), ("vl53l5cx", "vl53l8cx")
_ROBOTS = ("ur10", "ur5e", "panda")
_VOXEL = 0.02  # m


@dataclass(frozen=True)
class ProbeShare:
    """Coverage of a drawn setup, and the share of spheres that its twin reports."""

    robot: str
    model: str
    """Model of the sensors; paper: the paper's."""
    sensors: int
    zeta: float
    error: float
    """Standard error of the count of ζ."""
    probes: int
    reported: int

    @property
    def interval(self):
        """95 % interval of the share (Clopper and Pearson)."""
        of = stats.binomtest(self.reported, self.probes).proportion_ci(0.95, "exact")
        return of.low, of.high

    @property
    def holds(self):
        low, high = self.interval
        return low - 2 * self.error <= self.zeta <= high + 2 * self.error


def drawn(number, models, probes):
    """The share of a drawn setup: random rings on a robot, under self-occlusion."""
    robot, model = _ROBOTS[number % 3], models[number // 3 % len(models)]
    sensor = {} if model == "paper" else {"sensor": pr.sensors[model]}
    scene = pr.Scene(
        robot=robot, targets=[pr.Shell(0.5)], occlusion="shadow",
        electronics=pr.Electronics(bus="own"), **sensor,
    )  # fmt: skip
    rng = np.random.default_rng(number)
    space = Space(scene, sensors=int(rng.integers(8, 25)))
    setup = space.setup(fresh(space, rng))
    counted = pr.verify(setup, scene, voxel=_VOXEL)
    target = scene.targets[0].target
    points = scene.sample(target, 0, 16 * probes, number)
    points = points[rng.choice(len(points), probes, replace=False)]
    twin = pr.twin(setup, scene, bodies=[pr.Sphere(RADIUS)], mask="scene", noise=None)
    fine = looks(setup, FINER)
    reported = sum(reports(twin, fine, point, RADIUS) for point in points)
    error = counted.each[0].error or 0.0
    return ProbeShare(robot, model, setup.sensors, counted.coverage, error, probes, reported)


def reports(twin, fans, point, radius):
    """Whether a reading of any sensor tells that the sphere is there. Only rays that may meet it
    are cast; ``twin.reset`` casts all."""
    twin.put(0, point)
    twin.world.place()
    apex, frame = twin.world.apex, twin.world.frame
    return any(
        _meets(twin, look, apex[k], frame[k], point, radius) for look in fans for k in look.sensors
    )


def _meets(twin, look, apex, frame, point, radius):
    v = (point - apex) @ frame
    away, edge = np.linalg.norm(v), look.rays[0, 2]  # the first ray is the outermost
    slack = radius / away
    if away > look.length.max() + radius or v[2] < away * (edge - slack):
        return False
    near = np.flatnonzero(look.rays @ v > np.sqrt(max(away**2 - radius**2, 0.0)))
    if not len(near):
        return False
    hits = twin.world.cast(apex, look.rays[near] @ frame.T)
    seen = hits.distance <= look.length[near]
    return bool((seen & ~twin.masked[hits.geom]).any())
