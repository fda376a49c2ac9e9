"""Values and labels of controls, and what happens after the user changed one."""

from collections.abc import Callable, Sequence
from typing import Any

import viser
from viser import _messages
from viser._gui_handles import GuiProgressBarHandle

from ..formats.escaping import printable


def set_value(
    control: viser.GuiInputHandle[Any] | GuiProgressBarHandle, value: str | float
) -> None:
    """Set the value that a control shows. Nothing is called: the user did not change it."""
    impl = control._impl
    value = type(impl.value)(value)
    if impl.value != value:
        update = _messages.GuiUpdateMessage(impl.uuid, {"value": value})
        impl.gui_api._websock_interface.queue_message(update)
        impl.value = value


class UserChanges:
    """Calls actions with the values to which the user changed the controls of a page.

    viser stores the user's value in the control, and calls back a little later in another thread.
    In between the page may draw, and set the control to what it knew before. So the value is read
    at once, in viser's own thread.
    """

    def __init__(self) -> None:
        self._controls: list[viser.GuiInputHandle[Any]] = []

    def on(self, control: viser.GuiInputHandle[Any], act: Callable[[Any], None]) -> None:
        """Call ``act`` with the newest value after the user changed it, not after the page did."""
        newest = [control.value]

        async def heard(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:
                newest[0] = control.value

        def changed(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:
                act(newest[0])

        control.on_update(heard)
        control.on_update(changed)
        self._controls.append(control)

    def close(self) -> None:
        """Call nothing any more."""
        for control in self._controls:
            control.remove_update_callback()


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
