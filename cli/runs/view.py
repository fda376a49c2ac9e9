"""A setup in a browser: serve the page until Ctrl-C."""

import os
import sys
import threading
import webbrowser
from pathlib import Path

from ...coverage.rings.ring import Setup
from ...coverage.soft.sampling import EmptySolidError
from ...formats.errors import UserError
from ...formats.scene_checks import check_scene, check_sight
from ...formats.writing import output_folder
from ...objectives.scene import Scene
from ...reporting.terminal import Terminal, say
from ...viewer.robot_surface import read_skin
from ...viewer.server import LOOPBACK, Server
from ...viewer.session import ViewerSession

_PATIENCE = 0.5  # s, for the server to take leave of its pages


def view(
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
