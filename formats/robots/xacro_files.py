"""Expansion of xacro files by the package xacro, in which nothing runs that a file says.

The package evaluates expressions by ``eval`` and opens any file. A copy of it is loaded for each
expansion, whose own functions for expressions, substitutions and files replace these. They read
files only from the folders that ``Packages`` permits, and no environment variable.
"""

import importlib.util
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any
from xml.dom import minidom

from ...coverage.definitions.errors import UserError, shown, unusable
from ..yaml_text import plain_yaml
from .packages import Packages
from .xacro_expressions import CONSTANTS, value_of
from .xml_text import bounded_bytes, plain_xml, some

INSTALL = "pip install 'place-rings[xacro]'"
LARGEST = 4 * 2**20  # bytes, largest file
_MOST = 50_000  # elements that macros and blocks make
_LONGEST = 2**24  # characters that are read and evaluated in total
_EACH, _FILE = 32, 2**14  # characters that an evaluation and a file count besides their own
_SHOWN = 300  # characters of a reason of xacro
_UNITS = {
    "radians": "1",
    "degrees": "pi / 180",
    "meters": "1",
    "millimeters": "0.001",
    "foot": "0.3048",
    "inches": "0.0254",
}
_SPLIT = re.compile(r"[,; ]+")


def expand_xacro(path: Path, arguments: Mapping[str, str], packages: Packages) -> ET.Element:
    """Return the root of the URDF that a xacro file makes.

    Args:
        path: the file.
        arguments: values of its arguments, by name.
        packages: the folders of the files that it includes.

    Raises:
        UserError: if a file cannot be read or expanded, or an argument is unknown; if an expression
            is none of arithmetic, or a file lies elsewhere.
    """
    expansion = _Expansion(path, arguments, packages)
    try:
        return expansion.root()
    except Exception as error:
        raise expansion.explained(error) from error


def _own_copy() -> ModuleType:
    """Return a copy of the package xacro, which keeps its state in the module."""
    spec = importlib.util.find_spec("xacro")
    if spec is None or spec.loader is None:
        raise UserError(f"a xacro file needs the package xacro: {INSTALL}")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class _Expansion:
    def __init__(self, path: Path, arguments: Mapping[str, str], packages: Packages) -> None:
        self._path, self._arguments, self._packages = path, arguments, packages
        self._xacro, self._declared = _own_copy(), set[str]()
        self._elements = self._characters = 0
        own: dict[str, Any] = {
            "safe_eval": self._evaluated,
            "eval_extension": self._substituted,
            "get_include_files": self._included,
            "parse": self._parsed,
            "eval_all": self._counted(self._xacro.eval_all),
            "eval_text": self._short(self._xacro.eval_text),
            "resolve_macro": self._small(self._xacro.resolve_macro),
            "_global_symbols": dict(CONSTANTS),
            **dict.fromkeys(("warning", "print_location"), lambda *_, **__: None),
        }
        if missing := [name for name in own if not hasattr(self._xacro, name)]:
            raise UserError(f"xacro {missing[0]}: missing, wanted: xacro 2.1 or later; {INSTALL}")
        vars(self._xacro).update(own, eval=_refused, exec=_refused, compile=_refused, open=_refused)

    def root(self) -> ET.Element:
        """Return the root of the expanded file."""
        self._xacro.init_stacks(str(self._path))
        document = self._parsed(None, str(self._path))
        self._xacro.process_doc(document, mappings=dict(self._arguments))
        if unknown := [name for name in self._arguments if name not in self._declared]:
            names = some(sorted(self._declared)) or "none, as the file declares no argument"
            raise unusable(f"{self._path}: --xacro-arg", unknown[0], names)
        return plain_xml(document.toxml().encode(), str(self._path))

    def explained(self, error: Exception) -> UserError:
        """Return the error for a person: the innermost of this product, else what xacro says."""
        inner: BaseException | None = error
        while inner is not None and not isinstance(inner, UserError):
            inner = getattr(inner, "exc", None)
        if isinstance(inner, UserError):
            return inner
        reason = " ".join(f"{error}".split())[:_SHOWN] or type(error).__name__
        if isinstance(error, RecursionError):
            reason = "files or macros that hold themselves, or too many in each other"
        return UserError(f"{self._here()}: xacro: {reason}")

    def _here(self) -> str:
        """Return the file that is read."""
        stack = self._xacro.filestack or [str(self._path)]
        return str(stack[-1])

    def _file(self, name: str, relative: bool = True) -> Path:
        """Return a file that the user's folders permit."""
        path = Path(self._xacro.abs_filename_spec(name)) if relative else Path(name)
        try:
            real = path.resolve()
        except (OSError, ValueError, RuntimeError):
            real = path
        if real != self._path.resolve() and not any(
            real.is_relative_to(folder) for folder in self._packages.folders
        ):
            allowed = "a file in the package of the xacro file, or in a folder given by --packages"
            raise unusable(f"{self._here()}: file", name, allowed)
        return real

    def _parsed(self, _: None, name: str) -> minidom.Document:
        """Return the document of a file; it takes the place of ``xacro.parse``."""
        file = self._file(name, relative=False)
        if len(self._xacro.filestack) > 1 and not file.is_file():  # an include may be optional
            self._xacro.filestack.pop()
            raise self._xacro.XacroException(exc=FileNotFoundError(f"found no file {name}"))
        text = bounded_bytes(file, LARGEST, name)
        self._read(_FILE + len(text))
        root = plain_xml(text, name)
        self._declared |= {e.get("name", "") for e in root.iter() if e.tag == "xacro:arg"}
        return minidom.parseString(ET.tostring(root))  # without comments

    def _included(self, name: str, symbols: Mapping[str, Any]) -> Iterator[str]:
        """Yield the one file that an include names; for ``xacro.get_include_files``."""
        file = self._xacro.abs_filename_spec(str(self._xacro.eval_text(name, symbols)))
        self._file(file, relative=False)
        yield file

    def _evaluated(self, text: str, symbols: Mapping[str, Any], _: object = None) -> Any:
        """Return the value of an expression; for ``xacro.safe_eval``."""
        functions = {
            "load_yaml": self._table,
            "arg": lambda name: self._argument(name),
            "abs_filename": self._xacro.abs_filename_spec,
            "dotify": dict,
            "tokenize": lambda text: _SPLIT.split(text),
            "fatal": self._fatal,
            **dict.fromkeys(("message", "warning", "error", "print_location"), lambda *_: ""),
        }
        return value_of(text, symbols, functions, self._here())

    def _substituted(self, text: str) -> str:
        """Return the value of ``$(...)``; for ``xacro.eval_extension``."""
        command, _, rest = text[2:-1].strip().partition(" ")
        match command, rest.strip():
            case "arg", name:
                return self._argument(name)
            case "find", name if (folder := self._packages.folder_of(name)) is not None:
                return str(folder)
            case "find", name:
                allowed = f"a package in --packages, or --package {name}=FOLDER"
                raise unusable(f"{self._here()}: {text}", name, allowed)
            case "dirname", "":
                return str(Path(self._here()).resolve().parent)
            case "eval", expression:
                return str(self._evaluated(expression, self._values()))
        allowed = "$(arg NAME), $(find PACKAGE), $(dirname) or $(eval EXPRESSION)"
        raise unusable(f"{self._here()}: substitution", text, allowed)

    def _values(self) -> dict[str, Any]:
        """Return the arguments, with numbers as such."""
        given = self._xacro.substitution_args_context["arg"]
        literal = self._xacro.Table._eval_literal
        return {**CONSTANTS, **{name: literal(value) for name, value in given.items()}}

    def _argument(self, name: str) -> str:
        given = self._xacro.substitution_args_context["arg"]
        if name not in given:
            raise UserError(
                f"{self._here()}: argument {shown(name)}: missing; add --xacro-arg {name}=VALUE"
            )
        return str(given[name])

    def _table(self, name: str) -> Any:
        """Return what a YAML file holds; for ``load_yaml`` of expressions."""

        def measured(text: str, unit: str) -> float:
            return float(value_of(f"({text}) * {_UNITS[unit]}", CONSTANTS, {}, name))

        text = bounded_bytes(self._file(name), LARGEST, name).decode(errors="replace")
        self._read(_FILE + len(text))
        return plain_yaml(name, text, _UNITS, measured, aliases=True)

    def _fatal(self, *words: object) -> None:
        raise UserError(f"{self._here()}: {' '.join(map(str, words))}")

    def _counted(self, evaluate: Callable[..., None]) -> Callable[..., None]:
        """Return ``xacro.eval_all`` with a limit of elements."""

        def counted(node: minidom.Element, macros: Any, symbols: Any) -> None:
            self._spend(1)
            evaluate(node, macros, symbols)

        return counted

    def _small(self, resolve: Callable[..., Any]) -> Callable[..., Any]:
        """Return ``xacro.resolve_macro`` with a limit of the elements that are copied."""

        def small(name: str, macros: Any, symbols: Any) -> Any:
            resolved = resolve(name, macros, symbols)
            self._spend(len(resolved[2].body.getElementsByTagName("*")))
            return resolved

        return small

    def _spend(self, elements: int) -> None:
        self._elements += elements
        if self._elements > _MOST:
            raise UserError(
                f"{self._path}: found more, allowed: at most {_MOST} elements of macros"
            )

    def _short(self, evaluate: Callable[..., Any]) -> Callable[..., Any]:
        """Return ``xacro.eval_text`` with a limit of characters."""

        def short(text: str, symbols: Any) -> Any:
            value = evaluate(text, symbols)
            self._read(_EACH + len(text) + (len(value) if isinstance(value, str) else 0))
            return value

        return short

    def _read(self, characters: int) -> None:
        self._characters += characters
        if self._characters > _LONGEST:
            allowed = f"at most {_LONGEST} characters of texts"
            raise UserError(f"{self._path}: found more, allowed: {allowed}")


def _refused(*_: object, **__: object) -> None:
    raise UserError("this version of xacro works in another way; wanted: xacro 2.1")
