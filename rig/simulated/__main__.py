"""Simulated rig in the simplest environment.

Run: python -m place_rings.rig.simulated FOLDER ADDRESS RINGS SENSORS RATE SEED ENCODING

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
    folder, address, rings, sensors, rate, seed, encoding = sys.argv[1:]
    world = PlainWorld(int(rings), int(sensors))
    serve(Rig(world, _HOME, Path(folder), address, float(rate), encoding, int(seed)))


if __name__ == "__main__":
    main()
