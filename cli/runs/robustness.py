"""The command that asks how robust a setup is: against blind sensors and rings, and against errors
of its mounting.
"""

from ...coverage.rings.ring import Setup
from ...formats.scene_checks import check_scene, check_sight
from ...objectives.scene import Scene
from ...reporting.robustness import Robustness, assess, lines, robustness_table
from ...reporting.tables import target_label
from ...reporting.terminal import Terminal, say_json


def robustness(name: str, setup: Setup, scene: Scene, asked: Robustness, as_json: bool) -> None:
    """Print redundancy and tolerance of ``setup`` for the scene's goals."""
    check_scene(scene, asked.voxel)
    check_sight(scene, setup)
    results = assess(name, setup, scene, asked, Terminal(stderr=True))
    if as_json:
        records = [r.model_dump_json(indent=2) for r in results]
        say_json(records[0] if len(records) == 1 else "[" + ",\n".join(records) + "]")
        return
    console = Terminal()
    console.print(robustness_table(results))
    for r in results:
        console.print(f"{target_label(r)}: {lines(r)}", soft_wrap=True, highlight=False)
