"""Joint values by name and unit, as a person writes them: degrees of revolute joints, metres of
prismatic ones.

The key of a joint is its name with the unit: ``shoulder_pan_joint_deg``, ``rail_m``.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from ..definitions.units import degrees
from .kinematics import Chain

_DIGITS = 9  # decimals of a value in files
_AGREE, _AGREE_M = math.radians(0.01), 1e-4  # rad, m: a stated value of a mimic joint
SPEED = "_s"  # after the unit, of a joint speed


def turned_near(
    angles: Float[np.ndarray, "*batch J"], near: Float[np.ndarray, "*other J"] | float
) -> Float[np.ndarray, "*most J"]:
    """Return the angles, each less the full turns by which it is nearest to ``near``, rad."""
    turns: np.ndarray = angles - math.tau * np.round((angles - near) / math.tau)
    return turns


def angles_apart(
    a: Float[np.ndarray, "*batch J"], b: Float[np.ndarray, "*other J"]
) -> Float[np.ndarray, "*most J"]:
    """Return how far apart joint angles are, rad, up to half a turn: a pose is the same after any
    number of full turns of its joints."""
    apart: np.ndarray = np.abs(turned_near(a, b) - b)
    return apart


def joint_keys(chain: Chain, speed: bool = False) -> tuple[str, ...]:
    """Return the key of each joint, or of its speed: its name with the unit."""
    end = SPEED if speed else ""
    units = ("m" if slides else "deg" for slides in chain.slides)
    return tuple(f"{name}_{unit}{end}" for name, unit in zip(chain.joints, units, strict=True))


def in_file_units(chain: Chain, q: Float[np.ndarray, " J"]) -> list[float]:
    """Return joint values (J,) in rad and m as degrees and metres, rounded as in files."""
    return [
        round(float(v) if slides else math.degrees(v), _DIGITS)
        for v, slides in zip(q, chain.slides, strict=True)
    ]


def from_file_units(chain: Chain, values: Sequence[float]) -> Float[np.ndarray, " J"]:
    """Return joint values (J,) in rad and m for degrees and metres."""
    return np.array(
        [v if slides else math.radians(v) for v, slides in zip(values, chain.slides, strict=True)],
        float,
    )


def named(chain: Chain, q: Float[np.ndarray, " J"], speed: bool = False) -> dict[str, float]:
    """Return joint values (J,) in rad and m, or speeds, by their keys, in degrees and metres."""
    return dict(zip(joint_keys(chain, speed), in_file_units(chain, q), strict=True))


def misnamed(
    chain: Chain, values: Mapping[str, float], speed: bool = False
) -> tuple[str, str] | None:
    """Return the first key of ``values`` that is wrong, or missing, and what is allowed there.

    None if each joint has its key and no other key exists. A mimic joint needs none.
    """
    keys = joint_keys(chain, speed)
    unknown = [key for key in values if key not in keys]
    follow = {keys[m.joint] for m in chain.mimics}
    missing = [key for key in keys if key not in values and key not in follow]
    every = f"{', '.join(keys)}: one value for each joint"
    if unknown:
        return unknown[0], every
    return (missing[0], every) if missing else None


def ordered(
    chain: Chain, values: Mapping[str, float], speed: bool = False
) -> Float[np.ndarray, " J"]:
    """Return joint values (J,) in rad and m, or speeds, from degrees and metres by their keys.

    Raises:
        ValueError: for a key that is unknown or missing.
    """
    wrong = misnamed(chain, values, speed)
    if wrong is not None:
        state = "unknown" if wrong[0] in values else "missing"
        raise ValueError(f"{wrong[0]} is {state}; allowed: {wrong[1]}")
    listed = [values.get(key, math.nan) for key in joint_keys(chain, speed)]
    q = from_file_units(chain, listed)
    settled = chain.settled(q, speed)
    return np.where(np.isnan(q), settled, q)


def contradicted(chain: Chain, q: Float[np.ndarray, " J"]) -> int | None:
    """Return the first mimic joint whose value in ``q`` (J,), rad and m, is not that which its
    leader states; None if all agree to 0.01 degrees or 0.1 mm."""
    far = np.where(chain.slides, _AGREE_M, _AGREE)
    off = np.flatnonzero(np.abs(chain.settled(q) - q) > far)
    return int(off[0]) if len(off) else None


def assignments(values: Mapping[str, float]) -> str:
    """Return joint values by key as text: ``rail_m = 0.3, shoulder_deg = 20``."""
    return ", ".join(
        f"{key} = {round(v, 3 if key.endswith(('_m', '_m_s')) else 1) + 0.0:g}"
        for key, v in values.items()
    )


def joint_text(chain: Chain, q: Float[np.ndarray, " J"]) -> str:
    """Return joint values (J,) in rad and m as text: angles with one decimal, or ``assignments`` if
    a joint is prismatic."""
    if chain.prismatic:
        return assignments(named(chain, q))
    return ", ".join(f"{v + 0.0:.1f}" for v in np.degrees(q).round(1)) + "°"


def radians_of(chain: Chain) -> Float[np.ndarray, " J"]:
    """Return the weight (J,) of each joint in a distance between poses, rad per rad or per m.

    A prismatic joint's metre weighs as much as the rotation that moves a point by a metre at the
    arm's length, which is the length of the chain beyond its first revolute joint.
    """
    if not chain.prismatic:
        return np.ones(len(chain))
    beyond = chain.origin[chain.first_revolute + 1 :, :3, 3]
    length = float(np.linalg.norm(beyond, axis=1).sum())
    turns = not chain.slides.all() and length > 0
    return np.where(chain.slides, 1 / length if turns else 1.0, 1.0)


def joint_keys_of(chain: Chain, q: Float[np.ndarray, " J"]) -> dict[str, Any]:
    """Return the keys for joint values in rad and m: ``q_deg``, or ``q`` if a joint is
    prismatic."""
    if chain.prismatic:
        return {"q": named(chain, q)}
    return {"q_deg": [degrees(angle) for angle in q]}
