"""The cells of examples/: scenes that anybody may start from."""

from pathlib import Path

import numpy as np
import place_rings as pr
import pytest
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.link_bodies import robot_capsules

CELLS = sorted((Path(__file__).resolve().parents[2] / "examples" / "cells").glob("*.toml"))


@pytest.mark.parametrize("cell", CELLS, ids=lambda path: path.stem)
def test_robot_is_clear_of_its_cell_and_rings_see_it(cell: Path) -> None:
    scene = pr.load(cell)
    assert isinstance(scene, pr.Scene)
    for pose in scene.poses:
        start, end, radius = robot_capsules(
            scene.robot, forward(scene.robot.chain, pose.q)
        ).arrays()
        axis = start[1:, None] + np.linspace(0, 1, 50)[:, None] * (end - start)[1:, None]
        for obstacle in scene.obstacles:  # the first body is the base, which stands on something
            gaps = np.asarray(obstacle.body(axis.reshape(-1, 3))).reshape(axis.shape[:2])
            assert (gaps.min(axis=1) - radius[1:]).min() > 0.05, obstacle.name
    assert 0.05 < pr.verify("n1_8_0", scene, voxel=0.08).coverage < 0.95


def test_there_are_five_cells() -> None:
    assert len(CELLS) == 5
