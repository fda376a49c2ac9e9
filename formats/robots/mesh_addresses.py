"""Addresses of meshes as URDFs write them, those of other machines and of Windows included."""

import itertools
import re
from pathlib import Path, PurePosixPath
from urllib.parse import unquote

_DRIVE = re.compile(r"/*([A-Za-z]:)/+")  # at the start of a Windows path
_MESHES = re.compile(r"mesh(es)?|visual|collision", re.IGNORECASE)  # folders within a package


def parsed(name: str) -> tuple[str, PurePosixPath]:
    """Return the scheme of a mesh's name, empty for a path, and its path with forward slashes."""
    scheme, colon, rest = name.partition("://")
    scheme = scheme.lower() if colon else scheme
    if name.startswith("file:/") and not colon:
        scheme, rest = "file", name.removeprefix("file:")
    elif not colon or len(scheme) == 1:  # a drive
        scheme, rest = "", name
    text = (unquote(rest) if scheme else rest).replace("\\", "/")
    if scheme in ("package", "model"):
        text = text.lstrip("/")
    if scheme == "file":
        text = text.removeprefix("localhost")
    if scheme in ("", "file"):
        text = re.sub(r"^/{2,}", "/", _DRIVE.sub(r"\1/", text, count=1))
    return scheme, PurePosixPath(text)


def is_absolute(path: PurePosixPath) -> bool:
    """Return whether a path begins at a root, of Windows included."""
    return path.is_absolute() or _DRIVE.match(f"{path}/") is not None


def package_in(wanted: PurePosixPath) -> str:
    """Return the part of an absolute address that is most likely the name of a package."""
    folders = wanted.parts[1:-1]
    if "share" in folders[:-1]:
        return folders[folders.index("share") + 1]
    inside = next((i for i, name in enumerate(folders) if _MESHES.fullmatch(name)), len(folders))
    return folders[inside - 1] if inside else "NAME"


def above_equal(real: Path, wanted: PurePosixPath) -> Path:
    """Return the folder of a file above the parts that its name and ``wanted`` share at the end."""
    shared = itertools.takewhile(
        lambda pair: pair[0] == pair[1],
        zip(reversed(real.parts), reversed(wanted.parts), strict=False),
    )
    return real.parents[max(len(list(shared)) - 1, 0)]
