"""Things that end with a ``with``."""

from abc import ABC, abstractmethod
from typing import Self


class Closing(ABC):
    """Is closed at the end of a ``with``, whatever ends it."""

    @abstractmethod
    def close(self) -> None:
        """End it, and wait until it has ended."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
