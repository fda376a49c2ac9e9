"""Soft estimator: comparison with straightforward JAX, PyTorch and NumPy

Setup n3_16_55 (112 cones) on the reference scene at its pose, target V_S(0.5), 100 000 points in 32
bit: value and gradient by apexes and axes. Straightforward means the definition over all pairs at
once, mean(1 - prod(1 - sigmoid(-f / width))), differentiated by the library. NumPy has no gradient
and computes the value only. All may use every core.
"""

import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from place_rings.coverage.rings.ring import named_setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.soft.estimator import soft_zeta
from place_rings.coverage.soft.sampling import cloud, sample
from place_rings.coverage.solids.cones import Cones, cone
from place_rings.coverage.targets import Target, target_solid
from place_rings.objectives.scene import paper_scene

PEERS: tuple[str, ...] = ("torch",)
WIDTHS = (0.10, 0.05, 0.02, 0.008)  # m, stages of the search from the widest to the sharpest
POINTS, RUNS = 100_000, 5
# required speed relative to straightforward JAX at the sharpest width
SLOWEST = 5.0
AGREE = 1e-5  # tolerance of value and gradient
MEMORY_MB = 300

_MEMORY = """
import jax, jax.numpy as jnp, numpy as np
from place_rings.coverage.soft.sampling import Cloud
from place_rings.coverage.soft.estimator import soft_zeta
from place_rings.coverage.solids.cones import Cones

rng = np.random.default_rng(0)
axis = rng.normal(size=(1000, 3))
axis /= np.linalg.norm(axis, axis=1, keepdims=True)
parts = rng.uniform(-1, 1, (1000, 3)), axis, np.full(1000, 0.2), np.full(1000, 1.5)
cones = Cones(*(jnp.asarray(a, jnp.float32) for a in parts))
centre = rng.uniform(-1, 1, (15625, 3))
points = centre[:, None] + rng.uniform(-0.03, 0.03, (15625, 64, 3))
blocks = points, np.ones((15625, 64)), centre, np.full(15625, 0.052)
points = Cloud(*(jnp.asarray(a, jnp.float32) for a in blocks))
jax.jit(lambda a: a + 1)(jnp.zeros(3)).block_until_ready()
del parts, blocks

def status(key):
    with open("/proc/self/status") as lines:
        return next(int(line.split()[1]) for line in lines if line.startswith(key)) / 1024

with open("/proc/self/clear_refs", "w") as control:
    control.write("5")  # forget the peak of making the inputs
before = status("VmRSS")
jax.block_until_ready(jax.jit(soft_zeta)(cones, points, jnp.float32({width})))
print(status("VmHWM") - before, status("VmHWM"))
"""


def task() -> tuple[Cones, np.ndarray]:
    """Return the 112 cones, and the points (N, 3) m in the target, both in 64 bit."""
    scene = paper_scene()
    q = scene.poses[0].q
    solid = target_solid(Target("V_S", 0.5), scene.robot, q, scene.shape)
    return sensor_cones(scene.robot, named_setup("n3_16_55"), q), sample(solid, POINTS, 0)


def with_jax(cones: Cones, points: np.ndarray) -> Callable[[float], Any]:
    """Return the definition as one array expression of components, (N, K) each.

    It is faster than one of vectors (N, K, 3).
    """
    half, range_m, p = (
        jnp.asarray(cones.half_angle),
        jnp.asarray(cones.range_m),
        jnp.asarray(points),
    )

    def zeta(apex: Any, axis: Any, width: Any) -> Any:
        f = cone(
            p[:, None],
            apex[None],
            axis[None],
            jnp.cos(half)[None],
            jnp.sin(half)[None],
            range_m[None],
        )
        return jnp.mean(1 - jnp.prod(1 - jax.nn.sigmoid(-f / width), axis=1))

    both = jax.jit(jax.value_and_grad(zeta, (0, 1)))
    return lambda width: jax.block_until_ready(both(cones.apex, cones.axis, jnp.float32(width)))


def with_torch(cones: Cones, points: np.ndarray) -> Callable[[float], Any] | None:
    """Return the same in PyTorch on the CPU with its autograd, or None if it is not installed."""
    try:
        import torch
    except ImportError:
        return None
    apex, axis, half, range_m, p = (
        torch.tensor(a) for a in (cones.apex, cones.axis, cones.half_angle, cones.range_m, points)
    )

    def both(width: float) -> Any:
        a, x = apex.clone().requires_grad_(), axis.clone().requires_grad_()
        v = p[:, None] - a
        d = (v * x).sum(-1)
        rho = torch.linalg.vector_norm(v - d[..., None] * x, dim=-1)
        f = torch.maximum(rho * torch.cos(half) - d * torch.sin(half), d - range_m)
        zeta = (1 - torch.prod(1 - torch.sigmoid(-f / width), dim=1)).mean()
        zeta.backward()
        return zeta.item(), (a.grad.numpy(), x.grad.numpy())

    return both


def with_numpy(cones: Cones, points: np.ndarray) -> Callable[[float], Any]:
    """Return the value only in NumPy, one cone after the other to save memory."""

    def zeta(width: float) -> Any:
        free = np.ones(len(points), np.float32)
        for k in range(len(cones)):
            free *= 1 / (1 + np.exp(np.minimum(-cones.part(points, k) / np.float32(width), 80)))
        return float(1 - free.mean(dtype=np.float64)), None

    return zeta


def ours(cones: Cones, points: np.ndarray) -> Callable[[float], Any]:
    """Return the soft estimator; one compiled function serves all widths."""
    estimate, c, p = (
        jax.jit(soft_zeta),
        jax.tree.map(jnp.asarray, cones),
        jax.tree.map(jnp.asarray, cloud(points)),
    )

    def both(width: float) -> Any:
        soft = jax.block_until_ready(estimate(c, p, jnp.float32(width)))
        return soft.zeta, (soft.by_apex, soft.by_axis)

    return both


def measure(
    methods: dict[str, Callable[[float], Any]], width: float
) -> dict[str, tuple[float, Any]]:
    """Return the median time in seconds and the result of each method.

    The methods run alternately, so that other work on the machine affects all of them.
    """
    seconds: dict[str, list[float]] = {name: [] for name in methods}
    results = {name: method(width) for name, method in methods.items()}
    for _ in range(RUNS):
        for name, method in methods.items():
            start = time.perf_counter()
            method(width)
            seconds[name].append(time.perf_counter() - start)
    return {name: (statistics.median(seconds[name]), results[name]) for name in methods}


def apart(a: Any, b: Any) -> float:
    """Return the largest difference between two trees of arrays with the same structure."""
    pairs = zip(jax.tree.leaves(a), jax.tree.leaves(b), strict=True)
    return max(float(np.abs(np.asarray(x) - np.asarray(y)).max()) for x, y in pairs)


def memory(width: float = WIDTHS[-1]) -> tuple[float, float]:
    """Measure peak memory for 1000 sensors and a million points in a separate process (Linux).

    Returns:
        MB that the estimate adds to a process with JAX and the inputs, including compilation, and
            MB of the whole process.
    """
    found = subprocess.run(
        [sys.executable, "-c", _MEMORY.format(width=width)],
        check=True,
        capture_output=True,
        text=True,
    )
    added, total = map(float, found.stdout.split())
    return added, total


def report() -> list[str]:
    """Measure, check the bounds and return Markdown.

    Raises:
        SystemExit: if a bound is missed.
    """
    cones, points = task()
    cones, points = (
        jax.tree.map(lambda a: np.asarray(a, np.float32), cones),
        points.astype(np.float32),
    )
    makers = {"ours": ours, "JAX": with_jax, "PyTorch": with_torch, "NumPy, value only": with_numpy}
    made = {name: maker(cones, points) for name, maker in makers.items()}
    methods = {name: method for name, method in made.items() if method is not None}
    rivals = [name for name in methods if name != "ours"]
    lines = [
        (
            f"112 cones, {POINTS:,} points. Times are medians of {RUNS} alternate runs; the"
            " number in brackets is the time relative to ours. The last two columns are the"
            " largest differences between the methods."
        ),
        "",
        "| width, m | ours, s | "
        + " | ".join(f"{name}, s" for name in rivals)
        + " | difference of values | difference of gradients |",
        "| --- " * (len(rivals) + 4) + "|",
    ]
    for width in WIDTHS:
        found = measure(methods, width)
        mine, (zeta, slope) = found["ours"]
        values = max(apart(zeta, found[name][1][0]) for name in rivals)
        slopes = max(
            apart(slope, found[name][1][1]) for name in rivals if found[name][1][1] is not None
        )
        cells = [f"{found[name][0]:.3f} ({found[name][0] / mine:.1f})" for name in rivals]
        lines.append(
            f"| {width:g} | {mine:.4f} | {' | '.join(cells)} | {values:.1e} | {slopes:.1e} |"
        )
        print(lines[-1], flush=True)
        least = SLOWEST if width == WIDTHS[-1] else 1.0
        if max(values, slopes) > AGREE or found["JAX"][0] < least * mine:
            raise SystemExit(
                f"at {width} m a bound is missed: agreement within {AGREE:g}, {least:g} times the"
                " speed of JAX"
            )
    added, total = memory()
    if added > MEMORY_MB:
        raise SystemExit(f"1000 sensors and a million points took {added:.0f} MB")
    if "PyTorch" not in methods:
        lines += ["", "PyTorch is not installed and left out."]
    lines += [
        "",
        (
            f"1000 sensors and 1,000,000 points (10^9 pairs) at {WIDTHS[-1]:g} m: {added:.0f} MB of"
            " peak memory over a"
        ),
    ]
    lines += [
        "process that has imported JAX and created the inputs, including compilation;"
        f" {total:.0f} MB in total."
    ]
    lines += [
        "",
        (
            "Command: `python benchmarks estimator`."
            f" {', '.join(map(_named, ('numpy', 'jax', *PEERS)))}."
        ),
    ]
    return lines


def _named(package: str) -> str:
    try:
        return f"{package} {version(package)}"
    except PackageNotFoundError:
        return f"{package} absent"


if __name__ == "__main__":
    print(*report(), sep="\n")
