"""Twin in MuJoCo: speed beside MuJoCo's own rangefinders, and reported spheres beside ζ."""

import statistics
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import mujoco
import numpy as np
import place_rings as pr
from common import say, table
from place_rings.formats.export.mjcf import mjcf
from place_rings.formats.export.placed import PlacedSetup
from place_rings.objectives.named_layouts import layout_in

from tests.support.twin_probes import ONE_ZONE, ZONES, ProbeShare, drawn

SETUPS, PROBES, MORE_PROBES = 30, 1000, 4000
_FRAMES = 30
_KINDS = {"one zone": ONE_ZONE, "many zones": ZONES}


def report(full: bool) -> list[str]:
    """Measure and return blocks of Markdown."""
    return [*speed(), *agreement(MORE_PROBES if full else PROBES)]


def speed() -> list[str]:
    """Measure 80 sensors of 64 zones, beside a rangefinder for each zone."""
    scene = pr.Scene(sensor=pr.sensors["vl53l5cx"], electronics=pr.Electronics(bus="own"))
    setup = layout_in(scene, "n2_16_25")
    twin = pr.twin(setup, scene)
    peer, data = rangefinders(scene, setup, twin)
    q, turns = twin.q.copy(), np.sin(np.arange(_FRAMES))
    ids = peer.jnt_qposadr[[peer.joint(name).id for name in twin.joints]]

    def frame(turn: float) -> None:
        twin.step(q + 0.3 * turn)

    def step(turn: float) -> None:
        data.qpos[ids] = q + 0.3 * turn
        mujoco.mj_forward(peer, data)

    rays = sum(len(look.rays) * len(look.sensors) for look in twin.looks)
    works = {
        "twin, 15 Hz": (frame, rays, 1 / twin.dt),
        "rangefinders, in each step of 2 ms": (step, peer.nsensor, 500.0),
        "rangefinders, if they were called at 15 Hz only": (step, peer.nsensor, 1 / twin.dt),
    }
    rows, seconds = [], {work: [] for work, _, _ in works.values()}
    for turn in turns:  # alternately, so that other work on the machine affects all of them
        for work, each in seconds.items():
            began = time.process_time()
            work(turn)
            each.append(time.process_time() - began)
    for name, (work, count, rate) in works.items():
        took = statistics.median(seconds[work])
        figures = 1000 * took, 1e9 * took / count, 1 / (rate * took)
        rows.append((name, count, *(f"{figure:.3g}" for figure in figures)))
        say(*rows[-1])
    head = ("", "rays", "ms a frame or step", "ns a ray", "times real time")
    return [
        "80 `vl53l5cx` of 64 zones (`n2_16_25` on a UR10): processor time on one core. The twin"
        " casts 33 by 33 rays for each sensor, and returns up to four targets of each zone, with"
        " noise. Beside it stands one rangefinder site through the middle of each zone, which"
        " MuJoCo evaluates in each step of the physics.",
        table(head, rows),
    ]


def rangefinders(
    scene: pr.Scene, setup: pr.Setup, twin: pr.SensorTwin
) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Return the scene with a rangefinder through the middle of each zone."""
    placed = PlacedSetup(scene, setup, 0, Path())
    spec = mujoco.MjSpec.from_string(mjcf(placed)["scene.xml"].decode())
    for sensor in list(spec.sensors):
        spec.delete(sensor)
    for frame in placed.sensors:
        held = spec.body(frame.name)
        for i, ray in enumerate(middles(twin)):
            name = f"{frame.name}_{i}"
            held.add_site(name=name, zaxis=ray)
            ranging, site = mujoco.mjtSensor.mjSENS_RANGEFINDER, mujoco.mjtObj.mjOBJ_SITE
            added = spec.add_sensor(name=name, type=ranging, objtype=site, objname=name)
            added.intprm[0] = 1  # report the distance
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    return model, data


def middles(twin: pr.SensorTwin) -> np.ndarray:
    """Return the middle rays (64, 3) of the zones of a sensor."""
    look = twin.looks[0]
    side = look.grid[0] * look.steps + 1
    picture = look.rays.reshape(side, side, 3)
    at = slice(look.steps // 2, None, look.steps)
    middle: np.ndarray = picture[at, at].reshape(-1, 3)
    return middle


def agreement(probes: int) -> list[str]:
    """Measure the share of spheres that the twin reports, beside ζ."""
    tasks = [(n, models, probes) for models in _KINDS.values() for n in range(SETUPS // 2)]
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        shares = list(pool.map(drawn, *zip(*tasks, strict=True)))
    rows = []
    for i, name in enumerate(_KINDS):
        own = shares[i * SETUPS // 2 : (i + 1) * SETUPS // 2]
        rows.append((name, len(own), *summary(own)))
    rows.append(("all", len(shares), *summary(shares)))
    for row in rows:
        say(*row)
    head = ("sensors", "setups", "ζ, %", "intervals that hold ζ", "reported less ζ, points")
    return [
        f"{SETUPS} drawn setups on three robots, {probes} spheres of 1 mm radius each at random"
        " places of V_S(0.5): the share that a reading tells of, beside ζ under `shadow`; 95 %"
        " intervals (Clopper and Pearson). The twin has 32 times as many rays along a side, and"
        " masks robot and cell.",
        table(head, rows),
    ]


def summary(shares: list[ProbeShare]) -> tuple[str, str, str]:
    """Return the range of ζ, the intervals that hold it, and the mean difference."""
    zeta = [100 * share.zeta for share in shares]
    less = [100 * (share.reported / share.probes - share.zeta) for share in shares]
    error = statistics.stdev(less) / len(less) ** 0.5
    held = sum(share.holds for share in shares)
    return (
        f"{min(zeta):.0f} to {max(zeta):.0f}",
        f"{held} of {len(shares)}",
        f"{statistics.mean(less):+.2f} ± {error:.2f}",
    )
