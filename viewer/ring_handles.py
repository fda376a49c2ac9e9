"""Handles in the scene that drag the selected ring along and around its link."""

import math
import threading
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import viser
import viser.transforms
from jaxtyping import Float

from ..coverage.rings.ring import Ring
from ..coverage.robots.kinematics import forward
from ..coverage.robots.robot import Robot

_LARGER = 1.5  # size of a handle in radii of its ring
_LONG = 1e3  # m, and rad: no limit


def mount_frame(
    robot: Robot, q: Float[np.ndarray, " J"], ring: Ring, position: float = 0.0
) -> Float[np.ndarray, "4 4"]:
    """Return the frame (4, 4) m of a place on a ring's mount axis, seen from the base.

    Its z axis points along the mount axis, its x axis to the sensor of phase 0.
    """
    mount = robot.mount(ring.link)
    T: np.ndarray = np.asarray(forward(robot.chain, q))[mount.frame] @ mount.T_link_ring(position)
    return T


def dragged_position(
    T_base_mount: Float[np.ndarray, "4 4"], length: float, point: Float[np.ndarray, " 3"]
) -> float:
    """Return the position in [0, 1] on a mount axis that is nearest to a point (3,) m."""
    along = float((point - T_base_mount[:3, 3]) @ T_base_mount[:3, 2])
    return min(max(along / length, 0.0), 1.0)


def dragged_phase(
    T_base_mount: Float[np.ndarray, "4 4"], R_base_handle: Float[np.ndarray, "3 3"]
) -> float:
    """Return the phase, rad in [0, 2 pi), of a handle whose x axis points to a ring's first
    sensor.
    """
    x = T_base_mount[:3, :3].T @ R_base_handle[:, 0]
    return math.atan2(x[1], x[0]) % (2 * math.pi)


class _Pose(NamedTuple):
    """Pose of a handle, in the frame of its setup."""

    position: Float[np.ndarray, " 3"]
    wxyz: Float[np.ndarray, " 4"]


class RingHandles:
    """The handles of one page.

    Args:
        scene: scene of the page.
        dragged: receives the ring's new position in [0, 1] or phase in rad, and None for the
            other, in viser's own thread.
    """

    def __init__(
        self, scene: viser.SceneApi, dragged: Callable[[float | None, float | None], None]
    ) -> None:
        self._scene, self._dragged = scene, dragged
        self._root: tuple[str, float, bool] | None = None
        self._along: viser.TransformControlsHandle | None = None
        self._around: viser.TransformControlsHandle | None = None
        self._T, self._length = np.eye(4), 0.0
        self._held, self._lock = False, threading.Lock()

    def hide(self) -> None:
        """Remove the handles."""
        with self._lock:
            shown = self._along, self._around
            self._root, self._along, self._around, self._held = None, None, None, False
        for handle in shown:
            if handle is not None:
                handle.remove()

    def show(self, root: str, robot: Robot, q: Float[np.ndarray, " J"], ring: Ring) -> None:
        """Show the handles at a ring.

        Args:
            root: name of the setup's frame in the scene.
            robot: the robot.
            q: joint values (J,).
            ring: the selected ring.
        """
        mount = robot.mount(ring.link)
        self._T, self._length = mount_frame(robot, q, ring), mount.length
        wanted = (root, ring.radius, mount.length > 0)
        if self._root != wanted:
            self.hide()
            self._add(*wanted)
        T = mount_frame(robot, q, ring, ring.position)
        turn = viser.transforms.SO3.from_z_radians(ring.phase)
        wxyz = (viser.transforms.SO3.from_matrix(T[:3, :3]) @ turn).wxyz
        with self._lock:  # a drag that begins now waits, so that it is not overwritten
            if self._held:
                return
            for handle in (self._along, self._around):
                if handle is not None:
                    handle.position, handle.wxyz = T[:3, 3], wxyz

    def _add(self, root: str, radius: float, movable: bool) -> None:
        self._root = root, radius, movable

        def add(name: str, axes: tuple[bool, bool, bool], moved: Any, **more: Any) -> Any:
            handle = self._scene.add_transform_controls(
                f"{root}/{name}",
                _LARGER * 2 * radius,
                active_axes=axes,
                disable_sliders=True,
                depth_test=False,
                opacity=0.6,
                **more,
            )
            self._follow(handle, moved)
            return handle

        turned, along = self._moved_around, self._moved_along
        self._around = add("around", (True, True, False), turned, disable_axes=True)
        if movable:
            self._along = add("along", (False, False, True), along, disable_rotations=True)

    def _follow(
        self, handle: viser.TransformControlsHandle, moved: Callable[[_Pose], None]
    ) -> None:
        """Call ``moved`` with each pose to which the user drags a handle, and with the last again
        at the end.

        The pose is read at once, in viser's own thread: a drawing in between may put the handle
        back to where the ring still is. Only there do the phases come in order.
        """

        def pose() -> _Pose:
            return _Pose(handle.position.copy(), handle.wxyz.copy())  # viser writes into them

        newest = pose()

        async def heard(event: viser.TransformControlsEvent) -> None:
            nonlocal newest
            with self._lock:
                shown = handle is self._along or handle is self._around
                if shown:
                    self._held = event.phase != "end"
            if event.phase != "end":  # it may have been placed anew since the last drag
                newest = pose()
            if shown and event.phase != "start":
                moved(newest)

        handle.on_update(heard)

    def _moved_along(self, pose: _Pose) -> None:
        at = np.asarray(pose.position, float)
        if self._length > 0 and np.isfinite(at).all():
            self._dragged(dragged_position(self._T, self._length, at), None)

    def _moved_around(self, pose: _Pose) -> None:
        wxyz = np.asarray(pose.wxyz, float)
        if np.isfinite(wxyz).all() and np.linalg.norm(wxyz) > 0.5:
            self._dragged(None, dragged_phase(self._T, viser.transforms.SO3(wxyz).as_matrix()))
