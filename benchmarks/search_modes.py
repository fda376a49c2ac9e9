"""Searches in every mode beside the plain one: processor time and the exact value of the answer.

Run: python benchmarks search_modes
     python benchmarks search_modes --seeds=2 --only=shadow   some rows
     python benchmarks search_modes --before=4d273b61   beside an earlier version
"""

import argparse
import json
import os
import re
import subprocess
import sys
import tarfile
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import mean
from typing import Any

from common import table

PEERS: tuple[str, ...] = ()
PLAIN = "plain"
_SQUARE = "vl53l5cx"


@dataclass(frozen=True)
class Mode:
    """One row: how a search differs from the plain one."""

    occlusion: str = "ignore"
    """Model of self-occlusion; anything but ``ignore`` comes with real mounts."""
    aim: str = ""
    """``seen``, ``ring``, ``sensor``, ``errors``, or empty for ζ itself."""
    free: int | None = None
    """Sensors in any rings; None: five rings."""
    each: int = 16
    """Sensors on each of the five rings."""
    radius: float = 0.5
    """Radius of the shell, m."""
    robot: str = "ur10"
    """The robot."""
    square: bool = False
    """Whether the beams are pyramids."""
    worst: bool = False
    """Whether the worst of the 200 poses of the paper's task counts."""
    limit: float | None = None
    """Largest ratio that is wanted."""


MODES = {
    PLAIN: Mode(),
    "shadow": Mode("shadow", limit=1.5),
    "blind": Mode("blind", limit=1.5),
    "square": Mode(square=True, each=6, radius=1.5, limit=1.5),
    "square, shadow": Mode("shadow", square=True, each=6, radius=1.5, limit=1.5),
    "UR5e, square, shadow, free": Mode("shadow", robot="ur5e", square=True, free=48),
    "free": Mode(free=80),
    "free, shadow": Mode("shadow", free=80),
    "free, shadow, 32 sensors": Mode("shadow", free=32),
    "free, V_S(1.5)": Mode(free=80, radius=1.5),
    "redundancy 2": Mode(aim="seen", limit=3),
    "redundancy 2, shadow": Mode("shadow", aim="seen", limit=3),
    "losing ring": Mode(aim="ring", limit=3),
    "losing ring, shadow": Mode("shadow", aim="ring", limit=3),
    "losing sensor": Mode(aim="sensor", limit=3),
    "losing sensor, shadow": Mode("shadow", aim="sensor", limit=3),
    "tolerant": Mode(aim="errors", limit=3),
    "tolerant, shadow": Mode("shadow", aim="errors", limit=3),
    "worst of 200 poses": Mode(worst=True),
}


def _scene(mode: Mode) -> Any:
    from place_rings.coverage.robots.built_in import robot as built_in
    from place_rings.coverage.sensors.effective_range import effective
    from place_rings.coverage.sensors.sensor import Use
    from place_rings.coverage.targets import Target
    from place_rings.objectives.scene import CoreScene, Goal, Pose, as_in_paper
    from place_rings.objectives.trajectory import MotionRecord, thin
    from place_rings.simulation.pick_and_place import pick_and_place

    robot = built_in(mode.robot)
    scene = CoreScene(
        robot=robot,
        goals=(Goal(Target("V_S", mode.radius)),),
        occlusion=mode.occlusion if mode.occlusion != "ignore" else "shadow",
    )
    if mode.square:
        scene = replace(scene, sensor=effective(Use(_SQUARE)).sensor)
    if mode.occlusion == "ignore":
        scene = as_in_paper(scene)
    if mode.worst:
        motion = pick_and_place(robot, 50.0)
        poses = thin(MotionRecord(motion.time_s, motion.q), robot).poses
        scene = replace(scene, poses=poses, over_poses="worst")
    elif mode.robot != "ur10":
        scene = replace(scene, poses=(Pose(robot.rest),))
    return scene


def _aim(mode: Mode) -> Any:
    from place_rings.coverage.rings.mounting_errors import MountingErrors
    from place_rings.objectives.criterion import Criterion

    return {
        "": Criterion(),
        "seen": Criterion(seen=2),
        "ring": Criterion(losing="ring"),
        "sensor": Criterion(losing="sensor"),
        "errors": Criterion(errors=MountingErrors()),
    }[mode.aim]


def measure(name: str, seed: int) -> dict[str, float]:
    """Search once in this process.

    Returns:
        Processor seconds of the search, from the rules to the chosen finalist; exact value of the
            answer in percent; and rings and peak memory, MB.
    """
    import resource

    from place_rings.placement.search.design import Space
    from place_rings.placement.search.layout import ring_layout
    from place_rings.placement.search.search import search

    mode = MODES[name]
    scene, aim, began = _scene(mode), _aim(mode), time.process_time()
    if mode.free is None:
        space = Space(scene, ring_layout(scene, 2, mode.each))
    else:
        space = Space(scene, sensors=mode.free)
    result = search(scene, space, seed=seed, aim=aim)
    seconds = time.process_time() - began
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    rings = len(result.setup.rings)
    return {"seconds": seconds, "exact": 100 * result.exact, "rings": rings, "peak": peak}


def _in_a_process(name: str, seed: int, version: Path | None = None) -> dict[str, float]:
    """Search in a new process, with the version of place-rings in a folder if one is given."""
    words = [sys.executable, __file__, name, str(seed)]
    alone = os.environ | {"OMP_NUM_THREADS": "1"}
    if version:
        alone["PYTHONPATH"] = str(version)
    done = subprocess.run(words, check=True, stdout=subprocess.PIPE, text=True, env=alone)
    measured: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return measured


def _installed(commit: str, folder: Path) -> Path:
    """Install place-rings as it was at a commit; return the folder to import it from."""
    source, version, tar = folder / "source", folder / "version", folder / "source.tar"
    archive = ["git", "archive", f"--output={tar}", commit]
    subprocess.run(archive, check=True, cwd=Path(__file__).parent.parent)
    with tarfile.open(tar) as files:
        files.extractall(source, filter="data")
    words = [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--target", version, source]
    subprocess.run(words, check=True)
    return version


def _row(name: str, seeds: range, before: Path | None) -> list[str]:
    """Return the row of a mode. A plain search runs before and after each of its searches, as the
    speed of a machine may change within minutes."""
    each, plain = [], []
    for seed in seeds:
        plain.append(_in_a_process(PLAIN, seed))
        each.append(_in_a_process(name, seed))
        plain.append(_in_a_process(PLAIN, seed))
    seconds, of_plain = (mean(one["seconds"] for one in some) for some in (each, plain))
    limit = MODES[name].limit
    row = [
        name,
        f"{seconds:.1f}",
        f"{of_plain:.1f}",
        f"{seconds / of_plain:.2f}",
        "-" if limit is None else f"{limit:g}",
        ", ".join(f"{one['exact']:.2f}" for one in each),
        ", ".join(f"{one['rings']:.0f}" for one in each),
        f"{max(one['peak'] for one in each):.0f}",
    ]
    if before:
        earlier = [_in_a_process(name, seed, before) for seed in seeds]
        row += [
            f"{mean(one['seconds'] for one in earlier):.1f}",
            ", ".join(f"{one['exact']:.2f}" for one in earlier),
        ]
    print(*row, sep=" | ", flush=True)
    return row


def report(options: Sequence[str] = ()) -> list[str]:
    """Run each row in new processes, one per seed, and return Markdown."""
    parser = argparse.ArgumentParser(prog="search_modes", allow_abbrev=False)
    parser.add_argument("--seeds", type=int, default=1, help="number of seeds, from 0")
    parser.add_argument("--only", default="", help="regular expression for the names of rows")
    parser.add_argument("--before", help="commit of an earlier version of place-rings")
    given = parser.parse_args(list(options))
    names = [n for n in MODES if n != PLAIN and re.search(given.only, n)]
    if given.seeds < 1 or not names:
        parser.error("--seeds: allowed: 1 or more; --only: allowed: " + ", ".join(MODES))
    columns = [
        *("mode", "processor s", "of plain", "ratio", "wanted", "exact value, %"),
        *("rings", "peak, MB"),
    ]
    about = (
        "80 sensors for V_S(0.5) on a UR10 unless a row says otherwise; the plain search is that of"
        " `--paper` in five rings of 16. Each search runs in a new process, between two plain ones,"
        " whose mean processor seconds are those of plain; the speed of a machine may change within"
        " minutes. The value is that of the criterion: ζ, covered by two, after the worst loss, the"
        " mean of 16 mountings, or ζ at the worst pose."
    )
    with tempfile.TemporaryDirectory() as temporary:
        before = None
        if given.before:
            before = _installed(given.before, Path(temporary))
            columns += ["processor s before", "exact value before, %"]
            about += f" Before: commit `{given.before}`, measured in the same run."
        for version in dict.fromkeys((None, before)):
            _in_a_process(PLAIN, 0, version)  # a first run after an installation compiles modules
        rows = [_row(name, range(given.seeds), before) for name in (PLAIN, *names)]
    return [about, "", *table(columns, rows)]


if __name__ == "__main__":
    print(json.dumps(measure(sys.argv[1], int(sys.argv[2]))))
