"""Long tasks of a page: the count, unseen spheres, the search, saving, and pictures."""

import io
import re
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import viser
from jaxtyping import UInt8
from PIL import Image, ImageDraw, ImageFont

from ..coverage.definitions.errors import UserError, shown
from ..coverage.definitions.escaping import printable
from ..coverage.rings.ring import Setup
from ..formats.schema.proposal_models import ProposalFile
from ..formats.writing import output_files, to_toml, write_bytes, write_text
from ..objectives.feasibility.mounting import Fault
from ..objectives.feasibility.violations import of_mount
from ..objectives.scene import Scene
from ..objectives.verified import Verified
from ..reporting.text import with_error
from . import html as words
from .colours import KINDS
from .controls import Controls
from .html import UNBUILDABLE
from .long_task import Job, LongTask
from .page_drawing import PageDrawing
from .page_state import PageState, Version
from .session import ViewerSession
from .tasks import prove, search_from
from .unseen_spheres import unseen_spheres

_LONGEST_NAME = 60  # characters of a downloaded file's name
_MOST_PIXELS = 3840 * 2160  # of a picture; a larger one may be too long for a message
_LONGEST = 30.0  # s, timeout for a picture from the browser
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}")
_HEADING = """A placement of sensor rings, saved from place-rings view. Edit it freely, then check \
it again:
  place-rings verify {name}.toml
Positions run from 0 (proximal) to 1 (distal) along a link's mount axis; a tilt is positive \
towards distal."""


class PageTasks:
    """Starts the long tasks of one page on its active setup, and writes its files into the folder
    that was given at the start, if any."""

    def __init__(
        self,
        client: viser.ClientHandle,
        state: PageState,
        room: ViewerSession,
        controls: Controls,
        work: LongTask,
        drawing: PageDrawing,
    ) -> None:
        """Take over the parts of the page that tasks use.

        Args:
            client: the browser.
            state: the page's state.
            room: what all pages share.
            controls: of the page.
            work: runs one task at a time.
            drawing: shows the last count, and the newest state.
        """
        self._client, self._state, self._room, self._controls = client, state, room, controls
        self._work, self._drawing = work, drawing

    def _subject(self) -> tuple[int, Version, Scene]:
        with self._state.held() as state:
            scene = replace(self._room.scene, occlusion=state.choice.occlusion)
            return state.active, state.history.now, scene

    def _path(self, name: str, ending: str = ".toml") -> Path:
        return file_named(self._room.out, name, bool(self._controls.replace.value), ending)

    def prove(self) -> None:
        """Start a count and a proof of the active setup's ζ, to show on the page."""
        _, now, scene = self._subject()

        def work(job: Job) -> None:
            proofs = prove(scene, now.setup, self._room.targets, job.tell)
            table = words.proof_table(f"{now.name}, {now.setup.sensors} sensors", proofs)
            self._drawing.proof = now.setup, scene.occlusion, table
            self._drawing.show()
            _, later, under = self._subject()
            same = (later.setup, under.occlusion) == (now.setup, scene.occlusion)
            self._work.note(
                f"counted in {sum(p.counted.seconds + p.certified.seconds for p in proofs):.1f}"
                f" s{'' if same else '; the setup has changed since'}"
            )

        self._work.start(work)

    def spheres(self) -> None:
        """Start to find the largest unseen sphere about each place, for what the page shows of the
        active setup."""
        _, now, scene = self._subject()
        with self._state.held() as state:
            choice = state.choice

        def work(job: Job) -> None:
            began = time.perf_counter()
            spheres = unseen_spheres(scene, now.setup, choice, job.tell)
            self._drawing.spheres = spheres
            self._drawing.show()
            _, later, _ = self._subject()
            with self._state.held() as state:
                same = spheres.of(later.setup, state.choice)
            self._work.note(
                f"found in {time.perf_counter() - began:.1f} s"
                f"{'' if same else '; the page shows something else since'}"
            )

        self._work.start(work)

    def search(self) -> None:
        """Start a search from the active setup; its result is adopted if it is better."""
        i, now, scene = self._subject()
        target = self._state.targets.get(str(self._controls.aim.value))
        free = bool(self._controls.free.value)

        def work(job: Job) -> None:
            best = search_from(scene, now.setup, job.note, lambda: job.stopped, target, free)
            change = f"{100 * best.before:.2f} → {100 * best.after:.2f} %, counted; {best.outcome}"
            if not best.better:
                self._work.note(f"the search found nothing better: {change}")
                return
            with self._state.held() as state:
                state.searched(i, best.setup)
            self._drawing.show()
            self._work.note(f"better: {change}")

        self._work.start(work)

    def save(self) -> None:
        """Start to count the active setup and to save it as a proposal.

        Raises:
            UserError: see ``file_named``.
            ValueError: if a job of the page is running.
        """
        i, now, scene = self._subject()
        setup, path = now.setup, self._path(self._controls.name.value)

        def work(job: Job) -> None:
            proofs = prove(scene, setup, tuple(goal.target for goal in scene.targets), job.tell)
            faults = self._room.broken(setup, scene.occlusion)
            save(self._path(path.stem), setup, scene, [p.counted for p in proofs], faults)
            with self._state.held() as state:
                state.histories[i].saved(setup, path.stem)
            self._drawing.show()
            values = ", ".join(
                f"{p.counted.target} {with_error(100 * p.counted.zeta, p.counted.error)} %"
                for p in proofs
            )
            text = f"saved as {path.name}: {values}, counted"
            if faults:
                text += f". {UNBUILDABLE}: {'; '.join(fault.text for fault in faults)}"
            self._work.note(text, bool(faults))

        self._work.start(work)

    def picture(self) -> None:
        """Send a picture of the view to the browser, and save it where there is a folder.

        Raises:
            UserError: if the browser sends no view, or see ``file_named``.
        """
        _, now, scene = self._subject()
        zetas = [
            f"{t} {100 * self._room.glance.zeta(now.setup, t, scene.occlusion):.1f} %"
            for t in self._room.targets
        ]
        camera = self._client.camera
        size = (camera.image_height or 800, camera.image_width or 1200)
        scale = min(1.0, (_MOST_PIXELS / (size[0] * size[1])) ** 0.5)
        size = (max(1, int(scale * size[0])), max(1, int(scale * size[1])))
        try:
            view = self._client.get_render(*size, transport_format="png", timeout=_LONGEST)
        except (RuntimeError, TimeoutError) as error:
            raise UserError("picture: the browser sent none; try again") from error
        title = f"{printable(now.name)}: {now.setup.sensors} sensors"
        data = view_picture(view, title, "   ".join(zetas))
        if self._room.out is not None:
            path = self._path(self._controls.name.value, ".png")
            with output_files(path.parent, path.name) as new:
                write_bytes(new / path.name, data)
            self._work.note(f"saved as {path.name}")
        slug = re.sub(r"[^A-Za-z0-9_.]+", "-", now.name).strip("-.")[:_LONGEST_NAME]
        file = f"{slug or 'place-rings'}.png"
        self._client.send_file_download(file, data, save_immediately=True)


def file_named(folder: Path | None, name: str, replace: bool, ending: str = ".toml") -> Path:
    """Return the path of a file in ``folder``.

    Args:
        folder: folder of ``--out``, or None.
        name: name without ending.
        replace: whether an existing file may be replaced.
        ending: ending of the name.

    Raises:
        UserError: if there is no folder, the name is invalid, or a file exists that must not be
            replaced.
    """
    if folder is None:
        raise UserError("saving needs a folder: start the viewer with --out FOLDER")
    if not _NAME.fullmatch(name):
        raise UserError(f"name: found {shown(name)}, allowed: at most 64 letters, digits, - and _")
    path = folder / f"{name}{ending}"
    if path.is_symlink() or (path.exists() and not path.is_file()):
        raise UserError(f"name: {path.name} exists and is no regular file; choose another name")
    if path.exists() and not replace:
        raise UserError(f"name: {path.name} exists; choose another name, or allow to replace it")
    return path


def save(
    path: Path,
    setup: Setup,
    scene: Scene,
    counted: Sequence[Verified],
    broken: Sequence[Fault] = (),
) -> None:
    """Write a setup as a proposal for ``scene`` with the counted coverage.

    Args:
        path: file to write.
        setup: setup to save.
        scene: its scene.
        counted: counts of the setup.
        broken: rules that it violates, which the file states.

    Raises:
        UserError: if the file cannot be written; an existing file stays unchanged.
    """
    mounting = of_mount(scene, broken)
    zeta = [one.in_scene(path.stem, scene).with_mounting(mounting) for one in counted]
    heading = [_HEADING.format(name=path.stem)]
    heading += [f"{UNBUILDABLE}:", *(f"  {printable(f.text)}" for f in broken)] * bool(broken)
    text = to_toml(ProposalFile.of(setup, scene, zeta=zeta), "\n".join(heading))
    with output_files(path.parent, path.name) as new:
        write_text(new / path.name, text)


_STRIP, _MARGIN, _SIZE = 84, 16, 20  # pixels


def view_picture(view: UInt8[np.ndarray, "H W 4"], title: str, line: str) -> bytes:
    """Return a PNG of a view with title, coverage and legend.

    Args:
        view: pixels with opacity.
        title: title.
        line: coverage of the targets.
    """
    seen = Image.fromarray(view, "RGBA")
    sheet = Image.new("RGB", (seen.width, seen.height + _STRIP), "white")
    sheet.paste(seen, (0, 0), seen)
    pen, large = ImageDraw.Draw(sheet), ImageFont.load_default(_SIZE)
    pen.text((_MARGIN, seen.height + 6), f"{title}    {line}", fill="#23272b", font=large)
    x = _MARGIN
    for kind in KINDS:
        words = kind.words.split(":")[0]
        pen.ellipse((x, seen.height + 49, x + 12, seen.height + 61), fill=kind.colour)
        pen.text((x + 18, seen.height + 44), words, fill="#666d75", font=ImageFont.load_default(16))
        x += 42 + int(pen.textlength(words, font=ImageFont.load_default(16)))
    data = io.BytesIO()
    sheet.save(data, "PNG", optimize=True)
    return data.getvalue()
