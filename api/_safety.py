"""Detection in time: the share of approaching people that a setup reports soon enough."""

import time
from collections.abc import Callable

import numpy as np

from ._errors import InputError, input_errors
from ._safety_conditions import SafetyOptions, motion_of
from ._safety_record import record_of
from ._safety_report import SafetyReport
from ._scene import Scene
from ._trajectory import Trajectory
from ._validation import SetupLike, resolve_setup
from .coverage.occlusion.occlusion_mode import Occlusion
from .coverage.rings.ring import sensor_optics
from .coverage.robots.separation_distance import stopping_time
from .objectives.scene import CoreScene
from .simulation.detection import Approaches, approach, floor_of, seeing_as_far, start_of


def safety(
    setup: SetupLike,
    scene: Scene | CoreScene | None = None,
    *,
    trajectory: Trajectory | None = None,
    approaches: int = 720,
    directions: int = 12,
    rate: float | None = None,
    latency: float = 0.02,
    occlusion: Occlusion | None = None,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> SafetyReport:
    """Simulate people who walk in from all sides while the robot moves, and count how many are
    reported before they are closer than the separation distance of ISO/TS 15066.

    The result is an engineering aid and confers no safety rating. Choose the sensor with its
    effective range on dark clothes, such as
    ``pr.sensors.under("vl53l1x", reflectance=0.17, target_size=(0.45, 0.7))``.

    Args:
        setup, scene: as in ``verify``.
        trajectory: recorded motion of the robot; by default it stays in each of the scene's poses.
        approaches: number of people, 1 to 100,000.
        directions: number of sectors with a share of their own, 1 to 360.
        rate: readings of each sensor, Hz; by default that of the ring's bus, else the
            catalogue's, or 20.
        latency: time from a reading to the report, s, 0 to 5.
        occlusion: model of occlusion; by default the scene's, with ``shadow`` for ``ignore``.
        seed: random seed of directions and moments.
        progress: receives the number of finished approaches, from 0, and the number of all.

    Returns:
        The share of approaches reported in time.

    Raises:
        InputError: for a setup that does not fit the scene, a robot without a stopping time, or a
            value out of range.

    Example:
        >>> import place_rings as pr
        >>> report = pr.safety("n1_8_0", approaches=16)
        >>> 0 <= report.in_time <= 1
        True
    """
    began = time.perf_counter()
    name, placed, core = resolve_setup(setup, scene)
    own: Occlusion = "shadow" if core.occlusion == "ignore" else core.occlusion
    options = SafetyOptions(approaches, directions, rate, latency, occlusion or own, seed)
    options.check()
    with input_errors("safety"):  # before any work, for a robot without a stopping time
        stopping_time(core.safety, core.robot.name, 0.0)
    if not isinstance(trajectory, Trajectory | None):
        raise InputError(f"found {trajectory!r}, allowed: a Trajectory", "trajectory")
    motion = motion_of(placed, core, trajectory, options)
    needed, range_m = float(motion.full.asked.max()), float(sensor_optics(placed)[1].min())
    farther = seeing_as_far(placed, needed)
    start = start_of(core.robot, farther, motion.moments)
    azimuths = np.random.default_rng((seed, 1)).uniform(0, 2 * np.pi, approaches)
    setups = [placed] if range_m >= needed else [placed, farther]
    simulated: list[Approaches] = []
    for one in setups:
        done = len(simulated) * approaches

        def tell(n: int, done: int = done) -> None:
            if progress is not None:
                progress(done + n, len(setups) * approaches)

        tell(0)
        walks = (motion.timing, core.safety.human, azimuths, seed, options.occlusion, start, tell)
        cell = (tuple(o.body for o in core.obstacles), floor_of(core))
        simulated.append(approach(core.robot, one, motion.moments, *walks, *cell))
    record = record_of(name, placed, core, options, motion, simulated, began)
    return SafetyReport(
        placed,
        Scene.of(core),
        record,
        simulated[0],
        motion,
        start,
        name,
        f"place_rings.safety(..., seed={seed})",
        directions,
    )
