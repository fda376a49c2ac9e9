"""Solids of a scene: obstacles of the cell, and what is attached to the robot."""

from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np
from pydantic import ValidationError

from ._errors import InputError
from ._model_errors import model_error
from .coverage.robots.attached import Attached
from .formats.schema.attached_models import AttachedModel, attached_of
from .formats.schema.convex_models import ConvexModel
from .formats.schema.obstacle_models import ObstacleModel, obstacles_of
from .objectives.scene import Obstacle


def obstacle(
    name: str = "",
    *,
    centre: Sequence[float] = (0.0, 0.0, 0.0),
    rpy_deg: Sequence[float] = (0.0, 0.0, 0.0),
    size: Sequence[float] | None = None,
    points: Sequence[Sequence[float]] | None = None,
    floor: float | None = None,
) -> Obstacle:
    """Return a convex obstacle of the cell. It occludes sensors and is excluded from targets.

    Args:
        name: name of the obstacle in reports.
        centre: (x, y, z) of the box's centre, or of the origin of the points' frame, m, in the base
            frame (``base`` of ``Scene``).
        rpy_deg: rotations about x, y and z of the base frame, in this order, degrees.
        size: (x, y, z) size of a box, m.
        points: (N, 3) points in m; the obstacle is their convex hull.
        floor: height of a floor, m; the obstacle is everything below.

    Returns:
        The obstacle, for ``Scene(obstacles=[...])``.

    Raises:
        InputError: unless exactly one of ``size``, ``points`` and ``floor`` is given and in range.

    Example:
        >>> import place_rings as pr
        >>> pr.obstacle("table", centre=[0.8, 0, -0.1], size=[0.6, 1.2, 0.2]).name
        'table'
    """
    model = _solid_model(
        ObstacleModel,
        "obstacle",
        name=name,
        centre=centre,
        rpy_deg=rpy_deg,
        size=size,
        points=points,
        floor=floor,
    )
    return obstacles_of([model])[0]


def attached(
    name: str = "",
    *,
    link: str = "tcp",
    centre: Sequence[float] = (0.0, 0.0, 0.0),
    rpy_deg: Sequence[float] = (0.0, 0.0, 0.0),
    size: Sequence[float] | None = None,
    points: Sequence[Sequence[float]] | None = None,
    start: Sequence[float] | None = None,
    end: Sequence[float] | None = None,
    radius: float | None = None,
) -> Attached:
    """Return a tool or payload on a link. It moves with the link, belongs to the robot's body,
    occludes sensors, is excluded from targets, and rings keep clear of it.

    Args:
        name: name in reports.
        link: link whose frame carries it: a link with a mount, a joint (the link that it moves),
            ``tcp`` or ``base``.
        centre: (x, y, z) of the box's centre, or of the origin of the points' or the capsule's
            frame, m, in the link's frame.
        rpy_deg: rotations about x, y and z of the link's frame, in this order, degrees.
        size: (x, y, z) size of a box, m.
        points: (N, 3) points in m; the solid is their convex hull.
        start: (x, y, z) of the start of a capsule's axis, m.
        end: (x, y, z) of the end of a capsule's axis, m.
        radius: radius of the capsule, m.

    Returns:
        The solid, for ``Scene(attached=[...])``.

    Raises:
        InputError: unless exactly one of ``size``, ``points`` and ``start``, with ``end`` and
            ``radius``, is given and in range.

    Example:
        >>> import place_rings as pr
        >>> pr.attached("gripper", centre=[0, 0, 0.07], size=[0.1, 0.06, 0.14]).link
        'tcp'
    """
    model = _solid_model(
        AttachedModel,
        "attached",
        name=name,
        link=link,
        centre=centre,
        rpy_deg=rpy_deg,
        size=size,
        points=points,
        start=start,
        end=end,
        radius=radius,
    )
    return attached_of([model])[0]


_Solid = TypeVar("_Solid", bound=ConvexModel)


def _solid_model(model: type[_Solid], argument: str, **keys: Any) -> _Solid:
    """Return the table of a solid from values that may be integers, tuples or arrays.

    Raises:
        InputError: for values that are not numbers, or out of range.
    """

    def plain(value: Any) -> Any:
        if value is None or isinstance(value, str):
            return value
        return [plain(v) for v in value] if np.ndim(value) else float(value)

    try:
        return model(**{key: plain(value) for key, value in keys.items()})
    except ValidationError as error:
        raise model_error(argument, error, model) from error
    except (TypeError, ValueError) as error:
        raise InputError(
            "found values that are not numbers, allowed: (x, y, z) in m, degrees for rpy_deg",
            argument,
        ) from error
