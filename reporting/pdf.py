"""PDF of an HTML page, printed by a browser that is installed on the machine."""

import os
import shutil
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

from ..coverage.definitions.errors import UserError
from ..formats.writing import write_bytes

_BROWSERS = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
    "microsoft-edge",
    "msedge",
    "brave-browser",
)
_SECONDS = 120.0
_OPTIONS = (
    "--headless",
    "--disable-gpu",
    "--disable-extensions",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    "--no-pdf-header-footer",
)


def find_browser() -> str:
    """Return the path of a browser that prints PDF without a window.

    Raises:
        UserError: if none is on PATH.
    """
    for name in _BROWSERS:
        if (path := shutil.which(name)) is not None:
            return path
    raise UserError(
        "--pdf: found no browser on PATH, allowed: Chromium, Chrome, Edge or Brave; install one"
        " (for example apt install chromium), or print report.html from your own browser"
    )


def write_pdf(browser: str, page: Path, file: Path) -> None:
    """Print an HTML page to a PDF file, atomically.

    Args:
        browser: path of the browser, from ``find_browser``.
        page: the page.
        file: the PDF file to write.

    Raises:
        UserError: if the browser fails; an existing file stays unchanged.
    """
    # Chromium refuses its sandbox to root; the page runs no script and loads nothing
    root = ["--no-sandbox"] if hasattr(os, "geteuid") and os.geteuid() == 0 else []
    with TemporaryDirectory() as folder:
        made = Path(folder) / "page.pdf"
        words = [browser, *_OPTIONS, *root, f"--user-data-dir={folder}/profile"]
        words += [f"--print-to-pdf={made}", page.resolve().as_uri()]
        try:
            done = subprocess.run(words, capture_output=True, timeout=_SECONDS, check=False)
        except (OSError, subprocess.TimeoutExpired) as error:
            raise UserError(f"{file}: {browser} did not print the page: {error}") from error
        if done.returncode or not made.is_file():
            said = done.stderr.decode(errors="replace").strip().splitlines()
            reason = said[-1] if said else f"exit code {done.returncode}"
            raise UserError(f"{file}: {browser} did not print the page: {reason}")
        data = made.read_bytes()
    write_bytes(file, data)
