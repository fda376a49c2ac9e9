"""Type check of the installed package, run from an empty folder.

From the checkout's root a checker may find a few files by their own names and pass. Therefore the
checked modules are compared with those that the rule of setup.py installs.

Usage: PYTHON .ci/typecheck.py, with the interpreter of an environment that has mypy and the
package. An editable installation is checked as a copy with the layout of ``pip install .``.
"""

import os
import runpy
import shutil
import subprocess
import sys
import sysconfig
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = "place_rings"


def handed_to_setuptools(root: Path = ROOT) -> dict[str, Any]:
    """Return the arguments that setup.py passes to setuptools."""
    handed: dict[str, Any] = {}
    kept = sys.modules.get("setuptools")
    stand_in: Any = SimpleNamespace(setup=handed.update)
    sys.modules["setuptools"] = stand_in
    try:
        runpy.run_path(str(root / "setup.py"))
    finally:
        del sys.modules["setuptools"]
        if kept is not None:
            sys.modules["setuptools"] = kept
    return handed


def installed_modules(root: Path = ROOT) -> dict[str, Path]:
    """Return the files that the rule of setup.py installs, by their import names."""
    handed = handed_to_setuptools(root)
    folders: dict[str, str] = handed["package_dir"]
    packages: list[str] = handed["packages"]
    modules = {}
    for package in packages:
        mapped = max((p for p in folders if f"{package}.".startswith(f"{p}.")), key=len)
        inner = package[len(mapped) :].strip(".").split(".")
        for file in root.joinpath(folders[mapped], *inner).glob("*.py"):
            modules[package if file.stem == "__init__" else f"{package}.{file.stem}"] = file
    return modules


def seen(report: str) -> set[str]:
    """Return the modules in mypy's report of lines: checked ones, and folders without any."""
    return {line.split()[-1] for line in report.splitlines()[1:]}


def copied(folder: Path) -> Path:
    """Copy the package into a folder as ``pip install .`` would, for an editable installation."""
    for name, file in installed_modules().items():
        path = folder.joinpath(*name.split("."))
        path = path / "__init__.py" if file.stem == "__init__" else path.with_suffix(".py")
        path.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, path)
    return folder


def main() -> None:
    """Check the package; exit with mypy's code, or with the names of unchecked files."""
    spec = find_spec(PACKAGE)
    place = Path(next(iter((spec and spec.submodule_search_locations) or ["."]))).resolve()
    with TemporaryDirectory() as empty:
        environment = dict(os.environ)
        if not place.is_relative_to(Path(sysconfig.get_path("purelib")).resolve()):
            environment["MYPYPATH"] = str(copied(Path(empty, "copy")))
        command = [sys.executable, "-m", "mypy", "--config-file", str(ROOT / "pyproject.toml")]
        command += ["--cache-dir", "cache", "--linecount-report", "lines", "-p", PACKAGE]
        done = subprocess.run(command, cwd=empty, env=environment)
        if done.returncode:
            sys.exit(done.returncode)
        checked = seen(Path(empty, "lines", "linecount.txt").read_text())
    expected = set(installed_modules())
    if unseen := sorted(expected - checked):
        sys.exit(f"{len(unseen)} of {len(expected)} files were not checked: {', '.join(unseen)}")
    print(f"all {len(expected)} files were checked")


if __name__ == "__main__":
    main()
