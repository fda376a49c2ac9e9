"""Hypothesis strategies for the objects of the laws: beams, solids, robots, rings, scenes.

A strategy, a plural, draws the arguments of a builder in whole millimetres and degrees. Hypothesis
prints a failing example as the builder's call, such as ``ring(link='forearm', tilt_deg=0, ...)``;
the call can be pasted into a test or an ``@example``. Examples shrink towards the first robot, a
pose of zeros, one ring without tilt, one beam along x at the origin.
"""
