"""Keeps the messages to a browser coming: a repair of viser 1.1."""

import asyncio

import viser
from viser.infra._async_message_buffer import AsyncMessageBuffer


class WakeUp(asyncio.Event):
    """An event that only the thread of its event loop sets.

    An ``asyncio.Event`` is not made for several threads. Set from another thread while the loop is
    about to wait for it, it stays set while the loop sleeps, and no later ``set`` wakes the loop:
    the browser gets no message any more. viser sets it twice, in the caller's thread and then in
    the loop's. The second is enough.
    """

    def set(self) -> None:
        """Wake the loop; without effect in another thread."""
        try:
            asyncio.get_running_loop()
        except RuntimeError:
            return
        super().set()


def keep_awake(client: viser.ClientHandle) -> None:
    """Let no message to a client be left waiting for ever."""
    buffer = client._websock_connection.get_message_buffer()
    assert isinstance(buffer, AsyncMessageBuffer)
    old, buffer.message_event = buffer.message_event, WakeUp()

    def wake() -> None:
        old.clear()
        old.set()  # whoever waits for the old one goes on and waits for the new one
        buffer.message_event.set()

    buffer.event_loop.call_soon_threadsafe(wake)
