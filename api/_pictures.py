"""Pictures of a setup."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from ._errors import input_errors
from .formats.writing import write_bytes


@dataclass(frozen=True, repr=False)
class Picture:
    """A picture, which a notebook displays."""

    png: bytes
    """Content of a PNG file."""
    path: Path | None = None
    """Path of the file, None if the picture was not written."""

    def _repr_png_(self) -> bytes:
        return self.png

    def __repr__(self) -> str:
        where = "" if self.path is None else f" at {self.path}"
        return f"<Picture of {len(self.png):,} bytes{where}>"


def drawn(draw: Callable[[Path], None], path: str | Path | None) -> Picture:
    """Return the picture that ``draw`` writes as a PNG file to the path it receives.

    Args:
        draw: draws the picture.
        path: path of a PNG file to write as well, or None.

    Raises:
        InputError: if the file cannot be written.
    """
    with input_errors(), TemporaryDirectory() as folder:
        file = Path(folder) / "picture.png"
        draw(file)
        png = file.read_bytes()
        if path is not None:
            write_bytes(Path(path), png)
    return Picture(png, None if path is None else Path(path))
