"""What viser leaves to the page: values of controls that only the page sets, texts as labels,
messages to a browser that leaves, its title and first look, and the address it was opened with.

A few constant lines of JavaScript run in the browser. Texts enter them as JSON strings only.
"""

import asyncio
import json
import secrets
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any
from urllib.parse import parse_qsl, urlsplit

import viser
from viser import _messages
from viser._gui_handles import GuiProgressBarHandle
from viser.infra._async_message_buffer import AsyncMessageBuffer

from ..coverage.definitions.escaping import printable


def set_value(
    control: viser.GuiInputHandle[Any] | GuiProgressBarHandle,
    value: str | float,
    nearly: float = 0.0,
) -> None:
    """Set the value that a control shows, soon. Nothing is called: the user did not change it.

    It is set in viser's own thread, where nothing comes between the moment when viser stores the
    user's value and the moment when the page reads it.

    Args:
        control: the control.
        value: its new value.
        nearly: a number that differs by no more than this stays as it is.
    """
    impl = control._impl
    value = type(impl.value)(value)
    interface = impl.gui_api._websock_interface

    def set_now() -> None:
        old = impl.value
        if old == value or (nearly and abs(old - value) <= nearly):
            return
        impl.value = value
        with closing():
            interface.queue_message(_messages.GuiUpdateMessage(impl.uuid, {"value": value}))

    with suppress(RuntimeError):  # the server has ended
        interface.get_message_buffer().event_loop.call_soon_threadsafe(set_now)


def labelled(names: Sequence[str]) -> dict[str, str]:
    """Return each name by its printable text; a later one with the same text gets its number,
    too.
    """
    found = dict[str, str]()
    for i, name in enumerate(names):
        label = printable(name)
        while label in found:
            label += f" ({i})"
        found[label] = name
    return found


@contextmanager
def closing() -> Iterator[None]:
    """Go on where the browser left meanwhile: viser warns of messages that come too late, and a
    warning may be an error.
    """
    try:
        yield
    except UserWarning as warning:
        if "closed connection" not in str(warning):
            raise


class WakeUp(asyncio.Event):
    """An event that only the thread of its event loop sets.

    An ``asyncio.Event`` is not made for several threads. Set from another thread while the loop is
    about to wait for it, it stays set while the loop sleeps, and no later ``set`` wakes the loop:
    the browser gets no message any more. viser sets it twice, in the caller's thread and then in
    the loop's. The second is enough.
    """

    def set(self) -> None:
        """Wake the loop; without effect in another thread."""
        try:
            asyncio.get_running_loop()
        except RuntimeError:
            return
        super().set()


def keep_awake(client: viser.ClientHandle) -> None:
    """Let no message to a client be left waiting for ever."""
    buffer = client._websock_connection.get_message_buffer()
    assert isinstance(buffer, AsyncMessageBuffer)
    old, buffer.message_event = buffer.message_event, WakeUp()

    def wake() -> None:
        old.clear()
        old.set()  # whoever waits for the old one goes on and waits for the new one
        buffer.message_event.set()

    buffer.event_loop.call_soon_threadsafe(wake)


_PATIENCE = 60.0  # s for the answer of a browser that may draw its first picture slowly
_PREFIX = "viser-user:"  # of the keys that viser reads from the browser's storage
_LONGEST = 20_000  # characters of an address

_FIRST_LOOK = """
const phone = document.querySelector(
  'div[style*="height: 3.5em"][style*="cursor: pointer"]');
if (phone && window.innerWidth < 600) phone.click();
const shown = new URL(window.location);
if (shown.searchParams.has('websocket')) {  // viser adds it to an address with a path
  shown.searchParams.delete('websocket');
  window.history.replaceState(null, '', shown);
}
const [opened] = performance.getEntriesByType('navigation');
localStorage.setItem(%s, JSON.stringify({
  address: new URL(opened ? opened.name : String(window.location)).search,
  dark: window.matchMedia('(prefers-color-scheme: dark)').matches,
}));
"""


class BrowserPage:
    """The browser's page of one client."""

    def __init__(self, client: viser.ClientHandle) -> None:
        self._client, self._title = client, ""

    def _run(self, source: str) -> None:
        self._client._websock_connection.queue_message(_messages.RunJavascriptMessage(source))

    def title(self, text: str) -> None:
        """Set the title of the page."""
        if text != self._title:
            self._title = text
            self._run(f"document.title = {_literal(text)};")

    def first_look(self) -> tuple[dict[str, str], bool]:
        """Collapse the panel on a phone, and read how the page was opened.

        Returns:
            The query of its address, and whether the browser prefers dark pages. A browser that
            does not answer has neither.
        """
        key = f"place-rings-{secrets.token_hex(8)}"
        self._run(_FIRST_LOOK % _literal(_PREFIX + key))
        try:
            answer = self._client.local_storage.get_item(key, timeout=_PATIENCE)
        except (RuntimeError, TimeoutError):
            return {}, False
        self._client.local_storage.remove_item(key)
        return read_answer(answer)


def read_answer(answer: str | None) -> tuple[dict[str, str], bool]:
    """Return the query of the page's address, and whether the browser prefers dark pages."""
    try:
        read = json.loads(answer or "{}")
        address, dark = str(read.get("address", ""))[:_LONGEST], read.get("dark") is True
        query = dict(parse_qsl(urlsplit(address).query, max_num_fields=100))
    except (ValueError, AttributeError):
        return {}, False
    return query, dark


def _literal(text: str) -> str:
    """Return a text as a JavaScript string."""
    return json.dumps(text).replace("</", "<\\/")
