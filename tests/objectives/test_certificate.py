"""Certificates of guaranteed intervals, judged by the checker of examples/, which shares no code
with the package."""

import json
import math
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import place_rings as pr
import pytest

CHECK = Path(__file__).resolve().parents[2] / "examples" / "certificate" / "check.py"
File = dict[str, Any]


@pytest.fixture(autouse=True)
def path_of_scripts(monkeypatch: pytest.MonkeyPatch) -> None:
    """A script finds the modules beside it, as for most users."""
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)


def checked(path: Path) -> subprocess.CompletedProcess[str]:
    """Return the checker's run on a certificate."""
    command = [sys.executable, str(CHECK), str(path)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def certified(path: Path, setup: str, width: float, **scene: Any) -> pr.Coverage:
    """Write the certificate of a setup, and return its coverage."""
    return pr.verify(setup, pr.Scene(**scene), rule="certified", width=width, certificate=path)


def proven(path: Path) -> list[list[float]]:
    """Return the intervals that the checker derives, percent; it must accept the certificate."""
    run = checked(path)
    assert run.returncode == 0, run.stderr
    return [[float(w) for w in line.split()[1:4:2]] for line in run.stdout.splitlines()]


TABLE = pr.Obstacle("table", centre=[0.8, 0, -0.1], size=[0.6, 1.2, 0.2])
SCENES = {
    "cones": {"occlusion": "ignore", "targets": [pr.Shell(0.5)]},
    "pyramids, floor and table": {
        "occlusion": "shadow",
        "targets": [pr.Near(0.2)],
        "sensor": pr.sensors["vl53l5cx"],
        "obstacles": [pr.Obstacle("floor", floor=-0.05), TABLE],
    },
    "two targets and two poses": {
        "occlusion": "shadow",
        "targets": [
            pr.Sphere(0.3, centre=[0.4, 0.2, 0.6]),
            pr.Box([0.3, 0.4, 0.5], centre=[0.4, 0.2, 0.6]),
        ],
        "poses": [[0.0, -1.2, 1.0, -1.0, -1.5, 0.0], [0.5, -1.0, 1.2, -1.0, -1.5, 0.0]],
    },
}


LONG = ("cones", "two targets and two poses")


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.slow] * (n in LONG)) for n in SCENES]
)
def test_checker_derives_the_stated_interval(name: str, tmp_path: Path) -> None:
    path = tmp_path / "proof.npz"
    coverage = certified(path, "n1_8_0", 8.0, **SCENES[name])
    counted = pr.verify("n1_8_0", coverage.scene, voxel=0.03)
    for (low, high), each, count in zip(proven(path), coverage.each, counted.each, strict=True):
        assert 100 * each.low <= low + 1e-4
        assert high - 1e-4 <= 100 * each.high
        assert each.high - each.low <= 0.08
        assert low - 1 <= 100 * count.zeta <= high + 1


@pytest.fixture(scope="module")
def proof(tmp_path_factory: pytest.TempPathFactory) -> File:
    path = tmp_path_factory.mktemp("certificate") / "proof.npz"
    ball = pr.Sphere(0.6, centre=[0.4, 0.0, 0.5])  # quick to check, and some of it in shadows
    certified(path, "n1_8_0", 8.0, occlusion="shadow", targets=[ball])
    with np.load(path, allow_pickle=False) as file:
        return dict(file)


def _statement(change: Callable[[Any], None]) -> Callable[[File], None]:
    def changed(file: File) -> None:
        statement = json.loads(str(file["statement"]))
        change(statement)
        file["statement"] = np.array(json.dumps(statement))

    return changed


def _more(statement: Any) -> None:
    statement["coverage"] = {k: [low + 0.05, high] for k, (low, high) in _of(statement)}


def _less(statement: Any) -> None:
    statement["coverage"] = {k: [low, high - 0.05] for k, (low, high) in _of(statement)}


def _of(statement: Any) -> Any:
    return statement["coverage"].items()


def _turn(statement: Any) -> None:
    axes = statement["items"][0]["sensors"]["cones"]["axis"]
    axes[0] = [-v for v in axes[0]]


def _shorter(statement: Any) -> None:
    lengths = statement["items"][0]["sensors"]["cones"]["length"]
    lengths[:] = [0.1 * v for v in lengths]


def _unhidden(statement: Any) -> None:
    statement["items"][0]["sensors"]["capsules"] = {"start": [], "end": [], "radius": []}


def _weight(statement: Any) -> None:
    statement["items"][0]["weight"] = 1.1


def _cell_gone(file: File) -> None:
    for key in ("level_0", "claim_0", "by_0"):
        file[key] = np.delete(file[key], len(file[key]) // 2)


def _open_as_covered(file: File) -> None:
    file["claim_0"][np.flatnonzero(file["claim_0"] == 2)[0]] = 1


def _inside_as_outside(file: File) -> None:
    file["claim_0"][np.flatnonzero(file["claim_0"] == 1)[0]] = 0


def _other_sensor(file: File) -> None:
    k = np.flatnonzero(file["claim_0"] == 1)[0]
    file["by_0"][k] = (file["by_0"][k] + 4) % 24


def _levels_below_none(file: File) -> None:
    level = file["level_0"].astype(int)
    file["level_0"] = np.where(level >= 12, level - 22, level)  # so as an index wraps around


def _twice(file: File) -> None:
    def change(statement: Any) -> None:
        statement["items"] = [item | {"weight": 0.5} for item in 2 * statement["items"]]

    _statement(change)(file)
    file.update({f"{key}_1": file[f"{key}_0"] for key in ("level", "claim", "by")})


def _more_elsewhere(statement: Any) -> None:
    """Add a part of the target beyond all cubes."""
    ball = {"capsules": {"start": [[99, 0, 0]], "end": [[99, 0, 0]], "radius": [50]}}
    item = statement["items"][0]
    item["target"] = {"union": [item["target"], ball]}


def _one_more(half: float, length: float) -> Callable[[Any], None]:
    def change(statement: Any) -> None:
        cones = statement["items"][0]["sensors"]["cones"]
        for key, value in (("apex", [9, 9, 9]), ("axis", [0, 0, 1])):
            cones[key].append(value)
        cones["half"].append(half)
        cones["length"].append(length)

    return change


def _longer_axes(statement: Any) -> None:
    cones = statement["items"][0]["sensors"]["cones"]
    cones["axis"] = [[1.0005 * v for v in axis] for axis in cones["axis"]]


def _slab_from_the_end(statement: Any) -> None:
    def tubes(node: Any) -> Any:
        for key, value in node.items():
            if key == "tube":
                yield value
            elif isinstance(value, list):
                for part in value:
                    yield from tubes(part)

    for tube in tubes(statement["items"][0]["target"]):
        tube["first"][0] -= len(tube["discs"])


def _renamed(statement: Any) -> None:
    name = "V_S(0.5): 99.0000 to 99.9000 % proven\nx"
    statement["coverage"] = dict.fromkeys([name], *statement["coverage"].values())
    statement["items"][0]["name"] = name


def _key_twice(file: File) -> None:
    file["statement"] = np.array('{"occlusion": "ignore", ' + str(file["statement"])[1:])


TAMPERED: dict[str, Callable[[File], None]] = {
    "a higher lower end": _statement(_more),
    "a lower upper end": _statement(_less),
    "a sensor turned": _statement(_turn),
    "shorter ranges": _statement(_shorter),
    "a robot that hides nothing": _statement(_unhidden),
    "a weight": _statement(_weight),
    "a cell missing": _cell_gone,
    "an uncovered cell as covered": _open_as_covered,
    "a covered cell as outside": _inside_as_outside,
    "another sensor": _other_sensor,
    "levels that wrap around": _levels_below_none,
    "a part of the target beyond the cubes": _statement(_more_elsewhere),
    "a pose twice": _twice,
    "a half angle above 90 degrees": _statement(_one_more(2.0, 0.01)),
    "a negative length": _statement(_one_more(0.1, -1.0)),
    "a length that is no number": _statement(_one_more(0.1, math.nan)),
    "axes that are no unit vectors": _statement(_longer_axes),
    "a slab before the first disc": _statement(_slab_from_the_end),
    "no coverage": _statement(lambda statement: statement["coverage"].clear()),
    "another version": _statement(lambda statement: statement.update(certificate=2)),
    "a name that states a result": _statement(_renamed),
    "a key twice": _key_twice,
}


LIKE_OTHERS = (  # each meets the same check as another one does
    "a lower upper end",
    "shorter ranges",
    "a negative length",
    "a length that is no number",
)


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.slow] * (n in LIKE_OTHERS)) for n in TAMPERED]
)
def test_tampered_certificate_is_refused(name: str, proof: File, tmp_path: Path) -> None:
    file = {key: array.copy() for key, array in proof.items()}
    TAMPERED[name](file)
    np.savez(tmp_path / "tampered.npz", **file)
    run = checked(tmp_path / "tampered.npz")
    assert run.returncode == 1
    assert run.stderr.startswith("refused: ")


def test_files_that_are_no_certificates_are_refused(proof: File, tmp_path: Path) -> None:
    (tmp_path / "text.npz").write_text("no certificate")
    np.savez(tmp_path / "pickle.npz", **(proof | {"by_0": np.array([{}], object)}))
    for name in ("text.npz", "pickle.npz", "absent.npz"):
        run = checked(tmp_path / name)
        assert run.returncode == 1
        assert run.stderr.startswith("refused: ")


@pytest.mark.parametrize(
    "scene",
    [
        {"occlusion": "blind", "targets": [pr.Shell(0.5)]},
        {"sensor": pr.Sensor(0.5, 1.0, shape="dome"), "targets": [pr.Shell(0.5)]},
    ],
)
def test_what_certificates_do_not_describe_is_refused_before_the_work(
    scene: dict[str, Any], tmp_path: Path
) -> None:
    with pytest.raises(pr.InputError):
        certified(tmp_path / "proof.npz", "n1_8_0", 8.0, **scene)
    assert not list(tmp_path.iterdir())


def test_certificate_needs_the_rule_certified(tmp_path: Path) -> None:
    with pytest.raises(pr.InputError, match="certificate"):
        pr.verify("n1_8_0", voxel=0.1, certificate=tmp_path / "proof.npz")


def test_slabs_that_do_not_follow_each_other_hold_nothing_between_them() -> None:
    code = """
import numpy as np, check
discs = [[x, 0, 0] for x in (-0.3, -0.2, 0.2, 0.3)]
cube = np.zeros((1, 3)), np.array([0.1])
for first in ([0, 2], [0, 1, 2]):
    low, high = check.tube(discs, [[1, 0, 0]] * 4, 1.0, first, *cube)
    print(low[0], high[0])
"""
    run = subprocess.run(
        [sys.executable, "-c", code], cwd=CHECK.parent, capture_output=True, text=True, check=True
    )
    assert run.stdout.split() == ["0.0", "0.0", "1.0", "1.0"]
