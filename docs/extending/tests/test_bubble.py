"""The drag against Durian's formula, and G* against an oscillation in time."""

import numpy as np
import pytest
from jamlab_example.bubble import BubbleDrag

import jamlab


@pytest.fixture(scope="module")
def packing() -> jamlab.Packing:
    return jamlab.pack(16, 1e-2, seed=1, ensemble="shear-stabilized")


def test_power_is_that_of_relative_velocities(packing: jamlab.Packing) -> None:
    n, rate, touching = packing.n, 0.3, jamlab.contacts(packing)
    velocity = np.random.default_rng(1).normal(size=(n, 2))
    i, j = touching.pairs.T
    relative = velocity[j] - velocity[i] + rate * touching.r[:, [1]] * [1, 0]
    spins = np.random.default_rng(2).normal(size=n)  # without effect
    power = BubbleDrag(tau=2.0).power(packing, np.concatenate([velocity.ravel(), spins, [rate]]))
    assert power == pytest.approx(2.0 * packing.params["k"] * np.sum(relative**2), rel=1e-12)


def test_modulus_is_that_of_an_oscillation(packing: jamlab.Packing) -> None:
    linear = jamlab.complex_modulus(packing, 1.0, BubbleDrag())
    run = jamlab.oscillate(packing, 1.0, 1e-7, BubbleDrag(), tolerance=1e-5)
    assert run.storage == pytest.approx(linear.storage[0], rel=1e-4)
    assert run.loss == pytest.approx(linear.loss[0], rel=1e-4)
