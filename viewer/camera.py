"""The camera of a page: a view that fits the scene into the window, whatever the window's shape."""

import math
import threading

import numpy as np
import viser
from jaxtyping import Float

Vector = Float[np.ndarray, " 3"]

FOV = 0.7  # rad, vertical field of view
ASPECT = 1.4  # width of a window divided by its height, until the browser reports its own
START = "Start"
VIEWS: dict[str, Vector] = {
    "Iso": np.array([1.0, -1.0, 0.8]),
    "Front": np.array([1.0, 0.0, 0.0]),
    "Side": np.array([0.0, -1.0, 0.0]),
    "Top": np.array([0.0, -1e-3, 1.0]),
}
"""Directions from the scene to the camera of the standard views, in the base frame."""
_MARGIN = 1.06  # of the window about the scene
_MOVED = 0.02  # share of the distance; a camera farther from where it was put was moved by hand
_RESHAPED = 0.01  # change of the aspect ratio to which the view is fitted again


def fitted(
    points: Float[np.ndarray, "N 3"], direction: Vector, aspect: float, fov: float = FOV
) -> tuple[Vector, Vector]:
    """Return the nearest camera that sees all points, and the point that it looks at, both m.

    Args:
        points: points (N, 3) m to show.
        direction: from the scene to the camera; not along z.
        aspect: width of the window divided by its height.
        fov: vertical field of view, rad.
    """
    toward = direction / np.linalg.norm(direction)
    right = np.cross([0.0, 0.0, 1.0], toward)
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(toward, right), toward])  # rows: right, up, to the camera
    local = points @ axes.T  # (N, 3)
    slope = math.tan(fov / 2) / _MARGIN * np.array([aspect, 1.0])
    # Planes through the camera with these slopes bound the points on both sides: of the camera's
    # coordinates (c, d), c - slope d is at most and c + slope d at least that of each point.
    upper = (local[:, :2] + slope * local[:, 2:]).max(axis=0)
    lower = (local[:, :2] - slope * local[:, 2:]).min(axis=0)
    distance = float(((upper - lower) / (2 * slope)).max())
    across = (upper + lower) / 2
    depth = float(local[:, 2].mean())
    eye = np.array([*across, max(distance, float(local[:, 2].max()) + 0.05)])
    return eye @ axes, np.array([*across, depth]) @ axes


class FittedCamera:
    """The camera of one client. It follows the window's shape until the user moves it."""

    def __init__(self, client: viser.ClientHandle) -> None:
        self._client, self._lock = client, threading.Lock()
        self._points = np.zeros((1, 3))
        self._direction = VIEWS["Iso"]
        self._aspect = 0.0
        self._eye: Vector | None = None
        self._arrived = False  # whether the browser has reported the view that was set last
        self._set_at = 0.0  # the camera's time stamp after that; each report brings another

    def show(self, points: Float[np.ndarray, "N 3"], direction: Vector) -> None:
        """Look at points (N, 3) m from a direction."""
        with self._lock:
            self._points, self._direction = points, np.asarray(direction, float)
            self._fit()

    def _fit(self) -> None:
        camera = self._client.camera
        self._aspect = float(camera.aspect)
        eye, middle = fitted(self._points, self._direction, self._aspect)
        self._eye, self._arrived = eye, False
        with self._client.atomic():
            camera.fov = FOV
            camera.position = eye  # moves what it looks at, too
            camera.look_at = middle
            camera.up_direction = np.array([0.0, 0.0, 1.0])
            self._set_at = camera.update_timestamp
        self._client.flush()

    def follow(self) -> None:
        """Fit the view again if the window has another shape and the user did not move it."""
        camera = self._client.camera
        with self._lock:
            if self._eye is None:
                return
            moved = float(np.linalg.norm(camera.position - self._eye))
            there = moved < _MOVED * float(np.linalg.norm(self._eye - camera.look_at))
            # with the old time stamp, the camera is what was set here, not what a browser reported
            reported = camera.update_timestamp != self._set_at
            self._arrived = self._arrived or (there and reported)
            if abs(camera.aspect / self._aspect - 1) < _RESHAPED:
                return
            if there or not self._arrived:  # the browser may not have heard of the last view yet
                self._fit()
            else:
                self._aspect = float(camera.aspect)

    @property
    def direction(self) -> Vector:
        """Direction from what the camera looks at to the camera."""
        camera = self._client.camera
        return np.asarray(camera.position) - np.asarray(camera.look_at)
