"""Check the rings that are mounted on a real robot.

The subpackages, lowest first:

closing: what ends with a ``with``
recording: records of received data, time stamps, and the file that stores them
rings: the frames of the ring protocol, decoders, and serial ports
robot: the robot's state over RTDE, validated, and slow motions
session: robot and rings together, collected and recorded, and the stop conditions of a motion
sensing: readings, their noise model, and the expected readings of mounted sensors
sources: joint states and readings from ROS 2 bags, MCAP and CSV, gathered as a session gathers them
poses: collision-free poses of a robot, and the routes between them
mount: estimates of how each ring is mounted and which sensor is which
rod: trials with a test rod, and the coverage estimated from them
simulated: a robot and its rings in a process of their own
simulated_cell: the same in the cell of a proposal, with mounting errors and faults drawn by a seed
check: plans, actors, procedure, records, assessment and findings
"""
