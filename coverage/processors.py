"""The number of threads that a computation uses."""

import os


def processors() -> int:
    """Return the number of processors that this process may use.

    ``OMP_NUM_THREADS`` lowers it, as it does for NumPy's threads and in every cluster worker.
    """
    usable = (
        len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    )
    limit = os.environ.get("OMP_NUM_THREADS", "").partition(",")[0].strip()
    return max(min(usable, int(limit)), 1) if limit.isdecimal() else usable
