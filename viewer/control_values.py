"""Values and labels of controls."""

from collections.abc import Sequence
from typing import Protocol

from ..formats.escaping import printable


class Control(Protocol):
    """A control that shows a value."""

    @property
    def value(self) -> str | float: ...


def set_value(control: Control, value: str | float) -> None:
    """Set the value that a control shows."""
    # mypy takes the value for read-only: viser's setter does not directly follow its getter
    control.value = value  # type: ignore[misc]


def labelled(names: Sequence[str]) -> dict[str, str]:
    """Return each name by its printable text; a later one with the same text gets its number,
    too.
    """
    found = dict[str, str]()
    for i, name in enumerate(names):
        label = printable(name)
        while label in found:
            label += f" ({i})"
        found[label] = name
    return found
