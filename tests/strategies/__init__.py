"""Hypothesis strategies for the objects of the laws: beams, solids, robots, rings, scenes.

A strategy, a plural, draws the arguments of a builder in whole millimetres and degrees. Hypothesis
prints a failing example as the builder's call, such as ``beam(apex_mm=(0, 0, 0), ...)``, or as the
object's own text where that is shorter, as a ``Ring`` is; both can be pasted into a test or an
``@example``. Examples shrink towards the first robot, a pose of zeros, one ring without tilt, one
beam along x at the origin.
"""
