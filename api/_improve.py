"""Redesign of a mounted setup: the best single change, the best two, and so on."""

from collections.abc import Callable

from ._arguments import number, renamed, whole
from ._errors import input_errors
from ._improvement import Improvement
from ._scene import Scene
from ._search import cap_of
from ._validation import SetupLike, check_scene, resolve_setup
from .objectives.scene import CoreScene
from .objectives.verify import VOXEL, Verifier
from .placement.redesign import redesign
from .placement.search.progress import Progress

_MOST_CHANGES, _MOST_ADDED = 20, 1000


@renamed(time_cap="time")
def improve(
    setup: SetupLike,
    scene: Scene | CoreScene | None = None,
    *,
    changes: int = 3,
    add_sensors: int = 0,
    seed: int = 0,
    time: float | None = None,
    voxel: float = VOXEL,
    progress: Callable[[Progress], None] | None = None,
) -> Improvement:
    """Search for the best single change to a mounted setup, the best two, and so on.

    A change moves, tilts or turns one ring, carries it to another link, adds it or removes it. The
    mounted rings may break the scene's rules; changed rings may not. Ctrl-C ends the search and
    returns the best changes so far.

    Args:
        setup, scene: as in ``verify``.
        changes: largest number of changes, 1 to 20.
        add_sensors: largest number of additional sensors, 0 to 1000.
        seed: random seed; the same seed gives the same answer on the same machine.
        time: limit in seconds; by default the search ends by its own schedule.
        voxel: side of the voxels of the count, m.
        progress: receives the progress from time to time, in the calling thread.

    Returns:
        A proposal for each number of changes that justifies its work.

    Raises:
        InputError: for a setup that does not fit the scene, or a value out of range.

    Example:
        >>> import place_rings as pr
        >>> scene = pr.Scene(targets=[pr.Shell(0.5)])
        >>> better = pr.improve("n1_8_0", scene, changes=1, voxel=0.05, time=5)
        >>> better.coverage >= better.before
        True
    """
    whole("changes", changes, 1, _MOST_CHANGES)
    whole("add_sensors", add_sensors, 0, _MOST_ADDED)
    whole("seed", seed, 0)
    if time is not None:
        number("time", time, "a positive number of seconds")
    cap = cap_of(time)
    name, mounted, core = resolve_setup(setup, scene)
    check_scene(core, voxel)
    tell = progress or (lambda _: None)
    with input_errors():
        result = redesign.improve(
            core, mounted, changes, add_sensors, seed, cap, voxel=voxel, tell=tell
        )
    command = f"place_rings.improve(..., seed={seed})"
    return Improvement(
        name,
        Scene.of(core),
        result,
        changes,
        add_sensors,
        seed,
        command,
        verifier=Verifier(core, voxel),
    )
