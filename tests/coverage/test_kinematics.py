"""Forward kinematics: against the DH product, between the two chains, derivatives."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.robots.built_in import ROBOTS, UR10, UR10_DH, robot
from place_rings.coverage.robots.kinematics import forward, joint_origins

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
        ct, st, ca, sa = (
            math.cos(theta),
            math.sin(theta),
            math.cos(math.radians(alpha_deg)),
            math.sin(math.radians(alpha_deg)),
        )
        T = T @ np.array(
            [
                [ct, -st * ca, st * sa, a * ct],
                [st, ct * ca, -ct * sa, a * st],
                [0, sa, ca, d],
                [0, 0, 0, 1],
            ]
        )
        points.append(T[:3, 3])
    return T, np.array(points)


@given(poses())
def test_dh_chain_is_the_dh_product(q):
    T, points = dh_product(q)
    assert np.allclose(forward(UR10_DH.chain, q)[-1], T, atol=1e-12)
    assert np.allclose(joint_origins(UR10_DH.chain, q), points, atol=1e-12)


@given(poses())
def test_both_chains_have_one_tcp(q):
    """The URDF's base frame is the table's, turned by half a turn about z."""
    half_turn = np.diag([-1.0, -1, 1])
    tcp, tcp_dh = (forward(r.chain, q)[-1, :3, 3] for r in (UR10, UR10_DH))
    # the URDF's offsets are rounded to a tenth of a millimetre
    assert np.allclose(tcp, half_turn @ tcp_dh, atol=1e-4)


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


@settings(max_examples=3)
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


@settings(max_examples=5)
@given(poses())
def test_derivative_by_q_is_the_central_difference(q):
    slope = jax.jacobian(lambda x: forward(UR10.chain, x)[-1, :3, 3])(jnp.asarray(q))
    step = 1e-6
    for j in range(6):
        e = step * np.eye(6)[j]
        difference = (forward(UR10.chain, q + e) - forward(UR10.chain, q - e))[-1, :3, 3] / (
            2 * step
        )
        assert np.allclose(slope[:, j], difference, atol=1e-8)


def test_wrong_number_of_angles_and_unknown_names_are_refused(reference_pose):
    with pytest.raises(ValueError, match="5 values"):
        forward(UR10.chain, reference_pose[:5])
    with pytest.raises(ValueError, match="known: ur10, ur10_dh, ur3"):
        robot("r2d2")
    with pytest.raises(ValueError, match="upper_arm, forearm, tool"):
        UR10.mount("tail")
