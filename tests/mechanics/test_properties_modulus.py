"""Shear modulus along a direction: half a turn, a quarter turn, the three angles that give the mean."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from jamlab.mechanics.elasticity import AVERAGING_ANGLES, modulus_along

angles = st.floats(-10, 10)


@st.composite
def tensors(draw, rotations=True):
    """C of a random energy with major symmetry; without rotations it depends on the symmetric strain alone."""
    root = np.random.default_rng(draw(st.integers(0, 2**32 - 1))).normal(size=(3, 2, 2))
    if not rotations:
        root = root + root.transpose(0, 2, 1)
    return np.einsum("aij,akl->ijkl", root, root)


@given(tensors(), angles)
def test_half_a_turn_changes_nothing(c, angle):
    np.testing.assert_allclose(*(modulus_along(c, np.array([a])) for a in (angle, angle + np.pi)), rtol=1e-9, atol=1e-9)


@given(tensors(rotations=False), angles)
def test_a_quarter_turn_changes_nothing_where_rotation_costs_nothing(c, angle):
    along, across = (modulus_along(c, np.array([a])) for a in (angle, angle + np.pi / 2))
    np.testing.assert_allclose(along, across, rtol=1e-9, atol=1e-9)


@given(tensors())
def test_modulus_is_the_curvature_along_one_simple_shear(c):
    """Shear along x is E = e_x e_y^T, along y -e_y e_x^T."""
    np.testing.assert_allclose(modulus_along(c, np.array([0.0, np.pi / 2])), [c[0, 1, 0, 1], c[1, 0, 1, 0]], rtol=1e-12)


@given(tensors(), angles)
def test_averaging_angles_average(c, start):
    many = np.linspace(0, np.pi, 360, endpoint=False)
    np.testing.assert_allclose(
        modulus_along(c, AVERAGING_ANGLES + start).mean(), modulus_along(c, many).mean(), rtol=1e-9
    )
