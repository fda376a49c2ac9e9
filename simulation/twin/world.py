"""A world in MuJoCo: robot, cell and sensors, and bodies that can be put anywhere."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal, NamedTuple

import numpy as np
from jaxtyping import Float, Int

from ...formats.export.mjcf import mjcf
from ...formats.export.placed import PlacedSetup

Kind = Literal["box", "capsule", "cylinder", "sphere"]
ROBOT, CELL, BODIES = 0, 1, 2
"""Groups of geoms in a scene's own model; those of bodies follow the last one."""
SITE = 0.004
"""Displayed size of a sensor's site, m."""
_AWAY = (0.0, 0.0, 1e3)  # m, where bodies are that are not in use
_FARTHEST = 1e3  # m
_GROUPS = 6  # of MuJoCo


class TwinBody(NamedTuple):
    """A body that only the sensors meet: a test piece, or a part of a person."""

    kind: Kind
    """Shape; the axis of a capsule or cylinder is its z."""
    size: tuple[float, ...]
    """Half sizes, m; of a capsule or cylinder its radius and half its length; of a sphere its
    radius."""
    group: int = 0
    """Bodies of one group are seen together."""


class RayHits(NamedTuple):
    """What rays meet first."""

    distance: Float[np.ndarray, " R"]
    """Distance, m; infinite without a hit."""
    geom: Int[np.ndarray, " R"]
    """Number of the geom; -1 without a hit."""


@dataclass(frozen=True)
class TwinWorld:
    """A compiled model with its state."""

    model: Any
    """Its ``mujoco.MjModel``."""
    data: Any
    """Its ``mujoco.MjData``."""
    sites: Int[np.ndarray, " K"]
    """Sites of the sensors, which look along z; y is the ``up`` of the beam."""
    mocap: Int[np.ndarray, " B"]
    """Numbers of the bodies that can be put anywhere."""

    @property
    def apex(self) -> Float[np.ndarray, "K 3"]:
        """Apexes of the sensors, m."""
        apex: np.ndarray = self.data.site_xpos[self.sites]
        return apex

    @property
    def frame(self) -> Float[np.ndarray, "K 3 3"]:
        """Axes of the sensors in columns: across, up, and the axis of the beam."""
        frame: np.ndarray = self.data.site_xmat[self.sites].reshape(-1, 3, 3)
        return frame

    def put(
        self,
        body: int,
        centre: Float[np.ndarray, " 3"],
        frame: Float[np.ndarray, "3 3"] | None = None,
    ) -> None:
        """Put a body at a place, m, with the axes in the columns of ``frame``, or as it is turned;
        call ``place`` after the last one."""
        import mujoco

        self.data.mocap_pos[self.mocap[body]] = centre
        if frame is not None:
            turn = self.data.mocap_quat[self.mocap[body]]
            mujoco.mju_mat2Quat(turn, np.ascontiguousarray(frame).ravel())

    def put_away(self) -> None:
        """Put all bodies where no sensor sees them; call ``place`` afterwards."""
        self.data.mocap_pos[self.mocap] = _AWAY

    def place(self) -> None:
        """Move everything to where the joints and bodies were put."""
        import mujoco

        mujoco.mj_kinematics(self.model, self.data)

    def cast(
        self,
        apex: Float[np.ndarray, " 3"],
        direction: Float[np.ndarray, "R 3"],
        groups: Sequence[int] | None = None,
        farthest: float = _FARTHEST,
    ) -> RayHits:
        """Return what unit rays from a point meet first, by one call of ``mj_multiRay``.

        Args:
            apex: the point, m.
            direction: the rays.
            groups: groups of the geoms that count; None: all.
            farthest: distance beyond which geoms need not count, m.
        """
        import mujoco

        n = len(direction)
        hit, distance = np.full(n, -1, np.int32), np.zeros(n)
        wanted = None
        if groups is not None:
            wanted = np.zeros(_GROUPS, np.uint8)
            wanted[list(groups)] = 1
        vectors = np.ascontiguousarray(direction).ravel()
        found = (hit, distance, *_normals())
        cast = mujoco.mj_multiRay
        cast(self.model, self.data, apex, vectors, wanted, 1, -1, *found, n, farthest)
        distance[distance < 0] = np.inf
        return RayHits(distance, hit)


@lru_cache
def _normals() -> tuple[None, ...]:
    """Return the argument for normals, which later versions of MuJoCo can return too."""
    import mujoco

    return (None,) if "normal" in (mujoco.mj_multiRay.__doc__ or "") else ()


def scene_world(placed: PlacedSetup, bodies: Sequence[TwinBody] = ()) -> TwinWorld:
    """Return the world of a scene at a pose: the robot's capsules and the cell's obstacles, as the
    MJCF of a setup has them, in the same frame; the bodies are away."""
    import mujoco

    spec = mujoco.MjSpec.from_string(mjcf(placed)["scene.xml"].decode())
    for sensor in list(spec.sensors):  # rangefinders, which MuJoCo would cast in every step
        spec.delete(sensor)
    for name in (sensor.name for sensor in placed.sensors):  # each body takes time of each ray
        held = spec.body(name)
        link, frame = held.parent, held.frame
        place = {"pos": held.pos.copy(), "quat": held.quat.copy()}
        spec.delete(held)
        site = link.add_site(name=name, size=[SITE] * 3, **place)
        if frame is not None:
            site.set_frame(frame)
    for geom in spec.geoms:
        geom.group = CELL if geom.name.startswith("obstacle_") else ROBOT
    world = compiled(spec, placed, bodies)
    mujoco.mj_resetDataKeyframe(world.model, world.data, 0)
    world.put_away()
    world.place()
    return world


def compiled(spec: Any, placed: PlacedSetup, bodies: Sequence[TwinBody]) -> TwinWorld:
    """Return the world of a specification that has the sensors' sites, with further bodies."""
    import mujoco

    names = [f"piece_{i}" for i in range(len(bodies))]
    for name, body in zip(names, bodies, strict=True):
        held = spec.worldbody.add_body(name=name, mocap=True, pos=_AWAY)
        kind = getattr(mujoco.mjtGeom, f"mjGEOM_{body.kind.upper()}")
        size, group = [*body.size, 0.0, 0.0][:3], BODIES + body.group
        held.add_geom(type=kind, size=size, group=group, mass=1.0, contype=0, conaffinity=0)
    model = spec.compile()
    sites = [model.site(sensor.name).id for sensor in placed.sensors]
    mocap = [int(model.body(name).mocapid[0]) for name in names]
    return TwinWorld(model, mujoco.MjData(model), np.array(sites, int), np.array(mocap, int))
