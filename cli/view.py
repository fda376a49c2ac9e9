"""The command view: a setup in a browser."""

import os
import sys
import threading
import webbrowser
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from ..coverage.rings.ring import Setup
from ..coverage.soft.sampling import EmptySolidError
from ..formats.errors import UserError
from ..formats.loader import resolve
from ..formats.writing import output_folder
from ..objectives.scene import Scene
from ..reporting.terminal import Terminal, say
from .app import Subject, app
from .option_groups import AS_IT_IS, SubjectOptions
from .options import urdf_of

_PATIENCE = 0.5  # s, for the server to take leave of its pages


@app.command
def view(
    subject: Subject,
    /,
    *,
    compare: Annotated[
        str | None, Parameter(help="Another proposal or name, beside the first and in its scene.")
    ] = None,
    given: SubjectOptions = AS_IT_IS,
    urdf: Annotated[
        Path | None, Parameter(help="Show the robot's surface as this URDF's meshes have it.")
    ] = None,
    packages: Annotated[
        tuple[Path, ...], Parameter(negative=(), help="Folders with the meshes of --urdf.")
    ] = (),
    out: Annotated[
        Path | None, Parameter(help="Folder in which the page may save proposals and pictures.")
    ] = None,
    host: Annotated[
        str, Parameter(help="Address to serve at: this machine only, unless you say another.")
    ] = "127.0.0.1",
    port: Annotated[
        int, Parameter(validator=Number(gte=0, lte=65535), help="0: any that is free.")
    ] = 0,
    browser: Annotated[
        bool, Parameter(negative="--no-browser", help="Open the page in a browser.")
    ] = True,
) -> None:
    """Show a setup in a browser: robot, rings, cones, what is seen and what is not; change it,
    count it, search on from it.

    Example: place-rings view n3_16_55

    Example: place-rings view place-rings-out/proposal.toml --compare n3_16_55 --out mine
    """
    setup, asked = given.resolve(subject)
    setups = {subject: setup}
    if compare is not None:
        setups[compare if compare != subject else f"{compare} (again)"] = resolve(compare, asked)[0]
    urdf = urdf or urdf_of(given.place.robot)
    run(asked, setups, urdf, packages, out, host, port, browser)


def run(
    scene: Scene,
    setups: dict[str, Setup],
    urdf: Path | None,
    packages: tuple[Path, ...],
    out: Path | None,
    host: str,
    port: int,
    browser: bool,
) -> None:
    """Serve the page until Ctrl-C."""
    from ..viewer.robot_surface import read_skin
    from ..viewer.server import LOOPBACK, Server
    from ..viewer.session import ViewerSession
    from .scene_checks import check_scene, check_sight

    check_scene(scene, 0.01)
    for setup in setups.values():
        check_sight(scene, setup)
    body = read_skin(urdf, packages, scene.robot) if urdf is not None else None
    folder = None if out is None else output_folder(out)
    console = Terminal(stderr=True)
    with console.status("drawing points"):
        room = ViewerSession(scene, setups, folder, body)
        try:
            for t in room.targets:
                room.glance.zeta(next(iter(room.setups.values())), t, scene.occlusion)
        except EmptySolidError as error:
            raise UserError(f"--target: {error}") from error
    server = Server(room, host, port)
    if host not in (LOOPBACK, "localhost", "::1"):
        console.print(
            f"Careful: whoever reaches {host} can use this page; it has no password.",
            highlight=False,
        )
    say(f"{server.url}  (Ctrl-C ends it)")
    try:
        if browser:
            webbrowser.open(server.url)
        threading.Event().wait()
    except KeyboardInterrupt:
        pass
    finally:
        ending = threading.Thread(target=server.close, daemon=True)
        ending.start()
        ending.join(_PATIENCE)
        console.print("closed")
        sys.stdout.flush()
        # what is still at work has nothing to keep: a proposal is written whole or not at all
        os._exit(0)
