"""Values of xacro's expressions, ``${...}``, without Python's ``eval``.

The syntax tree of an expression is interpreted: literals, names, arithmetic, comparisons,
conditions, keys of tables, and calls of listed functions and methods. Anything else is refused. No
attribute of a Python object is looked up, and values stay small.
"""

import ast
import math
import operator
import warnings
from collections.abc import Callable, Mapping
from typing import Any

from ...coverage.definitions.errors import UserError, shown

CONSTANTS: dict[str, Any] = {name: getattr(math, name) for name in ("pi", "tau", "e", "inf", "nan")}
"""Values of names that no file defines."""
_LONGEST = 2000  # characters of an expression
_MOST = 10_000  # characters and elements of a value
_BITS = 1024  # of a whole number
_ODD = (
    ArithmeticError,
    LookupError,
    MemoryError,
    RecursionError,
    SyntaxError,
    TypeError,
    ValueError,
)
_MODULES = ("math", "python", "xacro")  # what xacro calls the tables of its functions


def _power(base: Any, exponent: Any) -> Any:
    if isinstance(base, int) and base.bit_length() * abs(exponent) > _BITS:
        raise OverflowError(f"a number of more than {_BITS} bits")
    return base**exponent


def _of_numbers(of: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    """Return a function that refuses texts and lists, which ``*`` repeats and ``%`` formats."""

    def checked(a: Any, b: Any) -> Any:
        if not (isinstance(a, int | float) and isinstance(b, int | float)):
            raise TypeError(f"found {shown(a)} and {shown(b)}, wanted: two numbers")
        return of(a, b)

    return checked


def _rounded(number: float, digits: int | None = None) -> float:
    return round(number, None if digits is None else max(-20, min(digits, 20)))


def _range(*ends: int) -> list[int]:
    if len(numbers := range(*ends)) > _MOST:
        raise OverflowError(f"more than {_MOST} numbers")
    return list(numbers)


_BINARY: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: _of_numbers(operator.mul),
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: _of_numbers(operator.mod),
    ast.Pow: _of_numbers(_power),
}
_UNARY: dict[type, Callable[[Any], Any]] = {
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
    ast.Not: operator.not_,
}
_COMPARE: dict[type, Callable[[Any, Any], bool]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Is: operator.is_,
    ast.IsNot: operator.is_not,
    ast.In: lambda a, b: a in b,
    ast.NotIn: lambda a, b: a not in b,
}
_FUNCTIONS: dict[str, Callable[..., Any]] = {
    name: function
    for name, function in vars(math).items()
    if callable(function) and name[0] != "_" and name not in ("comb", "factorial", "perm", "prod")
}
_FUNCTIONS |= {
    function.__name__: function
    for function in (abs, all, any, len, max, min, sorted, sum, bool, dict, float, int, list, str)
}
_FUNCTIONS |= {"range": _range, "round": _rounded, "tuple": list}
_METHODS: dict[type, str] = {
    str: "lower upper strip lstrip rstrip split startswith endswith replace join",
    dict: "get keys values items",
}


def value_of(
    text: str, names: Mapping[str, Any], functions: Mapping[str, Callable[..., Any]], where: str
) -> Any:
    """Return the value of an expression.

    Args:
        text: the expression, without ``${`` and ``}``.
        names: values of names; a table among them is a namespace.
        functions: functions besides those of mathematics and texts.
        where: the file, for messages.

    Raises:
        UserError: if the expression is none of arithmetic, or has no value.
    """
    try:
        if len(text) > _LONGEST:
            raise ValueError(f"an expression of more than {_LONGEST} characters")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of odd escapes and comparisons
            tree = ast.parse(text.strip(), mode="eval")
        return _Interpreter(names, functions).of(tree.body)
    except _ODD as error:
        reason = f"no name {error}" if isinstance(error, KeyError) else str(error)
        raise UserError(f"{where}: expression {shown(text)}: {reason}") from error


class _Interpreter:
    def __init__(
        self, names: Mapping[str, Any], functions: Mapping[str, Callable[..., Any]]
    ) -> None:
        self._names, self._functions = names, {**_FUNCTIONS, **functions}

    def of(self, node: ast.expr) -> Any:
        """Return the value of a node."""
        value = self._value(node)
        _check_small(value)
        return value

    def _value(self, node: ast.expr) -> Any:
        match node:
            case ast.Constant(value=str() | int() | float() | None):
                return node.value
            case ast.Name():
                return self._names[node.id]
            case ast.Attribute():
                return self._key(node)
            case ast.Subscript():
                return self._item(node)
            case ast.UnaryOp():
                return _listed(_UNARY, node.op)(self.of(node.operand))
            case ast.BinOp():
                return _listed(_BINARY, node.op)(self.of(node.left), self.of(node.right))
            case ast.BoolOp():
                return self._all_or_any(node)
            case ast.Compare():
                return self._compared(node)
            case ast.IfExp():
                return self.of(node.body if self.of(node.test) else node.orelse)
            case ast.List() | ast.Tuple():
                return [self.of(element) for element in node.elts]
            case ast.Dict():
                keys = [self.of(key) for key in node.keys if key is not None]
                return dict(zip(keys, map(self.of, node.values), strict=True))
            case ast.Call():
                return self._called(node)
        raise _refused(node)

    def _module(self, node: ast.expr) -> bool:
        """Return whether a node names one of xacro's modules, and no property."""
        return isinstance(node, ast.Name) and node.id in _MODULES and node.id not in self._names

    def _key(self, node: ast.Attribute) -> Any:
        """Return what a table or namespace has under a name."""
        if self._module(node.value):
            return CONSTANTS[node.attr]
        # a namespace is no value, but its properties are
        table = self._names[node.value.id] if isinstance(node.value, ast.Name) else None
        table = self.of(node.value) if table is None else table
        if not isinstance(table, dict):
            raise _refused(node)
        return table[node.attr]

    def _item(self, node: ast.Subscript) -> Any:
        if isinstance(node.slice, ast.Slice):
            ends = (node.slice.lower, node.slice.upper, node.slice.step)
            return self.of(node.value)[slice(*(None if e is None else self.of(e) for e in ends))]
        return self.of(node.value)[self.of(node.slice)]

    def _all_or_any(self, node: ast.BoolOp) -> Any:
        value = None
        for part in node.values:
            value = self.of(part)
            if bool(value) is isinstance(node.op, ast.Or):
                break
        return value

    def _compared(self, node: ast.Compare) -> bool:
        left = self.of(node.left)
        for operation, part in zip(node.ops, node.comparators, strict=True):
            right = self.of(part)
            if not _listed(_COMPARE, operation)(left, right):
                return False
            left = right
        return True

    def _called(self, node: ast.Call) -> Any:
        """Return what a listed function or method returns."""
        keywords = {key.arg: self.of(key.value) for key in node.keywords if key.arg is not None}
        if len(keywords) < len(node.keywords):
            raise _refused(node)
        values = [self.of(value) for value in node.args]
        match node.func:
            case ast.Name(id=name):
                return self._functions[name](*values, **keywords)
            case ast.Attribute(value=of, attr=name) if self._module(of):
                return self._functions[name](*values, **keywords)
            case ast.Attribute(value=of, attr=name):
                owner = self.of(of)
                if name not in _METHODS.get(type(owner), "").split():
                    raise _refused(node)
                result = getattr(owner, name)(*values, **keywords)
                return result if name in ("get", *_METHODS[str].split()) else list(result)
        raise _refused(node)


def _listed(table: Mapping[type, Any], operation: ast.AST) -> Any:
    if type(operation) not in table:
        raise _refused(operation)
    return table[type(operation)]


def _refused(node: ast.AST) -> ValueError:
    what = ast.unparse(node) if isinstance(node, ast.expr) else type(node).__name__
    return ValueError(f"found {shown(what)}, allowed: arithmetic, comparisons and listed functions")


def _check_small(value: Any) -> None:
    """Refuse a value that is large, or none of an expression."""
    weight, stack = 0, [value]
    while stack:
        part = stack.pop()
        match part:
            case dict():
                stack += [*part.keys(), *part.values()]
            case list() | tuple():
                stack += part
            case str():
                weight += len(part)
            case int() if part.bit_length() > _BITS:
                raise OverflowError(f"a number of more than {_BITS} bits")
            case int() | float() | None:
                pass
            case _:
                raise TypeError(f"found a {type(part).__name__}, wanted: a number, text or list")
        weight += 1
        if weight + len(stack) > _MOST:  # a list may be in itself
            raise OverflowError(f"a value of more than {_MOST} characters or elements")
