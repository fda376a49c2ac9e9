"""Position and angles of a single sensor on its link, as the page's controls show them."""

import math
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from ..coverage.rings.mounted_sensor import MountedSensor, Three

FARTHEST = 5.0  # m, of each coordinate
_DIGITS, _DIGITS_POSITION = 9, 6


@dataclass(frozen=True)
class SinglePose:
    """Where a single sensor sits on its link, and how it is turned, in the link's frame."""

    x: float
    """Position along x, m."""
    y: float
    """Position along y, m."""
    z: float
    """Position along z, m."""
    azimuth_deg: float
    """Angle of the beam's axis from +x towards +y, degrees; 0 along z."""
    elevation_deg: float
    """Angle of the beam's axis from the plane of x and y towards +z, degrees."""
    roll_deg: float
    """Rotation about the beam's axis, right-handed, degrees; 0: ``up`` points towards greater
    elevation. 0 for a round beam."""

    @staticmethod
    def of(one: MountedSensor) -> "SinglePose":
        """Return the pose of a sensor."""
        look, up = one.T_link_sensor[:3, 2], one.T_link_sensor[:3, 1]
        level = math.hypot(look[0], look[1])
        azimuth = math.atan2(look[1], look[0]) if level > 1e-9 else 0.0
        elevation = math.atan2(look[2], level)
        above, side = _across(azimuth, elevation)
        roll = math.atan2(up @ side, up @ above) if one.up is not None else 0.0
        angles = (round(math.degrees(a), 6) + 0.0 for a in (azimuth, elevation, roll))
        return SinglePose(*one.position, *angles)

    def placed(self, one: MountedSensor) -> MountedSensor:
        """Return ``one`` at this pose.

        Raises:
            ValueError: if a number is not finite or a coordinate exceeds ``FARTHEST``.
        """
        at = (self.x, self.y, self.z)
        angles = (self.azimuth_deg, self.elevation_deg, self.roll_deg)
        if not all(map(math.isfinite, (*at, *angles))):
            raise ValueError("numbers must be finite")
        if max(map(abs, at)) > FARTHEST:
            raise ValueError(f"a coordinate must be at most {FARTHEST:g} m")
        x, y, z = (round(v, _DIGITS_POSITION) + 0.0 for v in at)
        before = SinglePose.of(one)
        # a sensor that moves is no longer where it was lifted
        there = replace(one, position=(x, y, z), lifted=one.lifted if self == before else 0.0)
        if replace(before, x=self.x, y=self.y, z=self.z) == self:
            return there  # turned as before, without another rounding
        azimuth, roll = math.radians(self.azimuth_deg), math.radians(self.roll_deg)
        elevation = math.radians(min(max(self.elevation_deg, -90.0), 90.0))
        above, side = _across(azimuth, elevation)
        level = math.cos(elevation)
        look = (level * math.cos(azimuth), level * math.sin(azimuth), math.sin(elevation))
        up = None if one.up is None else _three(math.cos(roll) * above + math.sin(roll) * side)
        return replace(there, direction=_three(np.array(look)), up=up)


def _across(
    azimuth: float, elevation: float
) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]:
    """Return the two directions across a beam at roll 0: ``up``, and where it turns to."""
    ca, sa, ce, se = math.cos(azimuth), math.sin(azimuth), math.cos(elevation), math.sin(elevation)
    return np.array([-se * ca, -se * sa, ce]), np.array([sa, -ca, 0.0])


def _three(v: Float[np.ndarray, " 3"]) -> Three:
    x, y, z = (round(float(a), _DIGITS) + 0.0 for a in v)
    return x, y, z
