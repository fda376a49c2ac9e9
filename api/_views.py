"""The viewer, a page in a browser."""

import sys
import threading
import webbrowser
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from ._arguments import refuse_without_urdf
from ._errors import InputError, input_errors, writable
from ._options import called_with
from ._validation import SetupCall, SetupLike, check_scene, resolve_setup
from .coverage.soft.sampling import EmptySolidError
from .viewer.options import ViewOptions

if TYPE_CHECKING:
    from .viewer.server import Server


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


@dataclass(frozen=True)
class ViewCall(ViewOptions, SetupCall):
    """A call of ``view``."""

    compare: SetupLike | None = field(default=None, kw_only=True)
    """A second setup to show beside the first, in the same scene."""
    folder: str | Path | None = field(default=None, kw_only=True)
    """Folder in which the page may save proposals and pictures; None disables saving."""
    urdf: str | Path | None = field(default=None, kw_only=True)
    """URDF, xacro or MJCF file whose meshes show the robot's surface, or its name in
    robot_descriptions."""
    packages: Sequence[str | Path] = field(default=(), kw_only=True)
    """Folders with the meshes of that URDF."""
    package: Mapping[str, str | Path] | None = field(default=None, kw_only=True)
    """Folders of its packages by the packages' names, where the folders have others."""
    xacro_args: Mapping[str, str] | None = field(default=None, kw_only=True)
    """Values of a xacro file's arguments by name."""
    wait: bool | None = field(default=None, kw_only=True)
    """Whether to serve until Ctrl-C before returning. The default is True in a script, and False in
    a notebook or at a prompt."""


@called_with(ViewCall)
def view(call: ViewCall) -> View:
    """Show a setup in a browser: robot, rings, beams, covered and uncovered points.

    Returns:
        The running viewer; ``close`` stops it.

    Raises:
        InputError: for a setup that does not fit the scene, a port that is in use, or
            ``packages``, ``package`` or ``xacro_args`` without ``urdf``.

    Example:
        >>> import place_rings as pr
        >>> with pr.view("n1_8_0", browser=False, wait=False) as page:
        ...     print(page.url.startswith("http://127.0.0.1:"))
        True
    """
    from .formats.robots.urdf_options import UrdfOptions
    from .viewer.server import Server
    from .viewer.session import ViewerSession
    from .viewer.triangle_meshes import read_skin

    refuse_without_urdf(call, "packages", "package", "xacro_args")
    name, placed, core = resolve_setup(call.setup, call.scene)
    setups = {name: placed}
    if call.compare is not None:
        other, second, _ = resolve_setup(call.compare, core)
        setups[other if other != name else f"{other} (again)"] = second
    check_scene(core, 0.01)
    with input_errors():
        surface = None
        if call.urdf is not None:
            reading = UrdfOptions(
                packages=call.packages, package=call.package or {}, xacro_args=call.xacro_args or {}
            )
            surface = read_skin(call.urdf, reading, core.robot)
        folder = None if call.folder is None else writable(call.folder)
        session = ViewerSession(core, setups, folder, surface)
        try:
            for target in session.targets:
                session.glance.zeta(placed, target, core.occlusion)
        except EmptySolidError as error:
            raise InputError(str(error), "target") from error
        page = View(Server(session, call.host, call.port))
    if call.browser:
        webbrowser.open(page.url)
    interactive = hasattr(sys, "ps1") or "ipykernel" in sys.modules
    if (not interactive) if call.wait is None else call.wait:
        page.wait()
    return page
