"""A headless Chromium at the viewer's page: what a person reads there, and does."""

import re
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
_ARGUMENTS = (
    *("--no-sandbox", "--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader"),
    *("--enable-unsafe-swiftshader", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync", "--no-first-run"),
)
PATIENCE = 180.0  # s, on a busy machine


def needs_chromium() -> pytest.MarkDecorator:
    """Skip without a browser or what drives it."""
    try:
        import playwright.sync_api  # noqa: F401
    except ImportError:
        return pytest.mark.skip(reason="playwright is not installed (the [test] extra)")
    return pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium on this machine")


def until(what: Callable[[], object], why: str, seconds: float = PATIENCE) -> None:
    """Wait until something holds; fail with ``why`` where it does not."""
    end = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < end, why
        time.sleep(0.05)


class Reader:
    """A person at one page. requested: every address that the page asked for."""

    def __init__(
        self,
        browser,
        url: str,
        size: tuple[int, int] = (700, 420),
        scale: float = 0.2,
        state: str = "visible",
    ) -> None:
        """Open the page. ``scale``: pixels drawn for one of the page's, few, as they are drawn by
        the processor. ``state``: of its table of coverage that is waited for.
        """
        self.context = browser.new_context(
            viewport={"width": size[0], "height": size[1]},
            device_scale_factor=scale,
            accept_downloads=True,
        )
        self.page, self.requested, self.alarms = self.context.new_page(), [], []
        self.page.set_default_timeout(1000 * PATIENCE)
        self.page.on("request", lambda r: self.requested.append(r.url))
        self.page.on("websocket", lambda w: self.requested.append(w.url))
        self.page.on("dialog", lambda d: (self.alarms.append(d.message), d.dismiss()))
        self.page.goto(url)
        self.page.get_by_text("ζ in %").first.wait_for(state=state, timeout=1000 * PATIENCE)

    def zeta(self, target: str, column: int = -1) -> float:
        """What the table says of a target, by default in its last column, percent."""
        row = self.page.locator("tr", has=self.page.get_by_text(target, exact=True)).first
        return float(row.locator("td").nth(column).inner_text())

    def _row(self, label: str):
        named = self.page.locator("label", has_text=re.compile(f"^{re.escape(label)}$")).first
        return named.locator("xpath=ancestor::div[.//input][1]")

    def enter(self, label: str, value: str) -> None:
        """Type a number beside a slider, or a text."""
        box = self._row(label).locator("input[type=text], input:not([type])").first
        box.fill(value)
        box.press("Enter")

    def tab(self, name: str) -> None:
        """Open a tab of the panel."""
        self.page.get_by_role("tab", name=name, exact=True).or_(
            self.page.get_by_text(name, exact=True)
        ).first.click()

    def press(self, label: str) -> None:
        """Press a button."""
        self.page.get_by_role("button", name=label, exact=True).first.click()

    def close(self) -> None:
        self.context.close()


@contextmanager
def chromium() -> Iterator:
    """A browser."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=list(_ARGUMENTS))
        try:
            yield browser
        finally:
            browser.close()
