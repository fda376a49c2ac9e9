"""What the commands say about occlusion: zeta under all models, advice, and the sensors that see nothing."""

from ..coverage.rings.ring import Ring, Setup
from ..formats.errors import UserError
from ..objectives.occlusion import check_bodies, check_mounting
from ..objectives.scene import Scene


def check_sight(scene: Scene, setup: Setup) -> None:
    """Refuse a setup whose sensors stand within their own link, where the scene minds it, and a robot without bodies."""
    if scene.occlusion == "ignore":
        return
    try:
        check_bodies(scene, scene.occlusion)
        check_mounting(scene, setup)
    except ValueError as error:
        raise UserError(str(error)) from error


def check_scene_sight(scene: Scene) -> None:
    """Refuse a search whose rings would all lie within a link's own tube, where the scene minds it."""
    rings = [] if scene.real else [Ring(link, 0.5, 1, radius=scene.radius_of(link)) for link in scene.robot.links]
    check_sight(scene, Setup((*rings, *scene.rules.fixed)))
