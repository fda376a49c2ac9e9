"""Session with the simulated rig that is killed, or whose disk is full; it reports stored records.

Run: python benchmarks/rig_victim.py ADDRESS FILE BYTES PORT ...

BYTES limits the size of the file; 0 is no limit.
"""

import resource
import signal
import sys
import time
from pathlib import Path

from place_rings.rig.recording.recording import Recording
from place_rings.rig.rings.line_monitor import Port
from place_rings.rig.session.session import Session


def main() -> None:
    """Listen and report the number of stored records until the end."""
    address, file, most, *ports = sys.argv[1:]
    if int(most):
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (int(most), int(most)))
    failed: list[float] = []
    recording = Recording(Path(file), {}, lambda line: failed.append(time.monotonic()))
    kept, put = 0, recording.put

    def count(record):
        nonlocal kept
        put(record)
        kept += not recording.failure

    recording.put = count  # type: ignore[method-assign]
    with Session(address, [Port(name, 16) for name in ports], recording, patience=12.0) as session:
        session.link.wait()
        print("ready", flush=True)
        while not session.trouble:
            print(kept, flush=True)
            time.sleep(0.002)
        print(kept, 1000 * (time.monotonic() - failed[0]), session.trouble, flush=True)


if __name__ == "__main__":
    main()
