"""Files that a page writes: proposals, and pictures of its view."""

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import viser

from ..coverage.definitions.errors import UserError
from ..coverage.rings.ring import Setup
from ..formats.writing import output_files, write_bytes
from ..objectives.feasibility.mounting import Fault
from ..objectives.scene import Scene
from ..reporting.text import with_error
from .controls import Controls
from .html import UNBUILDABLE
from .long_task import Job, LongTask
from .saving import file_named, save
from .snapshot import view_picture
from .tasks import prove

_LONGEST_NAME = 60  # characters of a downloaded file's name
_MOST_PIXELS = 3840 * 2160  # of a picture; a larger one may be too long for a message
_LONGEST = 30.0  # s, timeout for a picture from the browser


class PageFiles:
    """Writes the files of one page into the folder that was given at the start, if any."""

    def __init__(
        self, client: viser.ClientHandle, out: Path | None, controls: Controls, work: LongTask
    ) -> None:
        self._client, self._out, self._controls, self._work = client, out, controls, work

    def _path(self, name: str, ending: str = ".toml") -> Path:
        return file_named(self._out, name, bool(self._controls.replace.value), ending)

    def save(
        self,
        setup: Setup,
        scene: Scene,
        saved: Callable[[str], None],
        broken: Callable[[], Sequence[Fault]],
    ) -> None:
        """Start a job that counts a setup and saves it as a proposal.

        Args:
            setup: setup to save.
            scene: its scene.
            saved: receives the name of the written file, without its ending.
            broken: returns the rules that the setup violates; the page and the file name them.

        Raises:
            UserError: see ``file_named``.
            ValueError: if a job of the page is running.
        """
        path = self._path(self._controls.name.value)

        def work(job: Job) -> None:
            proofs = prove(scene, setup, tuple(goal.target for goal in scene.targets), job.tell)
            faults = broken()
            save(self._path(path.stem), setup, scene, [p.counted for p in proofs], faults)
            saved(path.stem)
            values = ", ".join(
                f"{p.counted.target} {with_error(100 * p.counted.zeta, p.counted.error)} %"
                for p in proofs
            )
            text = f"saved as {path.name}: {values}, counted"
            if faults:
                text += f". {UNBUILDABLE}: {'; '.join(fault.text for fault in faults)}"
            self._work.note(text, bool(faults))

        self._work.start(work)

    def picture(self, name: str, title: str, line: str) -> None:
        """Send a picture of the view to the browser, and save it where there is a folder.

        Args:
            name: what the picture shows; the downloaded file is named after it.
            title: title of the picture.
            line: coverage of the targets.

        Raises:
            UserError: if the browser sends no view, or see ``file_named``.
        """
        camera = self._client.camera
        size = (camera.image_height or 800, camera.image_width or 1200)
        scale = min(1.0, (_MOST_PIXELS / (size[0] * size[1])) ** 0.5)
        size = (max(1, int(scale * size[0])), max(1, int(scale * size[1])))
        try:
            view = self._client.get_render(*size, transport_format="png", timeout=_LONGEST)
        except (RuntimeError, TimeoutError) as error:
            raise UserError("picture: the browser sent none; try again") from error
        data = view_picture(view, title, line)
        if self._out is not None:
            path = self._path(self._controls.name.value, ".png")
            with output_files(path.parent, path.name) as new:
                write_bytes(new / path.name, data)
            self._work.note(f"saved as {path.name}")
        slug = re.sub(r"[^A-Za-z0-9_.]+", "-", name).strip("-.")[:_LONGEST_NAME] or "place-rings"
        self._client.send_file_download(f"{slug}.png", data, save_immediately=True)
