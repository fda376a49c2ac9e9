"""The exact coverage of a setup: count it and print it."""

from ...coverage.rings.ring import Setup
from ...coverage.voxels.certified_bounds import Bracket
from ...formats.scene_checks import check_scene, check_sight
from ...formats.schema.result_models import VerifyResult
from ...formats.schema.sensor_records import sensor_records
from ...objectives.occlusion import unseeing
from ...objectives.scene import Scene
from ...objectives.verify import Verifier, by_occlusion
from ...reporting.lines.motion import record_line, worst_line
from ...reporting.lines.occlusion import mounting_lines, print_sight
from ...reporting.lines.protective_volume import protective_lines
from ...reporting.lines.sensors import sensor_lines
from ...reporting.tables import percent, proof_line, target_label, zeta_table
from ...reporting.terminal import Terminal, say_json
from ..options.counting import Counting

_SHOWN = 16  # poses up to which each is shown


def verify(name: str, setup: Setup, scene: Scene, counting: Counting, as_json: bool) -> None:
    """Print the exact zeta of ``setup`` for the scene's goals."""
    check_sight(scene, setup)
    if counting.rule != "certified" and counting.voxel is not None:
        check_scene(scene, counting.voxel)
    with Terminal(stderr=True).status("counting") as status:

        def tell(b: Bracket) -> None:
            status.update(
                f"pass {b.passes}: {100 * b.low:.3f} … {100 * b.high:.3f} %, {b.cells:,} cells"
            )

        def at(pose: int) -> None:
            if len(scene.poses) > 1:
                status.update(f"counting pose {pose + 1} of {len(scene.poses)}")

        verifier = Verifier(
            scene, counting.voxel, counting.rule, counting.width, tell, counting.memory, at
        )
        counted = [verifier.verify(setup, goal.target) for goal in scene.goals]
        blocked = unseeing(scene, setup)
        results = [
            VerifyResult.of(name, one, scene).with_occlusion(
                scene, by_occlusion(verifier, setup, one), blocked
            )
            for one in counted
        ]
    extra = {"sensors": sensor_records(setup), "mounting": mounting_lines(scene, setup)}
    results = [r.model_copy(update=extra) for r in results]
    if as_json:
        records = [r.model_dump_json(indent=2) for r in results]
        say_json(records[0] if len(records) == 1 else "[" + ",\n".join(records) + "]")
        return
    console = Terminal()
    console.print(
        zeta_table(results, {name: setup.sensors}, f"ζ in percent, {how(counting)}, {place(scene)}")
    )
    print_sight(console, results, results[0].unseeing, scene)
    for told in results[0].mounting:
        console.print(f"No real mount: {told}.", highlight=False, soft_wrap=True)
    for r in results:
        if r.proof is not None:
            console.print(proof_line(r, r.proof), soft_wrap=True)
        if 1 < len(scene.poses) <= _SHOWN:
            each = ", ".join(percent(p, r.rule) for p in r.poses)
            console.print(f"{target_label(r)}: pose by pose {each}")
        if line := worst_line(r):
            console.print(line, highlight=False, soft_wrap=True)
    sensors = sensor_records(setup)
    for line in (record_line(scene), *protective_lines(results, setup), *sensor_lines(sensors)):
        if line:
            console.print(line, highlight=False, soft_wrap=True)


def place(scene: Scene) -> str:
    """Robot and model of occlusion in words."""
    return f"robot {scene.robot.name}, occlusion {scene.occlusion}"


def how(counting: Counting) -> str:
    """Rule and size of voxels in words."""
    size = "" if counting.voxel is None else f", voxels of {counting.voxel:g} m"
    return f"rule {counting.rule}{size}"
