"""Searches in the paper's world: ours, CMA-ES, differential evolution and others.

Run: python benchmarks searches_paper    hours; options as in searches.py
"""

from functools import partial

from searches import report as _report

report = partial(_report, world="paper")
