"""YAML of files from others: plain values only."""

from collections.abc import Callable, Iterable
from typing import Any

from ..coverage.definitions.errors import UserError

_ODD = (AttributeError, LookupError, RecursionError, ValueError)  # what PyYAML raises of odd values


def plain_yaml(
    name: str,
    text: str,
    tags: Iterable[str] = (),
    tagged: Callable[[str, str], Any] | None = None,
    aliases: bool = False,
) -> Any:
    """Return the content of a YAML text.

    Args:
        name: the file, for messages.
        text: its text.
        tags: names of tags that ``tagged`` reads, such as degrees of ``!degrees 90``.
        tagged: returns the value of a text with the tag of a name.
        aliases: whether one value may stand in several places. The content is then small, but what
            a walk through it meets may be more than fits into memory.

    Raises:
        UserError: if it is no YAML, has aliases that are not allowed, or merges tables.
    """
    import yaml  # few commands read such a file

    class Plain(yaml.SafeLoader):  # type: ignore[misc]  # PyYAML has no types
        """A loader of plain values."""

        def compose_node(self, parent: Any, index: Any) -> Any:
            if not aliases and self.check_event(yaml.AliasEvent):
                raise yaml.YAMLError("an alias; write its value")
            return super().compose_node(parent, index)

        def flatten_mapping(self, node: Any) -> None:
            if any(key.tag == "tag:yaml.org,2002:merge" for key, _ in node.value):
                raise yaml.YAMLError("a merge (<<), which may double at each level; write its keys")

    def reader(tag: str, value: Callable[[str, str], Any]) -> Callable[[Any, Any], Any]:
        return lambda loader, node: value(loader.construct_scalar(node), tag)

    if tagged is not None:
        for tag in tags:
            Plain.add_constructor(f"!{tag}", reader(tag, tagged))
    try:
        return yaml.load(text, Plain)  # a SafeLoader
    except (yaml.YAMLError, *_ODD) as error:
        reason = " ".join(str(error).split())
        raise UserError(f"{name}: not YAML: {reason}") from error
