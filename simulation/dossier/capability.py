"""What the sensors can detect, for a dossier: the largest unseen objects, and the expected share in
which a test piece is detected."""

from dataclasses import replace

from ...coverage.definitions.definition import definition
from ...coverage.definitions.field_types import Items
from ...coverage.detection.detection import Detection
from ...coverage.occlusion.occlusion_mode import Occlusion
from ...coverage.rings.ring import Setup
from ...objectives.detected import Detected
from ...objectives.detection_share import detected
from ...objectives.object_bounds import SmallestObject
from ...objectives.options import ObjectOptions
from ...objectives.poses import Pose
from ...objectives.scene import Scene
from ...objectives.smallest_object import SIDE, smallest_objects
from ...objectives.verify import Verifier
from ..motion_samples import Moments
from .floor import examined


@definition(kw_only=True)
class TargetCapability:
    """What the sensors can detect in a target."""

    target: str
    """The target."""
    objects: SmallestObject | None = None
    """The largest unseen objects, between proved bounds; none if not requested."""
    detection: Detected | None = None
    """Expected share in which the test piece is detected, counted; none if not requested."""
    proved: Detected | None = None
    """The same as an interval that is guaranteed to hold the law's value."""


@definition(kw_only=True)
class Capability:
    """What the sensors can detect in the scene's targets."""

    moments: int
    """Number of moments that were examined."""
    of_moments: int
    """Number of moments of the motion."""
    targets: Items[TargetCapability] = ()
    """Each target of the scene."""


def capability_of(
    scene: Scene,
    setup: Setup,
    m: Moments,
    occlusion: Occlusion,
    options: ObjectOptions,
    question: Detection | None,
) -> Capability:
    """Return what a setup can detect at some moments of a motion.

    Args:
        scene: robot, targets, obstacles, and sensors of the cell, which count.
        setup: the setup.
        m: moments of the motion.
        occlusion: occlusion model.
        options: whether unseen objects are bounded in all targets; in those that state the largest
            gap they always are.
        question: what is to be detected; None: nothing.

    Raises:
        ValueError: for a target that is empty, or in light for which no source states a range.
    """
    at = examined(m).tolist()
    poses = (Pose(m.q[i], float(m.weight[i])) if m.together else scene.poses[i] for i in at)
    scene = replace(scene, poses=tuple(poses), occlusion=occlusion)
    objects = smallest_objects(scene, setup, SIDE, options)
    rows = list[TargetCapability]()
    for goal, largest in zip(scene.targets, objects, strict=True):
        target, counts = goal.target, list[Detected | None]([None, None])
        if question is not None:
            counts = [
                detected(Verifier(scene, SIDE, rule), setup, target, question)
                for rule in ("sampled", "certified")
            ]
        rows.append(
            TargetCapability(
                target=str(target), objects=largest, detection=counts[0], proved=counts[1]
            )
        )
    return Capability(moments=len(at), of_moments=len(m.weight), targets=tuple(rows))
