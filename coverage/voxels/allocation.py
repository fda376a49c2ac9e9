"""Memory allocation of large temporary arrays: the process keeps freed memory for reuse.

The C library of Linux returns blocks above 128 KB to the system when they are freed. The next array
of that size then causes a page fault for every 4 KB, which costs as much as the arithmetic on it.
"""

import ctypes
import sys
from functools import cache

_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3  # constants of glibc's malloc.h
_KEEP = 1 << 28  # bytes of freed memory that the process may keep
_SHARED = 1 << 25  # bytes, the largest block that the C library allocates from kept memory


@cache
def keep_freed_memory() -> bool:
    """Let this process keep up to 256 MB of freed memory.

    Returns:
        False if the C library has no such setting.
    """
    if not sys.platform.startswith("linux"):
        return False
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (OSError, AttributeError):
        return False
    return bool(mallopt(_MMAP_THRESHOLD, _SHARED)) and bool(mallopt(_TRIM_THRESHOLD, _KEEP))
