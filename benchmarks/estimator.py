"""Soft estimator: comparison with straightforward JAX, PyTorch and NumPy.

Setup n3_16_55 (112 cones) on the reference scene at its pose, target V_S(0.5), 100,000 points in 32
bit: value and gradient by apexes and axes. Straightforward means the definition over all pairs at
once, mean(1 - prod(1 - sigmoid(-f / width))), differentiated by the library. NumPy has no gradient
and computes the value only. All may use every core.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from common import absent, installed, medians, own_process, peak_memory, say, table
from place_rings.coverage.rings.ring import named_setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.soft.estimator import soft_zeta
from place_rings.coverage.soft.sampling import Cloud, cloud, sample
from place_rings.coverage.solids.cones import Cones, cone
from place_rings.objectives.scene import paper_scene

# m, from the widest to the sharpest
WIDTHS = {False: (0.1, 0.008), True: (0.1, 0.05, 0.02, 0.008)}
POINTS, SETUP = 100_000, "n3_16_55"
AGREE = 1e-5  # tolerance of value and gradient
MEMORY_MB = 300  # wanted at most

Method = Callable[[float], Any]


def report(full: bool) -> list[str]:
    """Measure and return blocks of Markdown.

    Raises:
        SystemExit: if the methods do not agree.
    """
    cones, points = task()
    makers = {"JAX": with_jax, "PyTorch": with_torch, "NumPy, value only": with_numpy}
    methods: dict[str, Method] = {"ours": ours(cones, points)}
    methods |= {
        n: m(cones, points) for n, m in makers.items() if n != "PyTorch" or installed("torch")
    }
    columns = ("width, m", "method", "seconds", "relative", "off in value", "off in gradient")
    rows: list[list[str]] = []
    for width in WIDTHS[full]:
        found = medians({n: lambda m=m, w=width: m(w) for n, m in methods.items()})
        (zeta, slopes), fast = found["ours"]
        for name, ((value, gradient), seconds) in found.items():
            off = [apart(zeta, value), 0.0 if gradient is None else apart(slopes, gradient)]
            if max(off) > AGREE:
                raise SystemExit(f"{name} at {width} m: differs by {max(off)}, allowed: {AGREE}")
            row = [f"{width:g}", name, f"{seconds:.4f}", f"{seconds / fast:.1f}"]
            rows.append([*row, *(f"{one:.1e}" for one in off)])
            say(*rows[-1])
    rows += [absent("torch", len(columns))] * ("PyTorch" not in methods)
    added, total = own_process(memory, WIDTHS[full][-1])
    return [
        f"112 cones, {POINTS:,} points; value and gradient.",
        table(columns, rows),
        f"1000 sensors and 1,000,000 points (10^9 pairs) at {WIDTHS[full][-1]:g} m: {added:.0f} MB"
        f" of peak memory (wanted: at most {MEMORY_MB}) over a process that has imported JAX and"
        f" created the inputs, including compilation; {total:.0f} MB in total.",
    ]


def task() -> tuple[Cones, np.ndarray]:
    """Return the 112 cones, and the points (N, 3) m in the target, in 32 bit."""
    scene = paper_scene()
    points = sample(scene.solid(scene.goals[0].target, 0), POINTS, 0)
    cones = sensor_cones(scene.robot, named_setup(SETUP), scene.poses[0].q)
    return jax.tree.map(lambda a: np.asarray(a, np.float32), cones), points.astype(np.float32)


def ours(cones: Cones, points: np.ndarray) -> Method:
    """Return the soft estimator; one compiled function serves all widths."""
    estimate = jax.jit(soft_zeta)
    c, p = jax.tree.map(jnp.asarray, cones), jax.tree.map(jnp.asarray, cloud(points))

    def both(width: float) -> Any:
        soft = jax.block_until_ready(estimate(c, p, jnp.float32(width)))
        return soft.zeta, (soft.by_apex, soft.by_axis)

    return both


def with_jax(cones: Cones, points: np.ndarray) -> Method:
    """Return the definition as one array expression of components, (N, K) each.

    It is faster than one of vectors (N, K, 3).
    """
    half, range_m, p = map(jnp.asarray, (cones.half_angle, cones.range_m, points))
    cos, sin = jnp.cos(half)[None], jnp.sin(half)[None]

    def zeta(apex: Any, axis: Any, width: Any) -> Any:
        f = cone(p[:, None], apex[None], axis[None], cos, sin, range_m[None])
        return jnp.mean(1 - jnp.prod(1 - jax.nn.sigmoid(-f / width), axis=1))

    both = jax.jit(jax.value_and_grad(zeta, (0, 1)))
    return lambda width: jax.block_until_ready(both(cones.apex, cones.axis, jnp.float32(width)))


def with_torch(cones: Cones, points: np.ndarray) -> Method:
    """Return the same in PyTorch on the CPU with its autograd."""
    import torch

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


def with_numpy(cones: Cones, points: np.ndarray) -> Method:
    """Return the value only in NumPy, one cone after the other to save memory."""

    def zeta(width: float) -> Any:
        free = np.ones(len(points), np.float32)
        for k in range(len(cones)):
            free *= 1 / (1 + np.exp(np.minimum(-cones.part(points, k) / np.float32(width), 80)))
        return float(1 - free.mean(dtype=np.float64)), None

    return zeta


def apart(a: Any, b: Any) -> float:
    """Return the largest difference between two trees of arrays with the same structure."""
    pairs = zip(jax.tree.leaves(a), jax.tree.leaves(b), strict=True)
    return max(float(np.abs(np.asarray(x) - np.asarray(y)).max()) for x, y in pairs)


def memory(width: float) -> tuple[float, float]:
    """Measure peak memory for 1000 sensors and a million points in this process (Linux).

    Returns:
        MB that the estimate adds to JAX and the inputs, with compilation, and MB in total.
    """
    rng = np.random.default_rng(0)
    axis = rng.normal(size=(1000, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    parts = rng.uniform(-1, 1, (1000, 3)), axis, np.full(1000, 0.2), np.full(1000, 1.5)
    cones = Cones(*(jnp.asarray(a, jnp.float32) for a in parts))
    centre = rng.uniform(-1, 1, (15625, 3))
    points = centre[:, None] + rng.uniform(-0.03, 0.03, (15625, 64, 3))
    blocks = points, np.ones((15625, 64)), centre, np.full(15625, 0.052)
    drawn = Cloud(*(jnp.asarray(a, jnp.float32) for a in blocks))
    jax.jit(lambda a: a + 1)(jnp.zeros(3)).block_until_ready()
    del parts, blocks, points
    Path("/proc/self/clear_refs").write_text("5")  # forget the peak of making the inputs
    before = peak_memory()
    jax.block_until_ready(jax.jit(soft_zeta)(cones, drawn, jnp.float32(width)))
    return peak_memory() - before, peak_memory()
