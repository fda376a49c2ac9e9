"""Robots of other people: which URDFs of a folder load, and how.

Run: python benchmarks/urdfs.py FOLDER [--type=TEXT] [--capsules=N] [--fit-every=N] [--jobs=N]
     [--out=FILE [--resume]]

FOLDER holds URDFs with files meta-information.json beside or above them that state the type of each
(public: Daniella1/urdf_files_dataset). Each file is read as the commands read it: without options,
then with the option that the refusal itself names. A robot that loads must survive its robot file,
have finite bodies and a mount, and its tip must stand where yourdfpy puts it at 20 drawn joint
vectors. --fit-every=N fits bodies to each N-th file only; of the others the meshes are read. --out
keeps a line of JSON for each file, and --resume takes the outcomes that it has already.
"""

import json
import multiprocessing
import os
import re
import shlex
import sys
import time
from collections import Counter, defaultdict
from concurrent.futures import ThreadPoolExecutor
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
from common import installed, missing, table
from place_rings.cli.options.reading import ReadingOptions
from place_rings.coverage.choices import Surface
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.link_bodies import robot_capsules
from place_rings.formats.errors import UserError
from place_rings.formats.robots.robot_fit import fit_robot
from place_rings.formats.robots.urdf import read_urdf
from place_rings.formats.robots.urdf_folding import Picked
from place_rings.formats.schema.robot_models import RobotFile, robot_of

LIMIT = 60.0  # s of processor time, most for a file
VECTORS = 20
SURFACES: tuple[Surface, ...] = ("collision", "visual")
EXACT = 1e-6  # m and components of unit vectors, largest difference of the tip's pose
OUTCOMES = ("by default", "with the named option", "one-line refusal", "traceback", "over 60 s")
_OPTION = re.compile(r"--(base|tip|hold|packages|package) ")


def files(folder: Path) -> list[tuple[str, Path]]:
    """Return type and path of every URDF that a meta-information.json lists."""
    found = []
    for meta in sorted(folder.rglob("meta-information.json")):
        for robot in json.loads(meta.read_text())["robots"]:
            found += [(robot["type"], meta.parent / name) for name in robot["urdf"]]
    return found


def named_options(line: str) -> ReadingOptions | None:
    """Return the options that a refusal names, the first of several choices; None if it names none
    that could be typed as they stand."""
    line = line.partition("; --skip-missing-meshes")[0]  # a robot without a mesh is another one
    start = _OPTION.search(line.rpartition("; ")[2])
    if start is None:
        return None
    words = shlex.split(line.rpartition("; ")[2][start.start() :].split(", or ")[0])
    given: dict[str, Any] = {}
    for option, value in zip(words[::2], words[1::2], strict=False):
        key = option.removeprefix("--")
        if not option.startswith("--") or value.endswith("=FOLDER"):
            return None
        if key in ("base", "tip"):
            given[key] = value
        else:
            given[key] = (*given.get(key, ()), Path(value) if key == "packages" else value)
    return ReadingOptions(**given)


def farthest_tip(picked: Picked) -> float | None:
    """Return the largest difference of the tip's poses from yourdfpy's; None if that reader refuses
    the file."""
    import yourdfpy

    try:
        peer = yourdfpy.URDF.load(picked.urdf.path, load_meshes=False, build_scene_graph=False)
        held = {h.joint: h.value for h in picked.held}
        for joint in peer.robot.joints:
            if joint.name in held:  # a held joint follows no other
                joint.mimic = None
        peer = yourdfpy.URDF(peer.robot, load_meshes=False)
    except Exception:  # whatever the other reader raises
        return None
    chain, actuated = picked.chain, set(peer.actuated_joint_names)
    q = np.random.default_rng(0).uniform(
        *np.clip(picked.limits, -np.pi, np.pi).T, (VECTORS, len(chain))
    )
    worst = 0.0
    for one in q:
        values = held | dict(zip(chain.joints, one, strict=True))
        peer.update_cfg({name: value for name, value in values.items() if name in actuated})
        off = forward(chain, one)[-1] - peer.get_transform(picked.tip, picked.base)
        worst = max(worst, float(np.abs(off).max()))
    return worst


def load(path: Path, reading: ReadingOptions, capsules: int) -> dict[str, Any]:
    """Return what became of a file: the robot's parts, or the line of the refusal."""
    options = reading.resolve()
    try:
        picked = options.pick(read_urdf(path))
        meshes = options.meshes(picked.urdf)
        surfaces = [meshes.surface(c, k) for c in picked.carried for k in SURFACES]
        found = {
            "joints": len(picked.chain),
            "tip": picked.tip,
            "held": len(picked.held),
            "links": len(picked.carried),
            "triangles": sum(map(len, surfaces)),
            "kinematics": farthest_tip(picked),
        }
        if not capsules:
            return found
        fit = fit_robot(picked, meshes, picked.urdf.name, capsules)
    except UserError as error:
        return {"refusal": str(error)}
    robot = robot_of(RobotFile.model_validate(RobotFile.from_domain(fit.robot).model_dump()))
    bodies = robot_capsules(robot, forward(robot.chain, robot.rest)) if robot.bodies else None
    finite = bodies is None or all(np.isfinite(v).all() for v in (bodies.start, bodies.end))
    if not finite or not robot.mounts or not robot.reach > 0:
        raise ValueError("a robot that no scene can use")
    return found | {
        "bodies": len(robot.bodies),
        "mounts": len(robot.mounts),
        "notes": list(fit.notes),
    }


def _work(path: Path, capsules: int, answer: Connection) -> None:
    begun, reading, found = time.process_time(), ReadingOptions(), {}
    for outcome in OUTCOMES[:2]:
        try:
            found = load(path, reading, capsules)
        except Exception as error:  # counted as a traceback
            found, outcome = {"error": f"{type(error).__name__}: {error}"}, OUTCOMES[3]
            break
        if "refusal" not in found:
            break
        answer.send({"outcome": OUTCOMES[2], "first": found["refusal"]})
        if "\n" in found["refusal"] or (named := named_options(found["refusal"])) is None:
            break
        reading = named
    outcome = OUTCOMES[2] if "refusal" in found else outcome
    answer.send({"outcome": outcome, **found, "seconds": time.process_time() - begun})


def judge(path: Path, capsules: int) -> dict[str, Any]:
    """Return the outcome of a file, in a process of its own that is stopped after the time limit of
    a loaded machine."""
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe(False)
    process = context.Process(target=_work, args=(path, capsules, theirs))
    process.start()
    theirs.close()
    found: dict[str, Any] = {"outcome": OUTCOMES[3]}
    try:
        while ours.poll(20 * LIMIT):
            found |= ours.recv()
    except EOFError:
        pass
    else:
        process.kill()
        found["outcome"] = OUTCOMES[4]
    process.join()
    if found.get("seconds", 0.0) > LIMIT:
        found["outcome"] = OUTCOMES[4]
    return found


def report(options: list[str]) -> list[str]:
    """Return the table of the files in ``--folder``."""
    given = dict(option.removeprefix("--").partition("=")[::2] for option in options)
    if "folder" not in given:
        raise SystemExit("urdfs: --folder=FOLDER is missing: URDFs with meta-information.json")
    if not installed("yourdfpy"):
        return [missing("yourdfpy")]
    folder, kinds = Path(given["folder"]).resolve(), given.get("type", "")
    listed = [(kind, path) for kind, path in files(folder) if re.search(kinds, kind)]
    listed = [(kind, path) for kind, path in listed if given.get("name", "") in str(path)]
    counts: defaultdict[str, Counter[str]] = defaultdict(Counter)
    worst, compared = 0.0, 0
    seconds: tuple[list[float], list[float]] = ([], [])  # read only, and with bodies
    out = Path(given.get("out", os.devnull))
    before = out.read_text().splitlines() if "resume" in given and out.is_file() else []
    kept = {line["file"]: line for line in map(json.loads, before)}
    kept = {name: line for name, line in kept.items() if line["outcome"] != OUTCOMES[3]}
    out.write_text("")
    with ThreadPoolExecutor(int(given.get("jobs", "2"))) as pool:
        every, capsules = int(given.get("fit-every", "1")), int(given.get("capsules", "3"))
        most = [0 if i % every else capsules for i in range(len(listed))]

        def known(one: tuple[str, Path], n: int) -> dict[str, Any]:
            return kept.get(str(one[1].relative_to(folder))) or judge(one[1], n)

        judged = pool.map(known, listed, most)
        for (kind, path), found in zip(listed, judged, strict=True):
            counts[kind][found["outcome"]] += 1
            seconds[int("bodies" in found)].append(found.get("seconds", 0.0))
            if found.get("kinematics") is not None:
                worst, compared = max(worst, found["kinematics"]), compared + 1
            line = {"type": kind, "file": str(path.relative_to(folder)), **found}
            with out.open("a") as file:
                print(json.dumps(line), file=file)
    rows = [
        (kind, sum(row.values()), *(row[outcome] for outcome in OUTCOMES))
        for kind, row in sorted(counts.items(), key=lambda one: -sum(one[1].values()))
    ]
    return [
        *table(("type", "files", *OUTCOMES), rows),
        "",
        f"Forward kinematics of {compared} files against yourdfpy at {VECTORS} drawn joint vectors:"
        f" at most {worst:.1e} apart ({'within' if worst <= EXACT else 'beyond'} {EXACT:g}).",
        *(
            f"Processor time of {len(each)} files {what}: median {np.median(each):.1f} s, at most"
            f" {max(each):.1f} s."
            for what, each in zip(("read", "read with bodies fitted"), seconds, strict=True)
            if each
        ),
    ]


if __name__ == "__main__":
    print("\n".join(report([f"--folder={sys.argv[1]}", *sys.argv[2:]])))
