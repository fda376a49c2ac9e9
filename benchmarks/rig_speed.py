"""Speed of the decoders, and frames lost by ten rings at once."""

import time

import numpy as np
from place_rings.rig.rings.firmware_decoders import DECODERS, decoder
from place_rings.rig.rings.line_monitor import Port
from place_rings.rig.rings.ports import RingReaders
from place_rings.rig.simulated.ports import ENCODERS
from place_rings.rig.simulated.process import SimulatedRig, command
from rig_found import PLAIN


def throughput() -> list[tuple]:
    """Measure each decoder and ten rings.

    Decoders read frames of 16 sensors in pieces of 64 bytes; ten rings send at 100 Hz through
    serial ports.
    """
    rows, rng = [], np.random.default_rng(0)
    distance, status = np.round(rng.uniform(0.1, 3, (5000, 16)), 3), np.zeros(16, int)
    for name in DECODERS:
        data = b"".join(ENCODERS[name](i, i / 100, distance[i], status) for i in range(5000))
        best = np.inf
        for _ in range(5):
            reader, start = decoder(name, 16), time.perf_counter()
            count = sum(len(reader.feed(data[i : i + 64], 0.0)) for i in range(0, len(data), 64))
            best = min(best, time.perf_counter() - start)
        rows.append(
            (
                f"decoder `{name}`",
                f"{count / best:,.0f} frames/s",
                f"{len(data) / best / 1e6:.2f} MB/s",
                "",
            )
        )
    data, reader, start = rng.bytes(10**7), decoder("place-rings", 16), time.perf_counter()
    count = sum(len(reader.feed(data[i : i + 1024], 0.0)) for i in range(0, len(data), 1024))
    rows.append(
        (
            "random bytes, 10⁷",
            f"{count} frames",
            f"{10 / (time.perf_counter() - start):.0f} MB/s",
            "0 exceptions",
        )
    )
    with SimulatedRig((PLAIN, command(10, 16, 100.0))) as rig:
        with RingReaders([Port(rig.ring(i), 16) for i in range(10)]) as rings:
            time.sleep(1)
            first, cpu, start = (
                sum(c.frames for c in rings.counts),
                time.process_time(),
                time.monotonic(),
            )
            time.sleep(20)
            counts, seconds = rings.counts, time.monotonic() - start
            frames, used = sum(c.frames for c in counts) - first, time.process_time() - cpu
            bad = sum(c.lost + c.late + c.corrupt for c in counts)
            dropped = sum(rig.do("counts")["dropped"])
        share = f"{100 * used / seconds:.0f} % of a core"
        rows.append(
            (
                "ten rings at 100 Hz, 20 s",
                f"{frames / seconds:,.0f} frames/s",
                share,
                f"{bad + dropped} frames lost",
            )
        )
    return rows
