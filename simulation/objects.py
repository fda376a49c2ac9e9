"""Rod, ball and parcel that move near a robot: rigid unions of balls, and their paths."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from ..coverage.solids.capsules import Capsules
from .human import PEDESTAL, ball_counts, balls_along

# m; a test rod of 70 mm diameter, the coarsest resolution that protects a hazardous area
ROD_LENGTH, ROD_RADIUS = 0.5, 0.035
BALL_RADIUS = 0.1  # m, a head
PARCEL, PARCEL_EDGE = (0.36, 0.30, 0.24), 0.06  # m: sides, and the radius of its rounded edges
PARCEL_ERROR = 3e-3  # m, depth of the dimples between the balls of a parcel's faces
# m: least and largest gap between object and robot, across the near and the far zone
GAP = (0.03, 1.25)
_FASTEST, _WAVES = 0.1, 3  # highest frequency, Hz, and number of the sines in a path


def _rod() -> tuple[Float[np.ndarray, "B 3"], Float[np.ndarray, " B"]]:
    half = np.array([[[0.0, 0.0, ROD_LENGTH / 2 - ROD_RADIUS]]])
    radius = np.array([ROD_RADIUS])
    centre, radius = balls_along(
        -half, half, radius, ball_counts(np.array([ROD_LENGTH - 2 * ROD_RADIUS]), radius)
    )
    return centre[0], radius


def _ball() -> tuple[Float[np.ndarray, "B 3"], Float[np.ndarray, " B"]]:
    return np.zeros((1, 3)), np.array([BALL_RADIUS])


def _parcel() -> tuple[Float[np.ndarray, "B 3"], Float[np.ndarray, " B"]]:
    """Return balls on the faces of the box that is one edge radius smaller.

    The deepest dimple lies in the middle of four balls: r - sqrt(r^2 - d^2/2) at a spacing of d.
    """
    spacing = np.sqrt(2 * PARCEL_ERROR * (2 * PARCEL_EDGE - PARCEL_ERROR))
    sides = [np.linspace(-1, 1, int(np.ceil((s - 2 * PARCEL_EDGE) / spacing)) + 1) for s in PARCEL]
    grid = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 3)
    centre = grid[np.abs(grid).max(axis=1) == 1] * (np.array(PARCEL) / 2 - PARCEL_EDGE)
    return centre, np.full(len(centre), PARCEL_EDGE)


SHAPES: dict[str, Callable[[], tuple[Float[np.ndarray, "B 3"], Float[np.ndarray, " B"]]]] = {
    "rod": _rod,
    "ball": _ball,
    "parcel": _parcel,
}


def _wander(rng: np.random.Generator, time_s: Float[np.ndarray, " T"]) -> Float[np.ndarray, " T"]:
    """Return a smooth, unbiased random function of time within [-1, 1]: a triangle wave of a sum of
    sines."""
    frequency, phase = rng.uniform(0.02, _FASTEST, _WAVES), rng.uniform(0, 2 * np.pi, _WAVES)
    total = np.sin(2 * np.pi * frequency * time_s[:, None] + phase).sum(axis=1)
    wave: np.ndarray = 2 / np.pi * np.arcsin(np.sin(np.pi / 2 * total))
    return wave


def object_balls(
    shape: str, seed: int, time_s: Float[np.ndarray, " T"], bodies: Capsules
) -> tuple[Float[np.ndarray, "T B 3"], Float[np.ndarray, " B"]]:
    """Return an object that turns and wanders around a moving robot: balls (T, B, 3) m and their
    radii (B,) m.

    At each time the object is separated by a gap within ``GAP`` from one point of the robot, in one
    direction. The point along the robot, direction, gap and attitude vary smoothly and
    independently. The object moves with the robot, so that both zones are sampled at every pose.
    Another part of the robot may be nearer than that point. The object stays above the floor.

    Args:
        shape: a key of ``SHAPES``.
        seed: random seed of the path; the same for every setup.
        time_s: times (T,), s.
        bodies: bodies of the robot at T poses, from the base to the tool.
    """
    if shape not in SHAPES:
        raise ValueError(f"unknown shape {shape!r}; known: {', '.join(SHAPES)}")
    rng = np.random.default_rng(seed)
    centre, radius = SHAPES[shape]()
    place = (_wander(rng, time_s) + 1) / 2
    gap = GAP[0] + (GAP[1] - GAP[0]) * (_wander(rng, time_s) + 1) / 2
    up, about = (
        _wander(rng, time_s) * 0.98,
        np.pi * np.cumsum(np.gradient(3 * _wander(rng, time_s))),
    )
    flat = np.sqrt(1 - up**2)
    side = np.stack([flat * np.cos(about), flat * np.sin(about), up], axis=1)
    turn = Rotation.from_euler(
        "zyx", np.stack([np.pi * _wander(rng, time_s) for _ in range(3)], axis=1)
    )
    offset = turn.as_matrix()[:, None] @ centre[None, :, :, None]

    length = np.linalg.norm(bodies.end - bodies.start, axis=-1)
    until = np.cumsum(length, axis=1) / length.sum(axis=1, keepdims=True)
    which = np.minimum((until < place[:, None]).sum(axis=1), length.shape[1] - 1)
    t = np.arange(len(time_s))
    share = length / length.sum(axis=1, keepdims=True)
    along = np.clip((place - until[t, which]) / share[t, which] + 1, 0, 1)[:, None]
    point = bodies.start[t, which] * (1 - along) + bodies.end[t, which] * along
    # Shift by the object's own extent towards the body.
    back = (-(offset[..., 0] * side[:, None]).sum(axis=2) + radius).max(axis=1)
    middle = point + (bodies.radius[which] + back + gap)[:, None] * side
    balls = middle[:, None] + offset[..., 0]
    lift = np.maximum(-PEDESTAL - (balls[..., 2] - radius).min(axis=1), 0)
    balls[..., 2] += lift[:, None]
    return balls, radius
