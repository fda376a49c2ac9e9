"""Values and labels of controls."""

from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import viser
from viser import _messages
from viser._gui_handles import GuiProgressBarHandle

from ..coverage.definitions.escaping import printable
from .closing import closing


def set_value(
    control: viser.GuiInputHandle[Any] | GuiProgressBarHandle,
    value: str | float,
    nearly: float = 0.0,
) -> None:
    """Set the value that a control shows, soon. Nothing is called: the user did not change it.

    It is set in viser's own thread, where nothing comes between the moment when viser stores the
    user's value and the moment when the page reads it.

    Args:
        control: the control.
        value: its new value.
        nearly: a number that differs by no more than this stays as it is.
    """
    impl = control._impl
    value = type(impl.value)(value)
    interface = impl.gui_api._websock_interface

    def set_now() -> None:
        old = impl.value
        if old == value or (nearly and abs(old - value) <= nearly):
            return
        impl.value = value
        with closing():
            interface.queue_message(_messages.GuiUpdateMessage(impl.uuid, {"value": value}))

    with suppress(RuntimeError):  # the server has ended
        interface.get_message_buffer().event_loop.call_soon_threadsafe(set_now)


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
