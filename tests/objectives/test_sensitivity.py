"""What small errors of a ring cost, against exact counts."""

import math
from dataclasses import replace

import pytest
from place_rings.coverage.rings.ring import Setup, named_setup
from place_rings.objectives.scene import Scene
from place_rings.objectives.sensitivity import SHIFT, TURN, sensitivity
from place_rings.objectives.verify import Verifier

OFF = 6e-4  # of a share, by degree: points and voxels of 1 cm differ by as much


@pytest.mark.slow
def test_it_is_what_exact_counts_lose():
    scene, setup = Scene(), named_setup("n2_16_25")
    verifier = Verifier(scene, 0.01)
    whole = verifier.judge(setup)[1]

    def lost(i, key, by):
        """Coverage lost by the worse direction."""
        ring, ends = setup.rings[i], []
        for sign in (-1, 1):
            there = replace(ring, **{key: getattr(ring, key) + sign * by})
            rings = (*setup.rings[:i], there, *setup.rings[i + 1 :])
            ends.append(verifier.judge(Setup(rings))[1])
        return max(whole - min(ends), 0.0)

    for i, found in enumerate(sensitivity(scene, setup)):
        turned = max(lost(i, key, TURN) for key in ("tilt", "phase")) / math.degrees(TURN)
        assert found.per_degree == pytest.approx(turned, abs=OFF)
        if length := scene.robot.mount(found.link).length:
            moved = lost(i, "position", SHIFT / length) / (1000 * SHIFT)
            assert found.per_mm == pytest.approx(moved, abs=OFF / 4)
