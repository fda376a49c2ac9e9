"""Trees of arrays: JAX and ``mapped`` see the same leaves, with JAX loaded before or after."""

import subprocess
import sys

import jax
import numpy as np
import pytest
from hypothesis import given
from place_rings.coverage.pytrees import mapped
from place_rings.coverage.solids.base import Difference, Union

from ..strategies.solids import some_balls, some_cones

_LATE = """
import sys
import numpy as np
from place_rings.coverage.solids.spheres import Spheres
assert "jax" not in sys.modules
import jax
from place_rings.coverage.{} import *
assert len(jax.tree.leaves(Spheres(np.zeros((1, 3)), np.ones(1)))) == 2
"""


@given(some_cones(1, 3), some_balls(1, 2))
def test_mapped_is_jaxs_map(cones, balls):
    for solid in (cones, Union(cones, balls), Difference(Union(balls, cones), balls)):
        ours, theirs = (each(lambda a: 2 * a[:1], solid) for each in (mapped, jax.tree.map))
        assert jax.tree.structure(ours) == jax.tree.structure(theirs)
        for a, b in zip(jax.tree.leaves(ours), jax.tree.leaves(theirs), strict=True):
            assert np.array_equal(a, b)
    assert mapped(len, (cones.apex, None)) == (len(cones), None)


@pytest.mark.parametrize("module", ["soft.beams", "occlusion.ranging"])
def test_a_class_that_was_there_before_jax_is_a_tree_for_modules_that_trace(module):
    subprocess.run([sys.executable, "-c", _LATE.format(module)], check=True)
