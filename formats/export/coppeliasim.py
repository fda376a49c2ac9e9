"""CoppeliaSim: a Lua script that creates a proximity sensor for each sensor, looking along its z
axis."""

import math
from collections.abc import Iterable

import numpy as np
from jaxtyping import Float

from ...coverage.robots.robot import BASE
from ...coverage.sensors.sensor import Sensor
from ..robots.urdf_matching import plain_names
from ..sensors.sensor_poses import place, quaternion
from .placed import PlacedSetup

_HEAD = """-- Proximity sensors of {robot}, for CoppeliaSim 4.3 and later: paste this into the Lua \
commander, or run
-- loadfile('FOLDER/sensors.lua')() there. If the scene has no object with a link's name, a dummy \
is created at the
-- link's exported pose. Sensors are children of these objects and look along their z axis.
local sim = sim or require('sim')
local CONE = sim.proximitysensor_cone or sim.proximitysensor_cone_subtype
local PYRAMID = sim.proximitysensor_pyramid or sim.proximitysensor_pyramid_subtype
local ALL = 16 -- detects all detectable objects
local SHOWN = {{32, 0, 1, 16, 1, 1, 0, 0}} -- faces and subdivisions of a cone

-- Name, pose {{x, y, z, qx, qy, qz, qw}} in the world.
local links = {{
"""
_MAKE = """}

local handles = {}
for _, link in ipairs(links) do
    local name, pose = link[1], link[2]
    local found = sim.getObject('/' .. name, {noError = true})
    if found == -1 then
        found = sim.createDummy(0.01)
        sim.setObjectAlias(found, name)
        sim.setObjectPose(found, pose, sim.handle_world)
    end
    handles[name] = found
end
for _, sensor in ipairs(sensors) do
    local name, link, kind, sizes, pose = table.unpack(sensor)
    local made = sim.createProximitySensor(kind, ALL, 0, SHOWN, sizes)
    sim.setObjectAlias(made, name)
    sim.setObjectParent(made, handles[link], false)
    sim.setObjectPose(made, pose, handles[link])
end
"""


def coppeliasim(placed: PlacedSetup) -> dict[str, bytes]:
    """Return ``sensors.lua``. A cone there ends in a spherical cap at the range, not in a flat
    base; a pyramid ends flat. Beams that no cone holds, as of planar scanners, are left out, with a
    comment."""
    used = sorted({placed.on_link(s)[0] for s in placed.sensors})
    links = [placed.carrier(BASE), *placed.links]
    names = dict(enumerate(plain_names(links), start=BASE))
    text = _HEAD.format(robot=placed.robot_name)
    for j in used:
        T = placed.T_base_root if j == BASE else placed.T_base_frame[j]
        text += f"    {{'{names[j]}', {_pose(placed.T_world_base @ T)}}},\n"
    text += (
        "}\n\n-- Name, link, kind, sizes, pose {x, y, z, qx, qy, qz, qw} in the link.\nlocal"
        " sensors = {\n"
    )
    for s in placed.sensors:
        joint, T = placed.on_link(s)
        if s.unit.outer_angle > math.pi / 2:  # its beam is no part of a cone from its apex
            text += f"    -- {s.name}: a {s.unit.shape} has no proximity sensor of its shape here\n"
            continue
        kind = "PYRAMID" if s.unit.square else "CONE"
        text += (
            f"    {{'{s.name}', '{names[joint]}', {kind}, {_table(_sizes(s.unit))}, {_pose(T)}}},\n"
        )
    return {"sensors.lua": (text + _MAKE).encode()}


def _sizes(sensor: Sensor) -> list[float]:
    """Return the fifteen sizes of ``sim.createProximitySensor``.

    They are offset, range, near sides (x, y), far sides (x, y), gap, near and far radius, angle,
    largest angle of surfaces, least distance, size of the displayed point, and two unused values.
    """
    across, up = (
        2 * sensor.range_m * math.tan(half) if sensor.square else 0.0
        for half in (sensor.half_angle, sensor.half_angle_up)
    )
    angle = 0 if sensor.square else sensor.fov
    return [0, sensor.range_m, 0, 0, across, up, 0, 0, 0, angle, 0, 0, 0.01, 0, 0]


def _pose(T: Float[np.ndarray, "4 4"]) -> str:
    return _table([*place(T), *quaternion(T)])


def _table(values: Iterable[float]) -> str:
    return "{" + ", ".join(f"{v:.12g}" for v in values) + "}"
