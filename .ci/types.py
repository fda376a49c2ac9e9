"""Type check of the package as it is installed, seen from an empty folder.

From the checkout's root a checker may find a few files by their own names and pass, so that the
number of files is compared with what the rule of setup.py installs.

Usage: PYTHON .ci/types.py, with the interpreter of an environment in which ``pip install .`` and
mypy are.
"""

import re
import runpy
import subprocess
import sys
import sysconfig
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = "place_rings"
_SEEN = re.compile(r"no issues found in (\d+) source files?")


def handed_to_setuptools(root: Path = ROOT) -> dict[str, object]:
    """What setup.py hands to setuptools."""
    handed: dict[str, object] = {}
    kept = sys.modules.get("setuptools")
    sys.modules["setuptools"] = SimpleNamespace(setup=handed.update)  # type: ignore[assignment]
    try:
        runpy.run_path(str(root / "setup.py"))
    finally:
        del sys.modules["setuptools"]
        if kept is not None:
            sys.modules["setuptools"] = kept
    return handed


def installed_files(root: Path = ROOT) -> set[Path]:
    """The Python files that the rule of setup.py installs."""
    handed = handed_to_setuptools(root)
    folders: dict[str, str] = handed["package_dir"]  # type: ignore[assignment]
    packages: list[str] = handed["packages"]  # type: ignore[assignment]
    files: set[Path] = set()
    for package in packages:
        mapped = max((p for p in folders if f"{package}.".startswith(f"{p}.")), key=len)
        inner = package[len(mapped) :].strip(".").split(".")
        files |= set(root.joinpath(folders[mapped], *inner).glob("*.py"))
    return files


def seen(output: str) -> int:
    """How many files a checker that is content has seen; 0 where it says nothing of the kind."""
    said = _SEEN.search(output)
    return int(said[1]) if said else 0


def main() -> None:
    spec = find_spec(PACKAGE)
    place = Path(next(iter((spec and spec.submodule_search_locations) or ["."]))).resolve()
    if not place.is_relative_to(Path(sysconfig.get_path("purelib")).resolve()):
        sys.exit("place-rings is not installed here, or editable: run pip install .")
    with TemporaryDirectory() as empty:
        if not (place / "py.typed").exists():
            Path(empty, PACKAGE).symlink_to(place)  # else a checker leaves it out as untyped
        command = [sys.executable, "-m", "mypy", "--config-file", str(ROOT / "pyproject.toml")]
        command += ["--cache-dir", str(Path(empty, "cache")), "-p", PACKAGE]
        done = subprocess.run(command, cwd=empty, stdout=subprocess.PIPE, text=True)
    print(done.stdout, end="")
    if done.returncode:
        sys.exit(done.returncode)
    if seen(done.stdout) != (count := len(installed_files())):
        sys.exit(f"the checker saw {seen(done.stdout)} files, setup.py installs {count}")


if __name__ == "__main__":
    main()
