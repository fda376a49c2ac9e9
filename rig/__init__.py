"""The real robot and its rings: check what is mounted.

The folders, the lowest first:

recording: records of what comes, the times it came, and the file that keeps them
rings: the frames that rings send, their decoders, and the serial ports they come by
robot: the robot's state, vetted, by RTDE; and its slow moves
session: robot and rings at once, gathered and recorded, and the stop conditions of a motion
sensing: readings, how they err, and what mounted sensors should read
poses: where a robot can stand clear, and the routes between
mount: how the rings are truly mounted, and which sensor is which
rod: trials with a test rod, and what they say of the coverage
simulated: a robot and its rings in a process of their own
simulated_cell: the same in the cell of a proposal, with errors of mounting and faults by a seed
check: plans, who acts, the procedure, its records, the assessment and its findings
firmware: of a ring
"""
