"""Long tasks of a page: the count, the search, saving, and pictures."""

from collections.abc import Callable
from dataclasses import replace

from ..coverage.definitions.escaping import printable
from ..coverage.occlusion.occlusion_mode import Occlusion
from ..coverage.rings.ring import Setup
from ..objectives.scene import Scene
from . import html as words
from .controls import Controls
from .long_task import Job, LongTask
from .page_drawing import PageDrawing
from .page_files import PageFiles
from .page_state import GuardedState
from .session import ViewerSession
from .tasks import SearchAnswer, prove, search_from


class PageTasks:
    """Starts the long tasks of one page on its active setup."""

    def __init__(
        self,
        guarded: GuardedState,
        room: ViewerSession,
        controls: Controls,
        work: LongTask,
        files: PageFiles,
        drawing: PageDrawing,
        show: Callable[[], None],
    ) -> None:
        """Take over the parts of the page that tasks use.

        Args:
            guarded: the page's state.
            room: what all pages share.
            controls: of the page.
            work: runs one task at a time.
            files: writes files.
            drawing: shows the last count.
            show: shows the newest state.
        """
        self._guarded, self._room, self._controls = guarded, room, controls
        self._work, self._files, self._drawing, self._show = work, files, drawing, show

    def _subject(self) -> tuple[int, Setup, Scene]:
        with self._guarded.held() as state:
            scene = replace(self._room.scene, occlusion=state.choice.occlusion)
            return state.active, state.history.now.setup, scene

    def prove(self) -> None:
        """Start a count and a proof of the active setup's ζ, to show on the page."""
        i, setup, scene = self._subject()
        with self._guarded.held() as state:
            name = state.names[i]

        def work(job: Job) -> None:
            proofs = prove(scene, setup, self._room.targets, job.tell)
            told = words.proof_table(f"{name}, {setup.sensors} sensors", proofs)
            occlusion: Occlusion = scene.occlusion
            self._drawing.proof = setup, occlusion, told
            self._show()
            _, now, under = self._subject()
            changed = (
                ""
                if (now, under.occlusion) == (setup, scene.occlusion)
                else "; the setup has changed since"
            )
            self._work.note(
                f"counted in {sum(p.counted.seconds + p.certified.seconds for p in proofs):.1f}"
                f" s{changed}"
            )

        self._work.start(work)

    def search(self) -> None:
        """Start a search from the active setup."""
        i, setup, scene = self._subject()
        with self._guarded.held() as state:
            target = state.targets.get(str(self._controls.aim.value))
        free = bool(self._controls.free.value)

        def work(job: Job) -> None:
            found = search_from(scene, setup, job.note, lambda: job.stopped, target, free)
            self._adopt(i, found)

        self._work.start(work)

    def _adopt(self, i: int, found: SearchAnswer) -> None:
        """Apply the result of a search if it is better."""
        change = f"{100 * found.before:.2f} → {100 * found.after:.2f} %, counted; {found.outcome}"
        if not found.better:
            self._work.note(f"the search found nothing better: {change}")
            return
        with self._guarded.held() as state:
            state.searched(i, found.setup)
        self._show()
        self._work.note(f"better: {change}")

    def save(self) -> None:
        """Start to count the active setup and to save it as a proposal."""
        i, setup, scene = self._subject()

        def saved(name: str) -> None:
            with self._guarded.held() as state:
                state.histories[i].saved(setup, name)
            self._show()

        self._files.save(setup, scene, saved, lambda: self._room.broken(setup, scene.occlusion))

    def picture(self) -> None:
        """Send a picture of the view to the browser, and save it where there is a folder."""
        with self._guarded.held() as state:
            now, occlusion = state.history.now, state.choice.occlusion
        zetas = [
            f"{t} {100 * self._room.glance.zeta(now.setup, t, occlusion):.1f} %"
            for t in self._room.targets
        ]
        title = f"{printable(now.name)}: {now.setup.sensors} sensors"
        self._files.picture(now.name, title, "   ".join(zetas))
