"""One thread of a page, for what must be done in order."""

from collections.abc import Callable, Coroutine
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from typing import Any

import viser
from viser._threadpool_exceptions import print_threadpool_errors


class Worker:
    """Does one thing after the other, in a thread of its own, until it is closed."""

    def __init__(self, name: str) -> None:
        """``name``: of the thread."""
        self._pool = ThreadPoolExecutor(1, thread_name_prefix=f"place-rings {name}")

    def do(self, act: Callable[..., object], *args: Any) -> None:
        """Call ``act`` with these arguments after all that came before; return at once.

        An exception is printed, and does not stop what comes later.
        """
        with suppress(RuntimeError):  # closed
            self._pool.submit(act, *args).add_done_callback(_report)

    def close(self) -> None:
        """Drop what has not begun, and take nothing any more."""
        self._pool.shutdown(wait=False, cancel_futures=True)


def _report(done: Future[object]) -> None:
    if not done.cancelled():
        print_threadpool_errors(done)


class UserActions(Worker):
    """Does what the user asks for on one page, one thing after the other.

    viser stores the user's value in the control, and calls back a little later in any of several
    threads. There a later change could overtake an earlier one, and the page could have set the
    control to what it knew before. So the value is read at once, in viser's own thread, and one
    thread acts.
    """

    def __init__(self) -> None:
        super().__init__("actions")

    def on(self, control: viser.GuiInputHandle[Any], act: Callable[[Any], None]) -> None:
        """Call ``act`` with each value to which the user, not the page, changes a control."""

        async def heard(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:
                self.do(act, control.value)

        control.on_update(heard)

    def press(self, button: Any, act: Callable[[], None]) -> None:
        """Call ``act`` when the user presses a button."""
        button.on_click(self._heard(act))

    def choose(self, buttons: Any, act: Callable[[str], None]) -> None:
        """Call ``act`` with the label of the button of a group that the user presses."""

        async def heard(_: Any) -> None:
            self.do(act, buttons.value)

        buttons.on_click(heard)

    def trigger(self, command: viser.CommandHandle, act: Callable[[], None]) -> None:
        """Call ``act`` when the user gives a command."""
        command.on_trigger(self._heard(act))

    def _heard(self, act: Callable[[], None]) -> Callable[[Any], Coroutine[Any, Any, None]]:
        async def heard(_: Any) -> None:
            self.do(act)

        return heard
