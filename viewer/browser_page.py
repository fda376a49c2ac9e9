"""What viser leaves to the browser's page: its title, its first look, and the address it was opened
with.

A few constant lines of JavaScript run in the page. Texts enter them as JSON strings only.
"""

import json
import secrets
from urllib.parse import parse_qsl, urlsplit

import viser
from viser import _messages

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
