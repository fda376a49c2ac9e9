"""The picture of the coverage at each pose."""

import math
from dataclasses import replace

import numpy as np
import place_rings as pr
import pytest
from place_rings.cli.app import app
from place_rings.reporting import plot_by_pose as module

from ..support.refusals import refused

ELBOWS = (30, 50, 70, 90, 110)
SCENE = pr.Scene(
    poses=[pr.Pose(q=np.radians([0, -90, e, 0, 90, 0])) for e in ELBOWS], targets=[pr.Shell(0.4)]
)


@pytest.mark.parametrize("rule", ["sampled", "certified"])
@pytest.mark.parametrize("moving", [True, False])
def test_the_curve_holds_each_pose_and_lies_in_its_band(rule, moving, tmp_path, monkeypatch):
    poses = [replace(p, time_s=2.0 * i if moving else None) for i, p in enumerate(SCENE.poses)]
    counted = pr.verify("n1_8_0", replace(SCENE, poses=poses), voxel=0.08, rule=rule)
    kept = []
    monkeypatch.setattr(module, "save", lambda figure, file: kept.append(figure))
    module.plot_by_pose(counted.each, counted.scene, tmp_path / "zeta.png")
    (ax,) = kept[0].axes
    curve = ax.lines[0].get_xydata()
    assert curve[:, 0] == pytest.approx(np.arange(5) * (2.0 if moving else 1.0))
    assert curve[:, 1] == pytest.approx(100 * np.array(counted.by_pose))
    band = ax.collections[0].get_paths()[0].vertices
    for (x, y), pose in zip(curve, counted.each[0].poses, strict=True):
        here = band[np.isclose(band[:, 0], x), 1]
        assert here.min() <= y <= here.max()
        wide = 100 * (2 * (pose.error or 0) if rule == "sampled" else pose.high - pose.low)
        assert np.ptp(here) == pytest.approx(wide)
    worst = ax.lines[-1].get_xydata()[0]
    assert worst[1] == curve[:, 1].min()
    assert math.isclose(ax.lines[1].get_ydata()[0], 100 * counted.each[0].zeta)
    assert moving or all(tick == round(tick) for tick in ax.get_xticks())


def test_a_picture_is_shown_and_written(tmp_path):
    path = tmp_path / "zeta.png"
    picture = pr.verify("n1_8_0", SCENE, voxel=0.1).plot_by_pose(path)
    assert picture.png == path.read_bytes()
    assert path.read_bytes().startswith(b"\x89PNG")


def test_one_pose_is_refused(tmp_path):
    path = tmp_path / "zeta.png"
    with refused("--plot-by-pose", "one pose"):
        app(["verify", "n1_8_0", "--plot-by-pose", str(path)], result_action="return_value")
    with refused("poses", "one pose", error=pr.InputError):
        pr.verify("n1_8_0", voxel=0.1).plot_by_pose(path)
    assert not path.exists()
