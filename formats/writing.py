"""Atomic writing of files: an interrupted write leaves the old file or the new one, never a part;
and of the files of one run, which no other run mixes with its own."""

import contextlib
import os
import shutil
import tempfile
import threading
from collections import deque
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import tomli_w

from ..coverage.definitions.definition import adapter
from ..coverage.definitions.errors import UserError
from ..coverage.definitions.escaping import printable

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

_UNFINISHED = ".place-rings-run-"


def write_text(path: Path, text: str) -> None:
    """Write ``text`` to ``path`` atomically, as ``write_bytes`` does.

    Raises:
        UserError: if the file cannot be written.
    """
    write_bytes(path, text.encode("utf-8", "replace"))


def write_bytes(path: Path, data: bytes) -> None:
    """Write ``data`` to ``path`` atomically, by a temporary file in the same folder that is flushed
    to disk and renamed.

    Raises:
        UserError: if the file cannot be written; an existing file stays unchanged.
    """
    temporary = None
    target = Path(os.path.realpath(path))  # keeps a symbolic link
    try:
        with tempfile.NamedTemporaryFile(
            dir=target.parent, prefix=".place-rings-", delete=False
        ) as file:
            temporary = Path(file.name)
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        if target.exists():
            temporary.chmod(target.stat().st_mode & 0o777)
        else:
            temporary.chmod(0o666 & ~_umask())
        temporary.replace(target)
        temporary = None
        _sync_folder(target.parent)
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror}") from error
    finally:
        if temporary is not None:
            temporary.unlink(missing_ok=True)


def _umask() -> int:
    mask = os.umask(0o077)
    os.umask(mask)
    return mask


def _sync_folder(path: Path) -> None:
    """Flush a rename in the folder to disk; errors are ignored, because the file is complete either
    way."""
    with contextlib.suppress(OSError):
        folder = os.open(path, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


def to_toml(model: Any, heading: str = "", file: Any = None) -> str:
    """Return a model, or a definition as its ``file``, as TOML below comment lines; keys without a
    value are omitted, because TOML has no null."""
    stated = adapter(file).dump_python(model, mode="json") if file else model.stated()
    comment = "".join(f"# {printable(line)}\n" for line in heading.splitlines())
    return comment + tomli_w.dumps(without_none(stated))


def without_none(value: Any) -> Any:
    """Return tables without keys of no value, as TOML has no null, and of empty tables or lists."""
    if isinstance(value, dict):
        return {
            key: without_none(v)
            for key, v in value.items()
            if v is not None and v != {} and v != []
        }
    return [without_none(v) for v in value] if isinstance(value, list) else value


def output_folder(path: Path, argument: str = "--out ") -> Path:
    """Create the folder ``path`` if necessary and check that files can be written there.

    Raises:
        UserError: if they cannot; the message begins with ``argument``.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            return path
    except FileExistsError as error:
        raise UserError(
            f"{argument}{path}: cannot be written: it is a file; choose a folder"
        ) from error
    except OSError as error:
        raise UserError(
            f"{argument}{path}: cannot be written: {error.strerror}; choose a writable folder"
        ) from error


@contextlib.contextmanager
def made_folder(path: Path, argument: str = "--out ") -> Iterator[Path]:
    """Yield ``output_folder`` for the files of this run alone, and remove new empty folders if the
    body fails.

    Raises:
        UserError: if no file can be written there, or another run writes there; the message begins
            with ``argument``.
    """
    new = [folder for folder in (path, *path.parents) if not folder.exists()]
    output_folder(path, argument)
    with _held(path, argument):
        try:
            yield path
        except BaseException:
            for folder in new:
                with contextlib.suppress(OSError):
                    folder.rmdir()
            raise


@contextlib.contextmanager
def output_files(
    path: Path, *names: str, keep: bool = False, argument: str = "--out "
) -> Iterator[Path]:
    """Yield a new folder for the files of one run, and move them into ``path`` at the end.

    A process that is killed leaves the files of an earlier run or those of this one, never both.
    All old files ``names``, and those with the names of new files, give way first; only the first
    of ``names`` is replaced in one step.

    Args:
        path: output folder.
        names: names of the files that such runs write, the most important first.
        keep: whether the files that were written before the body failed, as on a full disk, are
            kept; otherwise the old ones are.
        argument: beginning of a message about the folder.

    Raises:
        UserError: as ``made_folder``, or if a symbolic link or a folder has the name of a file.
    """
    with made_folder(path, argument):
        for name in names:
            require_place(path, name)
        with _unfinished(path, argument) as new:
            try:
                yield new
            except BaseException as error:
                kept = _moved(new, path, names) if keep else []
                if not isinstance(error, UserError) or str(new) not in str(error):
                    raise
                text = str(error).replace(str(new), str(path))
                note = f"; written: {', '.join(kept)}" if kept else ""
                raise UserError(f"{text}{note}") from error
            _moved(new, path, names)


@contextlib.contextmanager
def _unfinished(folder: Path, argument: str) -> Iterator[Path]:
    """Yield a new temporary folder in ``folder``."""
    try:
        made = tempfile.TemporaryDirectory(
            dir=folder, prefix=_UNFINISHED, ignore_cleanup_errors=True
        )
    except OSError as error:
        raise UserError(f"{argument}{folder}: cannot be written: {error.strerror}") from error
    with made as name:
        yield Path(name)


def _moved(new: Path, folder: Path, names: Sequence[str]) -> list[str]:
    """Move all files of ``new`` into ``folder``, and the files of an earlier run into ``new``.

    Returns:
        The names of the new files.

    Raises:
        UserError: if a file cannot be moved.
    """
    made = {str(p.relative_to(new)) for p in new.rglob("*") if p.is_file()}
    ordered = list(dict.fromkeys((*names, *sorted(made))))
    steps = deque[tuple[Path, Path]]()
    for name in ordered if made else ():
        require_place(folder, name)
        path = folder / name
        if path.exists() and (name not in made or name != ordered[0]):
            steps.appendleft((path, new / f"{_UNFINISHED}{len(steps)}"))
        if path.exists() and name in made:
            (new / name).chmod(path.stat().st_mode & 0o777)
    steps.extend((new / name, folder / name) for name in ordered if name in made)
    try:
        try:
            _move(steps)
        except KeyboardInterrupt:
            _move(steps)
            raise
    except OSError as error:
        raise UserError(f"{folder}: cannot be written: {error.strerror}") from error
    _sync_folder(folder)
    return [name for name in ordered if name in made]


def _move(steps: deque[tuple[Path, Path]]) -> None:
    """Do steps in order; what an interrupt leaves can be done later."""
    while steps:
        source, target = steps[0]
        if source.exists():
            target.parent.mkdir(parents=True, exist_ok=True)
            source.replace(target)
        steps.popleft()


def require_place(folder: Path, name: str) -> None:
    """Raise UserError unless ``folder / name`` is a file or nothing, in folders or nothing.

    A symbolic link would lead out of the folder.
    """
    path = folder
    for part in Path(name).parts:
        path = path / part
        here = path.is_file() if path == folder / name else path.is_dir()
        if path.is_symlink() or (path.exists() and not here):
            found = "a symbolic link" if path.is_symlink() else "no regular file or folder"
            raise UserError(f"{path}: cannot be written: it is {found}; choose another folder")


_mine = threading.local()  # folders that this thread holds


def _opened(folder: Path) -> int | None:
    """Return a handle of a folder; None if it may be written but not read."""
    with contextlib.suppress(OSError):
        return os.open(folder, os.O_RDONLY)
    return None


@contextlib.contextmanager
def _held(folder: Path, argument: str) -> Iterator[None]:
    """Hold a folder against other runs, and remove what killed runs have left there.

    The lock is on the folder itself and ends with the process. Some file systems have none, and a
    folder that cannot be read takes none; then nothing is held.

    Raises:
        UserError: if another run holds it.
    """
    folders: set[str] = _mine.__dict__.setdefault("folders", set())
    name = os.path.realpath(folder)
    handle = None if fcntl is None or name in folders else _opened(folder)
    if handle is None:
        yield
        return
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise UserError(
                f"{argument}{folder}: another run writes there; wait for its end, or choose"
                " another folder"
            ) from None
        except OSError:
            pass
        else:
            for old in folder.glob(f"{_UNFINISHED}*"):
                if not old.is_symlink():
                    shutil.rmtree(old, ignore_errors=True)
        folders.add(name)
        yield
    finally:
        folders.discard(name)
        with contextlib.suppress(OSError):
            fcntl.flock(handle, fcntl.LOCK_UN)  # forked processes share it
        os.close(handle)
