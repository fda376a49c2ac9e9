"""How many threads a computation takes."""

import os


def processors() -> int:
    """The processors that this process may use; fewer where ``OMP_NUM_THREADS`` says so, as it does
    for NumPy's own threads and in every worker of a cluster."""
    usable = (
        len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    )
    asked = os.environ.get("OMP_NUM_THREADS", "").partition(",")[0].strip()
    return max(min(usable, int(asked)), 1) if asked.isdecimal() else usable
