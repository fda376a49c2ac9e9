"""A small rig for tests: a UR10 with two rings in a cell of floor, table and box."""

from dataclasses import replace

import numpy as np
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.coverage.targets.named import Shell
from place_rings.objectives.obstacle import Obstacle
from place_rings.objectives.scene import Scene

FLOOR = Obstacle("floor", floor=-0.75)
TABLE = Obstacle("table", centre=[0.9, 0.0, -0.2], size=[0.6, 1.2, 0.05])
BOX = Obstacle("box", centre=[-0.7, 0.5, -0.45], size=[0.4, 0.5, 0.6])
SCENE = Scene.paper(obstacles=(FLOOR, TABLE, BOX))
SHELLS = replace(SCENE, targets=(Shell(0.25), Shell(0.2)))
SQUARE = Sensor(np.radians(45), 1.5, None, np.radians(30))
SETUP = Setup((Ring("forearm", 0.4, 8, 0.4, 0.0, 0.08), Ring("tool", 0.0, 6, 0.0, 0.0, 0.08)))
