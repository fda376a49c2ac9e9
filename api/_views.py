"""The viewer, a page in a browser."""

import sys
import threading
import webbrowser
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from ._errors import InputError, input_errors, writable
from ._scene import Scene
from ._validation import SetupLike, check_scene, resolve_setup
from .coverage.soft.sampling import EmptySolidError
from .objectives.scene import Scene as CoreScene

if TYPE_CHECKING:
    from .viewer.server import Server

LOOPBACK = "127.0.0.1"


class View:
    """A running viewer. Use it as a context manager, or call ``close``."""

    def __init__(self, server: "Server") -> None:
        self._server = server
        self.url = server.url
        """Address of the page with its token, for a browser on this machine."""

    def wait(self) -> None:
        """Serve until Ctrl-C, then close."""
        try:
            threading.Event().wait()
        except KeyboardInterrupt:
            pass
        finally:
            self.close()

    def close(self) -> None:
        """Stop the viewer."""
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
    package: Mapping[str, str | Path] | None = None,
    host: str = LOOPBACK,
    port: int = 0,
    browser: bool = True,
    wait: bool | None = None,
) -> View:
    """Show a setup in a browser: robot, rings, beams, covered and uncovered points.

    Args:
        setup, scene: as in ``verify``.
        compare: a second setup to show beside the first, in the same scene.
        folder: folder in which the page may save proposals and pictures; None disables saving.
        urdf: URDF whose meshes show the robot's surface.
        packages: folders with the meshes of that URDF.
        package: folders of its packages by the packages' names, where the folders have others.
        host: address of the server; by default only this machine can connect. The page opens at
            its whole address only, whose last part is a random token.
        port: port of the server; 0 for any free port.
        browser: whether to open the page in the browser.
        wait: whether to serve until Ctrl-C before returning. The default is True in a script, and
            False in a notebook or at a prompt.

    Returns:
        The running viewer; ``close`` stops it.

    Raises:
        InputError: for a setup that does not fit the scene, or a port that is in use.

    Example:
        >>> import place_rings as pr
        >>> with pr.view("n1_8_0", browser=False, wait=False) as page:
        ...     print(page.url.startswith("http://127.0.0.1:"))
        True
    """
    from .formats.robots.urdf_options import UrdfOptions
    from .viewer.robot_surface import read_skin
    from .viewer.server import Server
    from .viewer.session import ViewerSession

    name, placed, core = resolve_setup(setup, scene)
    setups = {name: placed}
    if compare is not None:
        other, second, _ = resolve_setup(compare, core)
        setups[other if other != name else f"{other} (again)"] = second
    check_scene(core, 0.01)
    with input_errors():
        surface = (
            None
            if urdf is None
            else read_skin(
                Path(urdf), UrdfOptions(packages=packages, package=package or {}), core.robot
            )
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
    """Return whether Python runs at a prompt or in a notebook."""
    return hasattr(sys, "ps1") or "ipykernel" in sys.modules
