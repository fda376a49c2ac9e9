"""Pictures of a setup."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ._errors import input_errors
from ._scene import Scene
from .coverage.rings.ring import Setup
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


def png_of(write: Any) -> bytes:
    """Return the content of the PNG file that ``write`` writes to the path it receives."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "picture.png"
        write(path)
        return path.read_bytes()


def picture(
    scene: Scene, setup: Setup, captions: Sequence[str], path: str | Path | None
) -> Picture:
    """Draw a setup.

    Args:
        scene: scene of the setup.
        setup: the rings.
        captions: title, one text for each target.
        path: path of a PNG file, or None to write none.

    Returns:
        The picture.

    Raises:
        InputError: if the file cannot be written.
    """
    from .reporting.placement_picture import placement_picture

    with input_errors():
        png = png_of(lambda file: placement_picture(file, scene.core, setup, captions))
        if path is not None:
            write_bytes(Path(path), png)
    return Picture(png, None if path is None else Path(path))
