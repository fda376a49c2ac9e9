"""Redesign of a mounted setup: the best single change, the best two, and so on."""

from collections.abc import Callable
from dataclasses import dataclass, field

from ._arguments import renamed
from ._errors import input_errors
from ._improvement import Improvement
from ._options import called_with
from ._validation import SetupCall, check_scene, resolve_setup
from .objectives.verify import Verifier
from .placement.redesign import redesign
from .placement.search.context import SearchContext
from .placement.search.options import ImproveOptions
from .placement.search.progress import Progress


@dataclass(frozen=True)
class ImproveCall(ImproveOptions, SetupCall):
    """A call of ``improve``."""

    progress: Callable[[Progress], None] | None = field(default=None, kw_only=True)
    """Receives the progress from time to time, in the calling thread."""


@renamed(time_cap="time")
@called_with(ImproveCall)
def improve(call: ImproveCall) -> Improvement:
    """Search for the best single change to a mounted setup, the best two, and so on.

    A change moves, tilts or turns one ring, carries it to another link, adds it or removes it. The
    mounted rings may break the scene's rules; changed rings may not. Ctrl-C ends the search and
    returns the best changes so far.

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
    name, mounted, core = resolve_setup(call.setup, call.scene)
    check_scene(core, call.voxel)
    tell = call.progress or (lambda progress: None)
    context = SearchContext(Verifier(core, call.voxel), tell=tell).within(call.limit)
    with input_errors():
        result = redesign.improve(mounted, call, context)
    command = f"place_rings.improve(..., seed={call.seed})"
    return Improvement(
        name,
        core,
        result,
        call.changes,
        call.add_sensors,
        call.seed,
        command,
        verifier=context.verifier,
    )
