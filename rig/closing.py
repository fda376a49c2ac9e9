"""Things that end with a ``with``."""

from typing import Self


class Closing:
    """Is closed at the end of a ``with``, whatever ends it."""

    def close(self) -> None:
        """End it, and wait until it has ended."""
        raise NotImplementedError

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
