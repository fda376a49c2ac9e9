"""ROS 2 bags (SQLite and MCAP) and single MCAP files, read by rosbags without ROS."""

import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from ...coverage.definitions.errors import UserError, shown
from ...formats.export.ros2_bag import TEXT
from ...formats.optional_dependencies import require
from .messages import Message, RigFile, checked_time, listed, refuse
from .ros_messages import DECODERS, BadMessageError

SUFFIXES = (".mcap", ".db3")
_CHUNK = 128 << 20  # bytes, largest chunk of an MCAP file once decompressed
# bytes of all chunks of a file once decompressed: so many, and so many for each compressed one
_FREE, _RATIO = 64 << 20, 100
_LARGEST = 1 << 40  # bytes of a file
_MOST_FILES = 1000  # of a bag


def is_bag(path: Path) -> bool:
    """Whether a path is read as a bag: a folder, or a file named as one."""
    return path.is_dir() or path.suffix in SUFFIXES


def bag(path: Path, steps: str) -> RigFile:
    """Return the rig's messages in a bag's folder, or in one of its files: file by file in the
    order of names, because ``metadata.yaml`` says nothing that a check needs.

    Args:
        path: the folder or the file.
        steps: topic of the check's steps; other topics of text are skipped.

    Raises:
        UserError: if rosbags is missing, or the path holds no bag.
    """
    require("bags", f"--joints {path}", "rosbags")
    try:
        path.stat()
        there = sorted(path.iterdir()) if path.is_dir() else [path]
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {error.strerror}") from error
    files = [p for p in there if p.suffix in SUFFIXES and p.is_file()]
    if not files or len(files) > _MOST_FILES:
        packed = any(p.name.endswith(".zstd") for p in there)
        raise UserError(
            f"{path}: found {len(files)} files *.mcap or *.db3, wanted: 1 to"
            f" {_MOST_FILES}" + ("; decompress the bag with zstd -d" if packed else "")
        )

    def messages() -> Iterator[Message]:
        topics = dict[str, bool]()
        for file in files:
            yield from _messages(file, steps, topics)
        if not any(topics.values()):
            wanted = "a topic of joint states or of readings"
            raise refuse(str(path), "topics", listed(map(shown, sorted(topics)), 5), wanted)

    return RigFile(str(path), messages)


def _messages(file: Path, steps: str, topics: dict[str, bool]) -> Iterator[Message]:
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
                if c.msgtype in DECODERS and (c.msgtype != TEXT or c.topic == steps)
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

    left = [_FREE]

    def unpacked(unpack: Callable[[bytes, int], bytes], data: bytes, size: int) -> bytes:
        left[0] += _RATIO * len(data) - size
        if size > _CHUNK:
            raise ValueError(f"a chunk of {size} bytes, at most {_CHUNK} are read")
        if left[0] < 0:
            raise ValueError(
                f"chunks that unpack to more than {_RATIO} times their size; keep only the topics"
                " of the rig"
            )
        return unpack(data, size + 1)  # the caller compares with ``size``

    bounded = {"lz4": partial(unpacked, _lz4), "zstd": partial(unpacked, _zstd)}
    storage_mcap.DECOMPRESSORS.update(bounded)


def _lz4(data: bytes, most: int) -> bytes:
    import lz4.frame

    unpacked: bytes = lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=most)
    return unpacked


def _zstd(data: bytes, most: int) -> bytes:
    if sys.version_info >= (3, 14):
        from compression import zstd
    else:
        from backports import zstd

    return zstd.ZstdDecompressor().decompress(data, max_length=most)
