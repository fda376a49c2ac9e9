"""Files that a URDF names: package:// addresses, file:// addresses and paths, in permitted folders
only."""

import itertools
import os
import shlex
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path, PurePosixPath

from ...coverage.definitions.errors import UserError, shown, unusable
from .mesh_addresses import above_equal, is_absolute, package_in, parsed
from .xml_text import bounded_bytes, plain_xml

_ABOVE = 4  # folders above a URDF, the last of which may be its package
_DEEP = 6  # levels of folders below --packages in which packages are searched
_MOST = 20_000  # folders that a search visits
_FILES = 50_000  # files of the own package that are considered
_LARGEST = 2**20  # bytes, largest package.xml
_SHOWN = 60  # most characters of a mesh's name in a message
_MODELS = ("urdf", "urdfs", "robot", "robots")  # folders of a package that hold its URDFs


class MissingFileError(UserError):
    """A mesh whose file does not exist in any folder in which it may lie."""


class Packages:
    """Finder of the files of one URDF.

    A file is found only if it lies, with symbolic links resolved, in one of the ``folders``, in the
    folder of a package in ``named``, in the URDF's folder, or in the URDF's own package. That is
    the nearest folder above the URDF that has a package.xml or the name of the address, or the
    parent of a folder called urdf or robots. Where the own package has another name than in the
    addresses, all of the ``addresses`` must lie in the same folder of it.

    Args:
        path: the URDF.
        folders: folders, chosen by the user, that are packages or hold packages.
        named: folders of packages by the packages' names.
        addresses: all names of meshes in the URDF.
    """

    def __init__(
        self,
        path: Path,
        folders: Sequence[Path] = (),
        named: Mapping[str, Path] | None = None,
        addresses: Sequence[str] = (),
    ) -> None:
        self.path, self.named = path, {n: f.resolve() for n, f in (named or {}).items()}
        for folder in folders:
            if not folder.is_dir():
                raise unusable("--packages", str(folder), "a folder")
        for name, folder in (named or {}).items():
            if not folder.is_dir():
                allowed = "NAME=FOLDER with an existing folder"
                raise unusable("--package", f"{name}={folder}", allowed)
        self.given = [folder.resolve() for folder in folders]
        self._stands_in = False  # whether a file was found by ``renamed``
        self._elsewhere: list[Path] = []  # folders of packages for addresses of other machines
        package = self._own_package()
        self._own = [] if package is None else [package]
        self.addresses = [
            wanted.parts
            for scheme, wanted in map(parsed, addresses)
            if scheme in ("package", "model")
        ]

    @cached_property
    def folders(self) -> list[Path]:
        """The folders in which files may lie, whatever package they name."""
        permitted = [self.path.resolve().parent, *self._own, *self.given, *self.named.values()]
        return list(dict.fromkeys(permitted))

    def _above(self) -> Iterator[Path]:
        """Yield the URDF's folder and those above it that may be its package: none of them a home
        folder or the root of a disk."""
        own = self.path.resolve().parent
        for up in (own, *own.parents)[: _ABOVE + 1]:
            if up.parent == up or up == Path(os.path.expanduser("~")).resolve():
                return
            yield up

    def _own_package(self) -> Path | None:
        above = list(self._above())
        for up in above:
            if (up / "package.xml").is_file():
                return up
        return above[1] if len(above) > 1 and above[0].name.lower() in _MODELS else None

    @cached_property
    def renamed(self) -> list[tuple[int, Path]]:
        """Folders of the own package in which all files of the addresses lie, each without the
        first few parts of its address; and how many those are."""
        addresses = self.addresses
        if not self._own or not addresses or any(".." in parts for parts in addresses):
            return []
        below = (Path(at, name) for at, _, names in os.walk(self._own[0]) for name in names)
        files = sorted(itertools.islice(below, _FILES))
        unique: dict[tuple[Path, ...], tuple[int, Path]] = {}
        for without in range(min(len(parts) for parts in addresses) - 1):
            tail = addresses[0][without:]
            for file in files:
                if file.parts[-len(tail) :] != tail:
                    continue
                top = file.parents[len(tail) - 1]
                places = tuple(top.joinpath(*parts[without:]) for parts in addresses)
                if all(place.is_file() for place in places):
                    unique.setdefault(places, (without, top))
        return list(unique.values())

    @property
    def notes(self) -> tuple[str, ...]:
        """A sentence about the folder that stands for other names in the addresses, and one about
        the packages that stand for absolute addresses, if any."""
        lines = []
        if self._stands_in:
            folder = self._as_given(self.renamed[0][1])
            lines.append(f"The meshes lie in {folder}, under other names.")
        if self._elsewhere:
            folders = ", ".join(self._as_given(f) for f in dict.fromkeys(self._elsewhere))
            lines.append(f"Absolute addresses of meshes lead nowhere here: taken from {folders}.")
        return tuple(lines)

    @cached_property
    def _described(self) -> dict[str, Path]:
        """Folders of packages, the own one and those below ``given``, by the names in their
        package.xml."""
        folders = {name: own for own in self._own if (name := _package_name(own))}
        visited = 0
        for top in self.given:
            for folder, inside, files in os.walk(top):
                visited += 1
                depth = len(Path(folder).relative_to(top).parts)
                if depth >= _DEEP or visited > _MOST:
                    inside.clear()
                inside.sort()
                if "package.xml" in files and (name := _package_name(Path(folder))):
                    folders.setdefault(name, Path(folder))
        return folders

    def find(self, name: str, link: str) -> Path:
        """Return the file of a mesh name.

        Raises:
            UserError: if it does not exist, or lies outside the permitted folders.
        """
        scheme, wanted = parsed(name)
        if scheme not in ("", "package", "file", "model"):
            raise self.fail(link, name, "package://, file:// or a path")
        if "\0" in str(wanted):
            raise self.fail(link, name, "a file's name")
        packaged = scheme in ("package", "model")
        outside = False
        for option, permitted in self._options(wanted, packaged):
            try:
                real = option.resolve()
                there = real.is_file()
            except (OSError, ValueError, RuntimeError):
                continue
            inside = any(real.is_relative_to(folder) for folder in permitted)
            if there and inside:
                self._stands_in |= permitted is self._own
                if not packaged and all(option != folder / wanted for folder in self.folders):
                    self._elsewhere.append(above_equal(real, wanted))
                return real
            # an absolute path that leads nowhere here is missing, not outside
            outside |= there or not (inside or is_absolute(wanted))
        given = ", ".join(dict.fromkeys(f.name or "/" for f in self.folders))
        where = f"a file in {given}" + ", or in a folder given by --packages" * (not self.given)
        where += "; this one is outside" * outside
        remedy = "" if outside and is_absolute(wanted) else self._remedy(wanted, packaged)
        fault = self.fail(link, name, where + remedy)
        raise (
            fault if outside else MissingFileError(f"{fault}; --skip-missing-meshes leaves it out")
        )

    def folder_of(self, package: str) -> Path | None:
        """Return the folder of a package, if it lies in the permitted folders."""
        for place, permitted in self._in_package(PurePosixPath(package)):
            real = place.resolve()
            if real.is_dir() and any(real.is_relative_to(folder) for folder in permitted):
                return real
        return None

    def _options(
        self, wanted: PurePosixPath, packaged: bool
    ) -> Iterator[tuple[Path, Sequence[Path]]]:
        """Yield the places where a file may lie, each with the folders that permit it."""
        if packaged:
            yield from self._in_package(wanted)
            if (renamed := self._renamed(wanted)) is not None:
                yield renamed, self._own
        elif not is_absolute(wanted):
            yield from ((folder / wanted, self.folders) for folder in self.folders)
            yield from self._on_other_machine(PurePosixPath("/", wanted))
        else:
            yield Path(wanted), self.folders
            yield from self._on_other_machine(wanted)

    def _in_package(self, wanted: PurePosixPath) -> Iterator[tuple[Path, Sequence[Path]]]:
        """Yield the places of a file whose address begins with the name of a package."""
        package, *inside = wanted.parts or ("",)
        if package in self.named:
            yield self.named[package].joinpath(*inside), self.folders
        for folder in self.folders:
            yield folder / wanted, self.folders
            for up in (folder, *folder.parents):
                if up.name == package:
                    yield up.joinpath(*inside), self.folders
        for up in self._above():
            if up.name == package:
                yield up.joinpath(*inside), [up]
        if package in self._described:
            yield self._described[package].joinpath(*inside), self.folders

    def _on_other_machine(self, wanted: PurePosixPath) -> Iterator[tuple[Path, Sequence[Path]]]:
        """Yield the places of a file whose absolute address was written on another machine, or
        begins with the name of one.

        The name of a package follows a folder ``share`` of an installation; or it is that of a
        package that the user gave, or of the own one.
        """
        parts = wanted.parts
        if ".." in parts:
            return
        installed = [i for i in range(2, len(parts) - 1) if parts[i - 1] == "share"]
        known = [i for i in range(1, len(parts) - 1) if parts[i] in self._known]
        for i in dict.fromkeys([*installed, *known]):
            yield from self._in_package(PurePosixPath(*parts[i:]))

    @cached_property
    def _known(self) -> set[str]:
        """Names of packages that the user gave, and of the own one."""
        beside = {f.name for given in self.given for f in given.iterdir() if f.is_dir()}
        return {*self.named, *self._described, *beside, *(f.name for f in self.folders)}

    def _renamed(self, wanted: PurePosixPath) -> Path | None:
        """Return the place of a file in the own package under another name, if that is unique and
        there is no package of the address's own name."""
        if len(self.renamed) != 1 or wanted.parts not in self.addresses:
            return None
        if self.folder_of(wanted.parts[0]) is not None:
            return None
        without, top = self.renamed[0]
        return top.joinpath(*wanted.parts[without:])

    def _remedy(self, wanted: PurePosixPath, packaged: bool) -> str:
        """Return the option that finds a file which lies near the URDF; otherwise, for a package,
        the option to name its folder."""
        if ".." in wanted.parts[1:] or not wanted.parts:
            return ""
        if is_absolute(wanted) or (not packaged and "share" in wanted.parts[:-2]):
            package = package_in(PurePosixPath("/", wanted))
            if package in self.named:
                return f"; {self._as_given(self.named[package])} has no such file"
            return f"; name the folder of its package: --package {package}=FOLDER"
        package, *inside = wanted.parts
        if packaged and len(self.renamed) > 1 and wanted.parts in self.addresses:
            options = ((f"{package}=" if n else "", n, top) for n, top in self.renamed)
            return "; choose one: " + ", or ".join(
                f"--package{'' if n else 's'} {name}{self._as_given(top)}"
                for name, n, top in options
                if n < 2
            )
        if not packaged:
            for up in list(self._above())[1:]:
                if package == ".." and (up / Path(*inside)).is_file():
                    also = "also" if self.given else "permit it:"
                    return f"; {also} --packages {self._as_given(up)}"
            return ""
        if package == "..":
            return ""
        for up in self._above():
            for folder in (up, up / package):
                if folder.joinpath(*inside).is_file():
                    return f"; name its folder: --package {package}={self._as_given(folder)}"
        if package in self.named:
            return f"; {self._as_given(self.named[package])} has no such file"
        return f"; if it has another name, --package {package}=FOLDER tells its folder"

    def _as_given(self, folder: Path) -> str:
        """Return a folder as an argument of a command, relative if the URDF's path is."""
        return shlex.quote(str(folder) if self.path.is_absolute() else os.path.relpath(folder))

    def fail(self, link: str, found: str, allowed: str) -> UserError:
        """Return the error for a mesh of a link; of a long name the end is shown."""
        found = found if len(found) <= _SHOWN else f"…{found[1 - _SHOWN :]}"
        return unusable(f"{self.path}: link {shown(link)}: mesh", found, allowed)


def _package_name(folder: Path) -> str:
    """Return the name in a folder's package.xml; empty if it has none."""
    file = folder / "package.xml"
    try:
        root = plain_xml(bounded_bytes(file, _LARGEST), str(file))
    except UserError:
        return ""
    return (root.findtext("name") or "").strip()
