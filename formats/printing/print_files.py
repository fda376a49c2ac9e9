"""Files of printed rings: the parts of each ring as STL, plates of parts as 3MF, measurements."""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from jaxtyping import Float
from manifold3d import Manifold

from ...coverage.definitions.errors import UserError
from ...coverage.rings.ring import Ring, Setup
from ...coverage.robots.kinematics import rotation_rpy
from ...coverage.robots.robot import TCP_FRAME, Robot
from ...coverage.sensors.board_packing import Printing
from ...objectives.feasibility.ring_envelopes import envelope
from ...objectives.scene import Scene
from ..schema.print_models import PrintedLids, PrintedRing, PrintResult
from .blocks import thread
from .bolts import fastening, longest_sold
from .lettering import part_label
from .lids import flat_lid, lid_frames
from .print_bed import PLATE, Bed, bed_yaw, build_ring
from .print_checks import check_ring, printing_origin, stl
from .print_plan import MM, PrintPlan, UnbuildableError
from .print_plates import print_plates
from .ring_solids import Assembly

_LEAST_GRIP = 1.0  # length of a screw in the ring, over its diameter, at least
ASSEMBLED = "assembled.png"  # picture of the robot with all rings
MOUNTED = "mounted.png"  # picture of the first ring with boards and bolts


def print_ring(
    scene: Scene, number: int, ring: Ring, printing: Printing | None = None
) -> tuple[PrintedRing, list[bytes], PrintPlan, Assembly]:
    """Return a printed ring: its record, its parts as STL, and the plan and solids behind them.

    With lids, the last file is that of a lid; all lids of a ring are alike.

    Raises:
        UnbuildableError: if it cannot be built, or a measurement is outside its limits.
    """
    scene = replace(scene, printing=printing or scene.printing)
    plan, made = build_ring(scene, ring, number)
    yaws = [bed_yaw(part, plan.printing.bed or PLATE) or 0.0 for part in made.parts]
    files = [stl(part, yaw) for part, yaw in zip(made.parts, yaws, strict=True)]
    name = f"ring{number}_{_plain(ring.link)}"
    lids, lid_files = printed_lids(scene.robot, plan, f"{name}_lid.stl")
    checks = check_ring(plan, made, files, lid_files, envelope(scene, ring))
    for check in checks:
        if not check.holds:
            allowed = (
                f"at least {check.least:.4g}"
                if check.least is not None
                else f"at most {check.most:.4g}"
            )
            raise UnbuildableError(
                f"{check.name}: found {check.measured:.4g} {check.unit}, allowed: {allowed}"
            )
    mount = scene.robot.mount(ring.link)
    board = plan.pocket.board
    names = [f"{name}_{chr(ord('a') + i)}.stl" for i in range(len(files))]
    sizes = [_size(part, yaw) for part, yaw in zip(made.parts, yaws, strict=True)]
    record = PrintedRing(
        ring=number,
        link=ring.link,
        position_mm=MM * ring.position * mount.length,
        count=ring.count,
        tilt_deg=round(math.degrees(ring.tilt), 4),
        radius_mm=plan.radius,
        bore_mm=2 * plan.bore,
        size_mm=np.max(sizes, axis=0).tolist(),
        flipped=ring.tilt < 0,
        board=board.source,
        screws="{} × {}".format(*screws) if (screws := board_screws(plan)) else "none: glue",
        bolts=fastening(plan),
        ties=made.ties,
        lettering=[]
        if made.letters.is_empty()
        else [part_label(plan.label, i) for i in range(len(files))],
        files=[*names, *([lids.file] if lids else []), f"{name}.png"],
        frame=(*scene.robot.chain.joints, TCP_FRAME)[mount.frame],
        T_link_print={
            file: np.round(placed(scene.robot, plan, part, yaw), 9).tolist()
            for file, part, yaw in zip(names, made.parts, yaws, strict=True)
        },
        checks=checks,
        lids=lids,
    )
    return record, [*files, *lid_files], plan, made


def printed_lids(
    robot: Robot, plan: PrintPlan, file: str
) -> tuple[PrintedLids | None, list[bytes]]:
    """Return the record of a ring's lids and the STL file of one; None and no file without lids.

    Raises:
        UnbuildableError: if a lid does not fit the bed.
    """
    lid, bed = flat_lid(plan), plan.printing.bed
    if lid.is_empty():
        return None, []
    if (yaw := bed_yaw(lid, bed)) is None:
        raise UnbuildableError("its lids do not fit printing.bed_mm")
    places = [placed(robot, plan, lid, yaw, T) for T in lid_frames(plan)]
    lids = PrintedLids(
        file=file,
        copies=len(places),
        size_mm=_size(lid, yaw).tolist(),
        T_link_print=[np.round(T, 9).tolist() for T in places],
    )
    return lids, [stl(lid, yaw)]


def board_screws(plan: PrintPlan) -> tuple[int, str] | None:
    """Return the number and kind of the screws of a ring's boards; None if they are glued."""
    board = plan.pocket.board
    if not board.holes:
        return None
    deep = min(thread(plan, MM * (y - board.lens[1])) for _, y in board.holes)
    lid, size = plan.pocket.lid, _screw(MM * board.hole)
    grip = MM * (board.thickness if lid is None else lid.grip)
    length = longest_sold(grip + deep)
    number = plan.ring.count * len(board.holes)
    if length - grip < _LEAST_GRIP * size:  # no length that is sold holds: cut one to length
        length = math.floor(10 * (grip + deep)) / 10
        return number, f"M{size:g} screw, cut to {length:.1f} mm"
    return number, f"M{size:g} × {length:g} mm screw"


def _turned(part: Manifold, yaw: float) -> Manifold:
    """Return a part turned about z by an angle in degrees."""
    return part.rotate((0.0, 0.0, yaw)) if yaw else part


def _size(part: Manifold, yaw: float) -> Float[np.ndarray, " 3"]:
    """Return the dimensions (3,) mm of a part in its printing orientation."""
    box = _turned(part, yaw).bounding_box()
    size: np.ndarray = np.array(box[3:]) - np.array(box[:3])
    return size


def placed(
    robot: Robot,
    plan: PrintPlan,
    part: Manifold,
    yaw: float = 0.0,
    T_print_part: Float[np.ndarray, "4 4"] | None = None,
) -> Float[np.ndarray, "4 4"]:
    """Return T_link_print (4, 4), m, of the file of a part.

    It transforms a point of the file, whose millimetres are converted to metres, to the frame of
    the link that carries the ring.

    Args:
        robot: the robot.
        plan: the ring.
        part: the part, mm.
        yaw: angle by which the part is turned in its file, degrees.
        T_print_part: pose (4, 4) mm of the part in the print frame; None: it is stated in it.
    """
    ring, mount = plan.ring, robot.mount(plan.ring.link)
    T_ring_file, T = np.eye(4), np.eye(4) if T_print_part is None else T_print_part
    back = rotation_rpy(0.0, 0.0, math.radians(-yaw))
    T_ring_file[:3, :3] = plan.T_ring_print @ T[:3, :3] @ back
    origin = np.array(printing_origin(_turned(part, yaw)))
    T_ring_file[:3, 3] = (T_ring_file[:3, :3] @ origin + plan.T_ring_print @ T[:3, 3]) / MM
    T_link_file: np.ndarray = mount.T_link_ring(ring.position) @ T_ring_file
    return T_link_file


def _screw(hole: float) -> float:
    """Return the thickest screw, mm, that fits through a hole of a board; the hole itself if it is
    smaller than all screws."""
    return max(
        (size for size in (1.6, 2.0, 2.5, 3.0, 4.0, 5.0) if size <= hole + 1e-9), default=hole
    )


def _plain(link: str) -> str:
    """Return a link's name as part of a file name."""
    return "".join(c if c.isascii() and (c.isalnum() or c in "-_") else "_" for c in link)[:60]


def _plates(records: list[PrintedRing], data: Mapping[str, bytes], bed: Bed) -> dict[str, bytes]:
    """Return the plates of all parts and lids of rings, by name."""
    copies = {record.lids.file: record.lids.copies for record in records if record.lids}
    names = [file for record in records for file in record.T_link_print]
    return print_plates({file: data[file] for file in (*names, *copies)}, bed, copies)


Drawing = Callable[[PrintPlan, Assembly, PrintedRing], Mapping[str, bytes]]
"""Function that draws the pictures of a ring, by name."""


def ring_files(
    setup: Setup, scene: Scene, drawing: Drawing, printing: Printing | None = None
) -> tuple[PrintResult, dict[str, bytes]]:
    """Return the printed rings of ``setup``: their records, and all files by name.

    The files are the STL files and the pictures of each ring, the plates, and ``printing.json``.

    Args:
        setup: the setup.
        scene: the scene.
        drawing: draws the pictures.
        printing: replaces the scene's printing parameters.

    Raises:
        UserError: if a ring cannot be built; the message names the ring, the reason and the largest
            count that fits.
    """
    records, data = list[PrintedRing](), dict[str, bytes]()
    for number, ring in enumerate(setup.rings):
        try:
            record, files, plan, made = print_ring(scene, number, ring, printing)
        except UnbuildableError as error:
            raise UserError(f"ring {number} ({ring.link}): {error}") from error
        records.append(record)
        names = [*record.T_link_print, *([record.lids.file] if record.lids else [])]
        data |= dict(zip(names, files, strict=True))
        data |= drawing(plan, made, record)
    bed = (printing or scene.printing).bed
    plates = _plates(records, data, bed)
    data |= plates
    result = PrintResult(rings=records, assembled=ASSEMBLED, mounted=MOUNTED, plates=[*plates])
    data["printing.json"] = (result.model_dump_json(indent=2) + "\n").encode()
    return result, data
