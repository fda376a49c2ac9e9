"""Forward kinematics: against the DH product, between the two chains, derivatives."""

import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.robots.built_in import ROBOTS, UR10, UR10_DH, robot
from place_rings.coverage.robots.kinematics import forward, joint_origins
from scipy.spatial.transform import Rotation

from ..strategies.rings import LONGEST, poses

CB3 = [
    (0.1273, 0, 90),
    (0, -0.612, 0),
    (0, -0.5723, 0),
    (0.163941, 0, 90),
    (0.1157, 0, -90),
    (0.0922, 0, 0),
]


def dh_product(q):
    """The table's frames P_1 ... P_6 by textbook matrices."""
    T, points = np.eye(4), [np.zeros(3)]
    for theta, (d, a, alpha_deg) in zip(q, CB3, strict=True):
        turn, link = np.eye(4), np.eye(4)
        turn[:3, :3] = Rotation.from_euler("z", theta).as_matrix()
        link[:3, :3] = Rotation.from_euler("x", alpha_deg, degrees=True).as_matrix()
        link[:3, 3] = a, 0, d
        T = T @ turn @ link
        points.append(T[:3, 3])
    return T, np.array(points)


@given(poses())
def test_dh_chain_is_the_dh_product(q):
    T, points = dh_product(q)
    assert np.allclose(forward(UR10_DH.chain, q)[-1], T, atol=1e-12)
    assert np.allclose(joint_origins(UR10_DH.chain, q), points, atol=1e-12)


def test_reference_pose(reference_pose):
    expected = [
        (0, 0, 0),
        (0, 0, 0.127),
        (0, 0.221, 0.127),
        (0.433, 0.049, 0.560),
        (0.986, 0.049, 0.412),
    ]
    expected += [(0.986, 0.164, 0.412), (1.101, 0.164, 0.412), (1.101, 0.164, 0.320)]
    assert np.allclose(joint_origins(UR10.chain, reference_pose), expected, atol=6e-4)


@settings(max_examples=2)
@given(st.lists(poses(LONGEST), min_size=3, max_size=3))
def test_frames_are_rigid_and_batches_agree(some):
    for r in ROBOTS.values():
        q = np.stack(some)[:, : len(r.chain)]
        T = forward(r.chain, q)
        R = T[..., :3, :3]
        assert np.allclose(R @ np.swapaxes(R, -1, -2), np.eye(3), atol=1e-12)
        assert np.allclose(np.linalg.det(R), 1)
        assert np.allclose(T, np.stack([forward(r.chain, one) for one in q]), atol=1e-12)
        assert np.allclose(T, forward(r.chain, jnp.asarray(q)), atol=1e-12)


def test_wrong_number_of_angles_and_unknown_names_are_refused(reference_pose):
    with pytest.raises(ValueError, match=r"5\b.* 6\b"):
        forward(UR10.chain, reference_pose[:5])
    with pytest.raises(ValueError, match=r"r2d2.* ur10_dh"):
        robot("r2d2")
    with pytest.raises(ValueError, match=r"tail.* upper_arm, forearm, tool"):
        UR10.mount("tail")
