"""The page in a browser."""

import sys
import threading
import webbrowser
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from ._errors import InputError, input_errors, writable
from ._scene import Scene
from ._validation import SetupLike, check_scene, check_sight, resolve_setup
from .coverage.soft.sampling import EmptySolidError
from .objectives.scene import Scene as CoreScene

if TYPE_CHECKING:
    from .viewer.server import Server

LOOPBACK = "127.0.0.1"


class View:
    """A page that is served until ``close``; a context closes it at its end.

    url: what to open in a browser on this machine.
    """

    def __init__(self, server: "Server") -> None:
        self._server = server
        self.url = server.url

    def wait(self) -> None:
        """Serve until Ctrl-C, then close."""
        try:
            threading.Event().wait()
        except KeyboardInterrupt:
            pass
        finally:
            self.close()

    def close(self) -> None:
        """Stop to serve."""
        self._server.close()

    def __enter__(self) -> "View":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<View at {self.url}>"

    def _repr_html_(self) -> str:
        return f'<a href="{escape(self.url)}" target="_blank">{escape(self.url)}</a>'


def view(
    setup: SetupLike,
    scene: Scene | CoreScene | None = None,
    *,
    compare: SetupLike | None = None,
    folder: str | Path | None = None,
    urdf: str | Path | None = None,
    packages: Sequence[str | Path] = (),
    host: str = LOOPBACK,
    port: int = 0,
    browser: bool = True,
    wait: bool | None = None,
) -> View:
    """Show a setup in a browser: robot, rings, beams, what is covered and what is not.

    Args:
        setup, scene: as for ``verify``.
        compare: another setup beside the first, in its scene.
        folder: in which the page may save proposals and pictures.
        urdf, packages: show the robot's surface as this URDF's meshes have it.
        host: address to serve at; by default this machine only. The page has no password.
        port: 0 for any that is free.
        browser: open the page.
        wait: serve until Ctrl-C before returning; by default in a script, not in a notebook or at
            a prompt.

    Returns:
        The page; ``close`` ends it.

    Raises:
        InputError: for a setup that does not fit the scene, or a port that is taken.

    Example:
        >>> import place_rings as pr
        >>> with pr.view("n1_8_0", browser=False, wait=False) as page:
        ...     print(page.url.startswith("http://127.0.0.1:"))
        True
    """
    from .viewer.robot_surface import read_skin
    from .viewer.server import Server
    from .viewer.session import ViewerSession

    name, placed, core = resolve_setup(setup, scene)
    setups = {name: placed}
    if compare is not None:
        other, second, _ = resolve_setup(compare, core)
        setups[other if other != name else f"{other} (again)"] = second
    check_scene(core, 0.01)
    check_sight(core)
    with input_errors():
        surface = (
            None
            if urdf is None
            else read_skin(Path(urdf), tuple(Path(p) for p in packages), core.robot)
        )
        session = ViewerSession(core, setups, None if folder is None else writable(folder), surface)
        try:
            for target in session.targets:
                session.glance.zeta(placed, target, core.occlusion)
        except EmptySolidError as error:
            raise InputError(str(error), "target") from error
        page = View(Server(session, host, port))
    if browser:
        webbrowser.open(page.url)
    if (not _interactive()) if wait is None else wait:
        page.wait()
    return page


def _interactive() -> bool:
    """At a prompt or in a notebook?"""
    return hasattr(sys, "ps1") or "ipykernel" in sys.modules
