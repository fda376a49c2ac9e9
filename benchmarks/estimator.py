"""Soft coverage: comparison with straightforward JAX, PyTorch and NumPy.

Setup n3_16_55 (7 rings, 112 cones) on the reference scene at its pose, target V_S(0.5), 100,000
points in 32 bit: value and gradient by the rings' positions, tilts and phases. Straightforward
means the definition over all pairs at once, mean(1 - prod(1 - sigmoid(-f / width))), differentiated
by the library. Ours evaluates the sensors of each ring nearest to a point instead of all, which
leaves out what further ones add to a wide sigmoid; the table states by how much that differs. NumPy
has no gradient and computes the value only. All may use every core.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from common import absent, installed, medians, own_process, peak_memory, say, table
from growth import soft_task
from place_rings.coverage.rings.ring import named_setup, ring_values
from place_rings.coverage.rings.ring_kinematics import (
    RingArrays,
    ring_arrays,
    seen_from,
    sensor_poses,
)
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.soft.sampling import sample
from place_rings.coverage.solids.cones import Cones, cone
from place_rings.objectives.scene import Scene
from place_rings.objectives.soft_coverage import SoftCoverage

# m, from the widest to the sharpest
WIDTHS = {False: (0.1, 0.008), True: (0.1, 0.05, 0.02, 0.008)}
POINTS, SETUP = 100_000, "n3_16_55"
AGREE = 1e-4  # tolerance of value and gradient among those that evaluate all pairs
MEMORY_MB = 300  # wanted at most

Method = Callable[[float], Any]


@dataclass(frozen=True)
class Task:
    """The setup, and the points in the target."""

    scene: Scene
    arrays: RingArrays
    values: np.ndarray
    """(3, R) positions, tilts and phases."""
    points: np.ndarray
    """(N, 3) m, in 32 bit."""

    @staticmethod
    def of() -> "Task":
        """Return the task of this comparison."""
        scene, rings = Scene.paper(), named_setup(SETUP).rings
        points = sample(scene.solid(scene.targets[0].target, 0), POINTS, 0)
        v, arrays = ring_values(rings), ring_arrays(scene.robot, rings)
        arrays = jax.tree.map(lambda a: a.astype(np.float32) if a.dtype == float else a, arrays)
        values = np.stack([v.position, v.tilt, v.phase]).astype(np.float32)
        return Task(scene, arrays, values, points.astype(np.float32))

    @property
    def frames(self) -> np.ndarray:
        """T_base_frame (F, 4, 4)."""
        return forward(self.scene.robot.chain, self.scene.poses[0].q).astype(np.float32)


def report(full: bool) -> list[str]:
    """Measure and return blocks of Markdown.

    Raises:
        SystemExit: if those that evaluate all pairs do not agree.
    """
    task = Task.of()
    makers = {"JAX": with_jax, "PyTorch": with_torch, "NumPy, value only": with_numpy}
    methods: dict[str, Method] = {"ours": ours(task)}
    methods |= {n: m(task) for n, m in makers.items() if n != "PyTorch" or installed("torch")}
    columns = ("width, m", "method", "seconds", "relative", "off in value", "off in gradient")
    rows: list[list[str]] = []
    for width in WIDTHS[full]:
        found = medians({n: lambda m=m, w=width: m(w) for n, m in methods.items()})
        fast, (zeta, slopes) = found["ours"][1], found["JAX"][0]
        for name, ((value, gradient), seconds) in found.items():
            off = [apart(zeta, value), 0.0 if gradient is None else apart(slopes, gradient)]
            if max(off) > AGREE and name != "ours":
                raise SystemExit(f"{name} at {width} m: differs by {max(off)}, allowed: {AGREE}")
            row = [f"{width:g}", name, f"{seconds:.4f}", f"{seconds / fast:.1f}"]
            rows.append([*row, *(f"{one:.1e}" for one in off)])
            say(*rows[-1])
    rows += [absent("torch", len(columns))] * ("PyTorch" not in methods)
    added, total = own_process(memory, WIDTHS[full][-1])
    return [
        f"7 rings, 112 cones, {POINTS:,} points; value and gradient; off: from JAX over all pairs.",
        table(columns, rows),
        f"1000 sensors and 1,000,000 points (10^9 pairs) at {WIDTHS[full][-1]:g} m: {added:.0f} MB"
        f" of peak memory (wanted: at most {MEMORY_MB}) over a process that has imported JAX and"
        f" created the inputs, including compilation; {total:.0f} MB in total.",
    ]


def ours(task: Task) -> Method:
    """Return the soft coverage; one compiled function serves all widths."""
    soft = SoftCoverage(task.scene, [(0, 0)], [task.points])
    return lambda width: soft.value_and_slope(task.arrays, task.values, width)


def with_jax(task: Task) -> Method:
    """Return the definition as one array expression of components, (N, K) each.

    It is faster than one of vectors (N, K, 3).
    """
    arrays, frames, p = jax.tree.map(jnp.asarray, (task.arrays, task.frames, task.points))
    half, range_m = arrays.beams.half_angle, arrays.beams.range_m
    cos, sin = jnp.cos(half)[None], jnp.sin(half)[None]

    def zeta(values: Any, width: Any) -> Any:
        apex, axis = seen_from(arrays, sensor_poses(arrays, *values), frames, up=False)
        f = cone(p[:, None], apex[None], axis[None], cos, sin, range_m[None])
        return jnp.mean(1 - jnp.prod(1 - jax.nn.sigmoid(-f / width), axis=1))

    both = jax.jit(jax.value_and_grad(zeta))
    values = jnp.asarray(task.values)
    return lambda width: jax.block_until_ready(both(values, jnp.float32(width)))


def with_torch(task: Task) -> Method:
    """Return the same in PyTorch on the CPU with its autograd."""
    import torch

    arrays: Any = jax.tree.map(torch.tensor, task.arrays)
    p, ring, half = torch.tensor(task.points), arrays.ring, arrays.beams.half_angle
    T = torch.tensor(task.frames)[arrays.frame]
    mounts = [getattr(arrays, key) for key in ("start", "axis", "zero", "side")]

    def both(width: float) -> Any:
        values = torch.tensor(task.values).requires_grad_()
        position, tilt, phase = (v[ring] for v in values)
        start, along, zero, side = (a[ring] for a in mounts)
        angle = (phase + arrays.turn)[:, None]
        radial = torch.cos(angle) * zero + torch.sin(angle) * side
        centre = start + (position * arrays.length[ring])[:, None] * along
        apex = centre + arrays.radius[ring][:, None] * radial
        look = torch.cos(tilt)[:, None] * radial + torch.sin(tilt)[:, None] * along
        rotation, origin = T[ring][:, :3, :3], T[ring][:, :3, 3]
        a = origin + (rotation @ apex[..., None])[..., 0]
        x = (rotation @ look[..., None])[..., 0]
        v = p[:, None] - a
        d = (v * x).sum(-1)
        rho = torch.linalg.vector_norm(v - d[..., None] * x, dim=-1)
        f = rho * torch.cos(half) - d * torch.sin(half)
        f = torch.maximum(f, d - arrays.beams.range_m)
        zeta = (1 - torch.prod(1 - torch.sigmoid(-f / width), dim=1)).mean()
        zeta.backward()
        return zeta.item(), values.grad.numpy()

    return both


def with_numpy(task: Task) -> Method:
    """Return the value only in NumPy, one cone after the other to save memory."""
    shapes = task.arrays.beams
    seat = sensor_poses(task.arrays, *task.values)
    look = seen_from(task.arrays, seat, task.frames, up=False)
    cones = Cones(*look, shapes.half_angle, shapes.range_m)

    def zeta(width: float) -> Any:
        free = np.ones(len(task.points), np.float32)
        for k in range(len(cones)):
            f = cones.part(task.points, k)
            free *= 1 / (1 + np.exp(np.minimum(-f / np.float32(width), 80)))
        return float(1 - free.mean(dtype=np.float64)), None

    return zeta


def apart(a: Any, b: Any) -> float:
    """Return the largest difference between two trees of arrays with the same structure."""
    pairs = zip(jax.tree.leaves(a), jax.tree.leaves(b), strict=True)
    return max(float(np.abs(np.asarray(x) - np.asarray(y)).max()) for x, y in pairs)


def memory(width: float) -> tuple[float, float]:
    """Measure peak memory for 1000 sensors and a million points in this process (Linux).

    Returns:
        MB that value and gradient add to JAX and the inputs, with compilation, and MB in total.
    """
    coverage, *setup = soft_task(1000, 1, 1_000_000)
    jax.jit(lambda a: a + 1)(jnp.zeros(3)).block_until_ready()
    Path("/proc/self/clear_refs").write_text("5")  # forget the peak of making the inputs
    before = peak_memory()
    coverage.value_and_slope(*setup, width)
    return peak_memory() - before, peak_memory()
