"""Checks of a scene or setup before any computation."""

from pydantic import ValidationError

from ..coverage.rings.ring import Ring, Setup
from ..objectives.occlusion import check_bodies, check_mounting
from ..objectives.scene import Scene
from ..objectives.separation_summary import separations
from ..objectives.verify import check_voxel, target_voxels
from .errors import UserError, explain
from .schema.scene_models import SceneModel

_COARSE = 0.1  # m, voxels above this size are few enough to test whether the target holds one


def check_scene(scene: Scene, voxel: float) -> None:
    """Reject a scene that cannot be counted or written.

    Raises:
        UserError: with the reason.
    """
    try:
        SceneModel.from_domain(scene)
    except ValidationError as error:
        raise explain("the scene", error, SceneModel) from error
    for goal in scene.goals:
        try:
            separations(scene, goal.target)
        except ValueError as error:
            raise UserError(f"--target {goal.target}: {error}") from error
        try:
            solid = scene.solid(goal.target, 0)
            check_voxel(solid, voxel)
            if voxel > _COARSE and len(target_voxels(solid, voxel, "centre")) == 0:
                raise ValueError(
                    f"voxel {voxel:g} m is larger than target {goal.target}; allowed: smaller"
                )
        except ValueError as error:
            raise UserError(f"--voxel: {error}") from error


def check_sight(scene: Scene, setup: Setup) -> None:
    """Reject a setup with sensors inside their own link, and a robot without bodies, where the
    occlusion model needs them.

    Raises:
        UserError: with the reason.
    """
    if scene.occlusion == "ignore":
        return
    try:
        check_bodies(scene, scene.occlusion)
        check_mounting(scene, setup)
    except ValueError as error:
        raise UserError(str(error)) from error


def check_scene_sight(scene: Scene) -> None:
    """Reject a search whose rings would all lie inside a link's own body, where the occlusion model
    accounts for it.

    Raises:
        UserError: with the reason.
    """
    rings = (
        []
        if scene.real
        else [Ring(link, 0.5, 1, radius=scene.radius_of(link)) for link in scene.robot.links]
    )
    check_sight(scene, Setup((*rings, *scene.rules.fixed)))
