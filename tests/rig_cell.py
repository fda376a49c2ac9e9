"""A small rig for tests: a UR10 with two rings in a cell of floor, table and box."""

import numpy as np
from place_rings.coverage.polyhedra import box, half_space
from place_rings.coverage.rings import Ring, Setup
from place_rings.coverage.sensors import Sensor
from place_rings.objectives.scene import Obstacle, Scene

FLOOR = Obstacle("floor", half_space(-0.75))
TABLE = Obstacle("table", box((0.9, 0.0, -0.2), (0.6, 1.2, 0.05)))
BOX = Obstacle("box", box((-0.7, 0.5, -0.45), (0.4, 0.5, 0.6)))
SCENE = Scene(obstacles=(FLOOR, TABLE, BOX))
SQUARE = Sensor(np.radians(45), 1.5, None, np.radians(30))
SETUP = Setup((Ring("forearm", 0.4, 8, 0.4, 0.0, 0.08), Ring("tool", 0.0, 6, 0.0, 0.0, 0.08)))
