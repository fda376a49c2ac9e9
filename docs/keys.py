"""Keys of files as Markdown, from the JSON Schemas that ``place-rings schema`` prints."""

import io
import json
import re
from contextlib import redirect_stdout
from typing import Any, get_args, get_type_hints

from place_rings.cli.commands.schema import schema

_SHORT = 40  # longest default that is shown, characters
_BOUNDS = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}
_WORDS = {
    "string": "text",
    "number": "number",
    "integer": "integer",
    "boolean": "true or false",
    "null": "none",
}


class KeyTables:
    """Tables of one page with a section for each file; shared kinds are described at their
    first use.
    """

    def __init__(self) -> None:
        self.schemas = {name: _schema(name) for name in get_args(get_type_hints(schema)["name"])}
        self.files = {_title(whole["title"]): name for name, whole in self.schemas.items()}
        self.kinds = {_title(w["title"]): set(w["properties"]) for w in self.schemas.values()}
        self.done, self.named = set(self.files), list[str]()

    def of(self, name: str) -> str:
        """Return the table of a file's keys and one for each kind of table in it.

        ``others`` stands for all files that were not requested.
        """
        if name == "others":
            rest = [other for other in self.schemas if other not in self.named]
            return "\n\n".join(f"## {other}\n\n{self.of(other)}" for other in rest)
        self.named.append(name)
        whole = self.schemas[name]
        parts, kinds = [self._section(whole)], _kinds_in(whole)
        for kind in kinds:  # the list grows in the loop
            inner, title = whole["$defs"][kind], self._name(kind)
            if title not in self.done and "properties" in inner:
                self.done.add(title)
                parts += [f"### Kind {title}", self._section(inner)]
                kinds += _kinds_in(inner)
        return "\n\n".join(parts)

    def _section(self, inner: dict[str, Any]) -> str:
        return f"{_flat(inner.get('description', ''))}\n\n{self._table(inner)}"

    def _table(self, inner: dict[str, Any]) -> str:
        needed = inner.get("required", [])
        rows = ["| key | value | default | meaning |", "| --- | --- | --- | --- |"]
        for key, value in inner["properties"].items():
            default = "needed" if key in needed else _default(value)
            rows.append(f"| `{key}` | {self._kind(value)} | {default} | {_told(value)} |")
        return "\n".join(rows)

    def _kind(self, value: dict[str, Any]) -> str:
        """Return the allowed values as text, with their limits."""
        if "$ref" in value:
            title = self._name(value["$ref"].rsplit("/", 1)[1])
            label = f"kind-{title.lower().replace(' ', '-')}"
            return f"[{title}](#{self.files.get(title, label)})"
        if several := value.get("anyOf") or value.get("oneOf"):
            return " or ".join(self._kind(one) for one in several if one.get("type") != "null")
        if "enum" in value or "const" in value:
            choices = value.get("enum", [value.get("const")])
            return " or ".join(f"`{one}`" for one in choices).replace("``", '`""`')
        if value.get("type") == "array":
            least, most = value.get("minItems", 0), value.get("maxItems")
            inner = self._kind(value.get("items") or value.get("prefixItems", [{}])[0])
            return f"{least} of: {inner}" if least == most else f"list of: {inner}"
        if value.get("type") == "object":
            inner = value.get("additionalProperties")
            return f"by name: {self._kind(inner)}" if isinstance(inner, dict) else "table"
        limits = [f"{sign} {value[key]:g}" for key, sign in _BOUNDS.items() if key in value]
        return ", ".join([_WORDS.get(value.get("type", ""), "any"), *limits]).replace("e+0", "e")

    def _name(self, kind: str) -> str:
        """Return the name of a kind of the current file, with the file if another has a different
        kind of this name."""
        title, file = _title(kind), self.named[-1]
        keys = set(self.schemas[file]["$defs"][kind].get("properties", ()))
        names = [title, *(name for name in self.kinds if name.startswith(f"{title} of "))]
        same = (name for name in names if keys <= self.kinds.get(name, keys))
        name = next(same, f"{title} of {file}")
        self.kinds.setdefault(name, keys)
        return name


def _kinds_in(inner: dict[str, Any]) -> list[str]:
    """Return the kinds of tables that keys of ``inner`` hold, in their order."""
    return re.findall(r'"#/\$defs/(\w+)"', json.dumps(inner["properties"]))


def _schema(name: str) -> dict[str, Any]:
    with redirect_stdout(io.StringIO()) as printed:
        schema(name)  # type: ignore[arg-type]
    whole = json.loads(printed.getvalue())
    _name_tables(whole, whole.setdefault("$defs", {}))
    return whole


def _name_tables(inner: Any, names: dict[str, Any]) -> None:
    """Name the tables of which a value may be one by their titles."""
    if isinstance(inner, dict):
        if all("properties" in table for table in inner.get("oneOf", [{}])):
            names |= {table["title"]: table for table in inner["oneOf"]}
            inner["oneOf"] = [{"$ref": f"#/$defs/{table['title']}"} for table in inner["oneOf"]]
        inner = [value for key, value in inner.items() if key != "oneOf"]
    if isinstance(inner, list):
        for value in inner:
            _name_tables(value, names)


def _default(value: dict[str, Any]) -> str:
    text = json.dumps(value.get("default"), ensure_ascii=False)
    return "" if text in ("null", "{}", "[]") or len(text) > _SHORT else f"`{text}`"


def _told(value: dict[str, Any]) -> str:
    """Return a value's description, or that of the items of a list."""
    inner = [value, value.get("items", {}), *value.get("anyOf", [])]
    return next(
        (
            _flat(one["description"])
            for one in inner
            if isinstance(one, dict) and "description" in one
        ),
        "",
    )


def _flat(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|").replace("``", "`")


def _title(kind: str) -> str:
    return re.sub(r"(?<=.)(Model|File)$", "", kind)
