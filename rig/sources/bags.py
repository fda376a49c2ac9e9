"""ROS 2 bags (SQLite and MCAP) and single MCAP files, read by rosbags without ROS."""

from collections.abc import Callable, Iterator
from pathlib import Path

from ...coverage.definitions.errors import UserError, shown
from ...formats.optional_dependencies import require
from .messages import Message, checked_time, refuse
from .ros_messages import DECODERS, TEXT, BadMessageError

SUFFIXES = (".mcap", ".db3")
_CHUNK = 128 << 20  # bytes, largest chunk of an MCAP file once decompressed
# bytes of all chunks of a file once decompressed: so many, and so many for each compressed one
_FREE, _RATIO = 64 << 20, 100
_LARGEST = 1 << 40  # bytes of a file
_MOST_FILES = 1000  # of a bag


def is_bag(path: Path) -> bool:
    """Whether a path is read as a bag: a folder, or a file named as one."""
    return path.is_dir() or path.suffix in SUFFIXES


class Bag:
    """A bag's folder, or one of its files.

    Each file is read on its own, because ``metadata.yaml`` says nothing that a check needs.

    Args:
        path: the folder or the file.
        steps: topic of the check's steps; other topics of text are skipped.

    Raises:
        UserError: if rosbags is missing, or the path holds no bag.
    """

    def __init__(self, path: Path, steps: str) -> None:
        require("bags", f"--joints {path}", "rosbags")
        self.name, self._steps = str(path), steps
        try:
            path.stat()
            files = sorted(path.iterdir()) if path.is_dir() else [path]
        except OSError as error:
            raise UserError(f"{path}: cannot be read: {error.strerror}") from error
        self._files = [p for p in files if p.suffix in SUFFIXES and p.is_file()]
        if not self._files or len(self._files) > _MOST_FILES:
            packed = any(p.name.endswith(".zstd") for p in files)
            raise UserError(
                f"{path}: found {len(self._files)} files *.mcap or *.db3, wanted: 1 to"
                f" {_MOST_FILES}" + ("; decompress the bag with zstd -d" if packed else "")
            )

    def messages(self) -> Iterator[Message]:
        """Yield the rig's messages, file by file in the order of names."""
        topics = dict[str, bool]()
        for file in self._files:
            yield from self._of(file, topics)
        if not any(topics.values()):
            some = ", ".join(map(shown, sorted(topics)[:5])) + ", …" * (len(topics) > 5)
            wanted = "a topic of joint states or of readings"
            raise refuse(self.name, "topics", some or "none", wanted)

    def _of(self, file: Path, topics: dict[str, bool]) -> Iterator[Message]:
        """Yield the messages of one file, and note in ``topics`` which are read; whatever the
        library raises is one line.
        """
        from rosbags.rosbag2 import Reader

        name = str(file)
        _limit_chunks()
        try:
            if file.stat().st_size > _LARGEST:
                raise refuse(name, "the file", "more than 1 TiB", "less; split the bag")
            with Reader(file) as reader:
                ours = [
                    c
                    for c in reader.connections
                    if c.msgtype in DECODERS and (c.msgtype != TEXT or c.topic == self._steps)
                ]
                topics |= {c.topic: False for c in reader.connections if c not in ours}
                topics |= {c.topic: True for c in ours}
                if not ours:
                    return
                for connection, nanoseconds, data in reader.messages(ours):
                    topic = connection.topic
                    where = f"topic {shown(topic)}"
                    time = checked_time(name, where, 1e-9 * nanoseconds)
                    if not isinstance(data, bytes | bytearray | memoryview):
                        raise refuse(name, where, f"a {type(data).__name__}", "a message in CDR")
                    try:
                        yield DECODERS[connection.msgtype](topic, time, bytes(data))
                    except BadMessageError as error:
                        raise UserError(f"{name}: {where} at {time:.3f} s: {error}") from error
        except UserError:
            raise
        except Exception as error:  # the library raises of many kinds on a damaged file
            text = " ".join(str(error).split())[:200] or type(error).__name__
            kind = "an MCAP file with the profile ros2" if file.suffix == ".mcap" else "SQLite"
            raise UserError(
                f"{name}: found a damaged file ({text}), wanted: {kind}, complete to its end"
            ) from error


def _limit_chunks() -> None:
    """Replace rosbags' decompressors, which have no limit, by bounded ones: a file of a few bytes
    could otherwise fill the memory.
    """
    from rosbags.rosbag2 import storage_mcap

    budget = _Budget()
    storage_mcap.DECOMPRESSORS.update(lz4=_bounded(_lz4, budget), zstd=_bounded(_zstd, budget))


class _Budget:
    """What the chunks of one file may have in all once decompressed."""

    def __init__(self) -> None:
        self._left = _FREE

    def take(self, packed: int, size: int) -> None:
        """Count a chunk of ``packed`` bytes that has ``size`` once decompressed.

        Raises:
            ValueError: if that is too much.
        """
        self._left += _RATIO * packed - size
        if size > _CHUNK:
            raise ValueError(f"a chunk of {size} bytes, at most {_CHUNK} are read")
        if self._left < 0:
            raise ValueError(
                f"chunks that unpack to more than {_RATIO} times their size; keep only the topics"
                " of the rig"
            )


def _bounded(
    unpack: Callable[[bytes, int], bytes], budget: _Budget
) -> Callable[[bytes, int], bytes]:
    def unpacked(data: bytes, size: int) -> bytes:
        budget.take(len(data), size)
        return unpack(data, size + 1)  # the caller compares with ``size``

    return unpacked


def _lz4(data: bytes, most: int) -> bytes:
    import lz4.frame

    unpacked: bytes = lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=most)
    return unpacked


def _zstd(data: bytes, most: int) -> bytes:
    from backports import zstd

    return zstd.ZstdDecompressor().decompress(data, max_length=most)
