"""Memory of many searches in one process: what a search made is let go of when it ends.

``PLACE_RINGS_SEARCHES=500 pytest -m slow -s tests/placement/test_memory.py`` runs more of them,
and shows the memory after every tenth.
"""

import os
import subprocess
import sys

import pytest

SEARCHES = int(os.environ.get("PLACE_RINGS_SEARCHES", "60"))
WARM = 40  # searches until everything is compiled and the caches of few entries are full
MOST = 24  # MB that all others may add
# A search of all stages with few points, each in another scene: another pose, target and count.
MANY = """
import gc, sys
import jax, numpy as np, psutil
import place_rings as pr
from place_rings.placement.search import search
from place_rings.placement.search.schedule import Round

short = (Round(1024, 20, 1, 4, 0.3, 4), Round(2048, 20, 1, 4, 0.1))
search.usual = lambda *_: short
joints = np.array([0.0, -45.0, 60.0, -105.0, -90.0, 0.0])
for i in range(int(sys.argv[1])):
    turned = joints + np.random.default_rng(i).uniform(-10, 10, 6)
    scene = pr.Scene(
        targets=[pr.Shell(0.3 + 0.002 * (i % 100))], poses=[pr.Pose(np.radians(turned))]
    )
    pr.search(scene, rings=1 + i % 3, sensors_per_ring=4 + i % 2, effort=0.1, voxel=0.1, seed=i)
    if i % 10 == 9:
        gc.collect()
        memory = psutil.Process().memory_info().rss / 2**20
        print(i + 1, round(memory, 1), len(jax.live_arrays()), flush=True)
"""


@pytest.mark.slow
def test_memory_does_not_grow_with_the_number_of_searches():
    rows = []
    with subprocess.Popen(
        [sys.executable, "-c", MANY, str(max(SEARCHES, WARM + 10))],
        stdout=subprocess.PIPE,
        text=True,
    ) as run:
        assert run.stdout is not None
        for line in run.stdout:
            number, memory, arrays = line.split()
            rows.append((int(number), float(memory), int(arrays)))
            print(f"after {number} searches: {memory} MB, {arrays} arrays of JAX")
    assert run.returncode == 0
    assert {arrays for _, _, arrays in rows} == {rows[0][2]}
    late = [memory for number, memory, _ in rows if number >= WARM]
    assert max(late) - late[0] < MOST
