"""Markdown sections of the public API, from the signatures and docstrings in the source."""

import ast
import inspect
import re
import textwrap
from collections.abc import Iterator
from enum import Enum
from typing import Any

import place_rings as pr

_SECTION = re.compile(r"^(Args|Returns|Raises|Example|Examples|Yields):\s*$", re.MULTILINE)
_ITEM = re.compile(r"^([\w, *]+): ", re.MULTILINE)
_RESULTS = ("Coverage", "Improvement", "Proposal", "Report")  # functions return them
_WIDTH = 88  # characters of a signature on one line
_INTERNAL = ("Scene | CoreScene", "Scene")  # the internal form is not part of the API


def section(name: str) -> str:
    """Return the section of one public name."""
    value = getattr(pr, name)
    if inspect.isclass(value):
        parts = list(_class(name, value))
    elif inspect.isfunction(value):
        parts = [_signature(f"pr.{name}", _tree(value)), *_docstring(value)]
    else:  # a catalogue
        parts = [*_docstring(type(value)), *_methods(type(value))]
    return "\n\n".join([f"### {name}", *parts])


def _class(name: str, value: type) -> Iterator[str]:
    tree = _tree(value)
    own = {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}
    if "__init__" in own and not issubclass(value, Exception):
        yield _signature(f"pr.{name}", own["__init__"])
    elif fields := _fields(value):
        given = [
            f"{field.target.id}: {_type(field.annotation)}"  # type: ignore[attr-defined]
            + (f" = {ast.unparse(field.value)}" if field.value else "")
            for field, _ in fields
            if not _computed(field)
        ]
        if not name.endswith(_RESULTS):
            yield _call(f"pr.{name}", given, "")
    yield from _docstring(value)
    if issubclass(value, Enum):
        yield "\n".join(f"- `{one.name}`: {one.value}" for one in value)
        return
    described = [(field, text) for field, text in _fields(value) if text and not _computed(field)]
    lines = [
        f"- `{field.target.id}`: {_flat(text)}"  # type: ignore[attr-defined]
        for field, text in described
    ]
    lines += [f"- `{key}`: {_flat(text)}" for key, text in _properties(value)]
    if lines:
        yield "\n".join(lines)
    yield from _methods(value)


def _fields(value: type) -> list[tuple[ast.AnnAssign, str]]:
    """Return the fields of a class and its bases with the docstrings under them."""
    fields: dict[str, tuple[ast.AnnAssign, str]] = {}
    for base in reversed([b for b in value.__mro__ if b.__module__.startswith("place_rings")]):
        body = _tree(base).body
        for node, after in zip(body, [*body[1:], None], strict=True):
            if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
                text = _string(after)
                if not node.target.id.startswith("_"):
                    old = fields.get(node.target.id, (node, ""))[1]
                    fields[node.target.id] = (node, text or old)
    properties = {key for key, _ in _properties(value)}
    return [field for key, field in fields.items() if key not in properties]


def _computed(field: ast.AnnAssign) -> bool:
    """Return whether a field is internal: it is no argument of the class."""
    return field.value is not None and "init=False" in ast.unparse(field.value)


def _properties(value: type) -> list[tuple[str, str]]:
    """Return names and docstrings of the public properties."""
    found = {}
    for base in reversed(value.__mro__):
        for key, one in list(vars(base).items()):
            if not key.startswith("_") and (
                isinstance(one, property) or type(one).__name__ == "cached_property"
            ):
                found[key] = inspect.getdoc(one) or ""
    return [(key, text) for key, text in found.items() if text]


def _methods(value: type) -> Iterator[str]:
    """Yield the parts of each public method that the class itself defines with a docstring."""
    for key, one in list(vars(value).items()):  # the loop may fill a cache of the class
        plain = getattr(one, "__func__", one)  # of a class method or a static method
        if not key.startswith("_") and inspect.isfunction(plain) and plain.__doc__:
            yield _signature(f"{value.__name__}.{key}", _tree(plain))
            yield from _docstring(plain)


def _docstring(value: Any) -> Iterator[str]:
    """Yield the parts of a docstring as Markdown."""
    text = inspect.cleandoc(value.__doc__ or "")
    pieces = _SECTION.split(text)
    yield _plain(pieces[0])
    for title, body in zip(pieces[1::2], pieces[2::2], strict=True):
        body = textwrap.dedent(body.strip("\n")).strip()
        if title.startswith("Example"):
            yield f"```pycon\n{body}\n```"
        elif title == "Args":
            yield "\n".join(f"- {line}" for line in _items(body))
        elif title == "Raises":
            yield "Raises " + "; ".join(_items(body))
        else:
            yield f"{title} {_flat(body[0].lower() + body[1:] if body[1:2].islower() else body)}"


def _items(body: str) -> list[str]:
    """Return ``name: text`` items, each on one line, with the name as code."""
    items = re.split(r"\n(?=\S)", body)
    return [_ITEM.sub(lambda m: f"`{m[1]}`: ", _flat(item), count=1) for item in items]


class _Unlimited(ast.NodeTransformer):
    """Leaves out the limits of ``Annotated`` types."""

    def visit_Subscript(self, node: ast.Subscript) -> ast.AST:
        limited = isinstance(node.value, ast.Name) and node.value.id == "Annotated"
        inner: Any = node.slice.elts[0] if limited else node  # type: ignore[attr-defined]
        return self.generic_visit(inner)


def _type(annotation: ast.expr) -> str:
    return ast.unparse(_Unlimited().visit(annotation))


def _tree(value: Any) -> Any:
    if "__signature__" in getattr(value, "__dict__", {}) and not isinstance(
        value, type
    ):  # made from the fields of options
        names = r"(?:[a-z_]\w*\.)+(?=\w)|'(?=Setup)|(?<=Setup)'"  # of modules, and quotes
        text = re.sub(names, "", str(inspect.signature(value)))
        return ast.parse(f"def {value.__name__}{text}: ...").body[0]
    return ast.parse(textwrap.dedent(inspect.getsource(value))).body[0]


def _signature(name: str, function: ast.FunctionDef) -> str:
    """Return a fence with the signature as the source has it."""
    arguments = function.args
    first = arguments.args[:1]
    if first and first[0].arg in ("self", "cls"):
        arguments.args = arguments.args[1:]
    positional = arguments.posonlyargs + arguments.args
    defaults = [None] * (len(positional) - len(arguments.defaults)) + list(arguments.defaults)
    given = [_argument(*pair) for pair in zip(positional, defaults, strict=True)]
    if arguments.vararg:
        given.append(f"*{_argument(arguments.vararg, None)}")
    elif arguments.kwonlyargs:
        given.append("*")
    given += [
        _argument(*pair) for pair in zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True)
    ]
    if arguments.kwarg:
        given.append(f"**{_argument(arguments.kwarg, None)}")
    returns = ast.unparse(function.returns) if function.returns else ""
    return _call(name, given, "" if returns == "None" else returns.strip("'"))


def _argument(argument: ast.arg, default: ast.expr | None) -> str:
    kind = f": {_type(argument.annotation)}" if argument.annotation else ""
    value = "" if default is None else f" = {ast.unparse(default)}"
    return f"{argument.arg}{kind.replace(*_INTERNAL)}{value}"


def _call(name: str, given: list[str], returns: str) -> str:
    arrow = f" -> {returns.replace(*_INTERNAL)}" if returns else ""
    line = f"{name}({', '.join(given)}){arrow}"
    if len(line) > _WIDTH:
        line = f"{name}(\n" + "".join(f"    {one},\n" for one in given) + f"){arrow}"
    return f"```pyi\n{line}\n```"


def _string(node: Any) -> str:
    plain = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    return node.value.value if plain and isinstance(node.value.value, str) else ""


def _flat(text: str) -> str:
    return _plain(" ".join(text.split()))


def _plain(text: str) -> str:
    """Return text with code in single backticks."""
    return text.replace("``", "`").strip()
