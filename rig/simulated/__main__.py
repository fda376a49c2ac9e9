"""Simulated rig in the simplest environment.

Run: python -m place_rings.rig.simulated FOLDER [ADDRESS RINGS SENSORS RATE SEED ENCODING]

The process reads messages as JSON from stdin.
"""

import sys
from pathlib import Path

import numpy as np

from .environment import PlainWorld
from .serve import Rig, serve

_HOME = np.radians([0.0, -45.0, 60.0, -105.0, -90.0, 0.0])


def main() -> None:
    """Serve a rig with the settings of the command line."""
    given = dict(
        zip(
            ("folder", "address", "rings", "sensors", "rate", "seed", "encoding"),
            sys.argv[1:],
            strict=False,
        )
    )
    serve(
        Rig(
            PlainWorld(int(given.get("rings", 5)), int(given.get("sensors", 16))),
            _HOME,
            Path(given["folder"]),
            given.get("address", "127.0.0.1"),
            float(given.get("rate", 15)),
            (given.get("encoding", "place-rings"),),
            seed=int(given.get("seed", 0)),
        )
    )


if __name__ == "__main__":
    main()
