"""Modes of the Hessian against dense eigenvalues, and the number of zero modes against counting."""

import numpy as np
import pytest

import jamlab
from jamlab.mechanics import vibrations


@pytest.fixture(scope="module")
def small():
    """32 disks: all eigenvalues at once."""
    return jamlab.pack(32, 1e-3, seed=3)


@pytest.fixture(scope="module")
def large():
    """216 disks, two rattlers: a few eigenvalues by iteration."""
    return jamlab.pack(216, 1e-2, seed=1)


@pytest.fixture(params=["small", "large"])
def packing(request):
    return request.getfixturevalue(request.param)


@pytest.fixture(scope="module")
def onset():
    """16 disks at onset with one rattler that touches nothing."""
    return jamlab.jam(16, "sp", seed=1)


@pytest.fixture(scope="module")
def mechanisms(touching):
    """Function that counts displacements that stretch no contact: 2 n minus the rank of the rigidity matrix."""

    def count(p):
        rows = []
        for i, j, r in touching(p):
            rows.append(np.zeros((p.n, 2)))
            rows[-1][j] += r / np.hypot(*r)
            rows[-1][i] -= r / np.hypot(*r)
        return 2 * p.n - np.linalg.matrix_rank(np.reshape(rows, (len(rows), -1)), tol=1e-6)

    return count


@pytest.mark.parametrize("count", [1, 6, 20])
@pytest.mark.parametrize("prestress", [True, False])
def test_lowest_modes_are_those_of_the_dense_matrix(packing, count, prestress):
    """Values by LAPACK; every mode solves H v = lambda v; modes are orthonormal."""
    modes = jamlab.lowest_modes(packing, count, prestress=prestress)
    h = jamlab.hessian(packing, prestress=prestress).toarray()
    values = np.linalg.eigvalsh(h)
    assert modes.eigenvalues.shape == (count,) and modes.vectors.shape == (count, packing.n, 2)
    assert np.all(np.diff(modes.eigenvalues) >= 0)
    assert np.abs(modes.eigenvalues - values[:count]).max() < 1e-12 * values[-1]
    v = modes.vectors.reshape(count, -1)
    assert np.abs(v @ h - modes.eigenvalues[:, None] * v).max() < 1e-10 * values[-1]
    assert np.abs(v @ v.T - np.eye(count)).max() < 1e-10


def test_what_touches_nothing_has_zero_modes_alone():
    places = 2.0 * np.stack(np.meshgrid(*[np.arange(16)] * 2), -1).reshape(-1, 2)
    loose = jamlab.Packing("sp", 32 * np.eye(2), places, {"k": 1.0}, "k", np.ones(256))
    modes = jamlab.lowest_modes(loose, 4)
    v = modes.vectors.reshape(4, -1)
    assert not modes.eigenvalues.any() and np.array_equal(v @ v.T, np.eye(4))


def test_instability_is_a_negative_mode(random_disks):
    """Between minima; both ways of computing, 30 and 230 disks."""
    for n in (30, 230):
        p = random_disks(n=n, phi=1.0)
        values = np.linalg.eigvalsh(jamlab.hessian(p).toarray())
        assert values[2] < -1e-3
        assert jamlab.lowest_modes(p, 5).eigenvalues == pytest.approx(values[:5], rel=1e-8)
        assert n > 30 or jamlab.count_zero_modes(p) == np.sum(
            np.abs(values) < 1e-9 * values[-1]
        )  # without negative ones


def test_modes_of_droplets(dp_dense):
    """Vertices; perimeter, area and contact terms."""
    modes = jamlab.lowest_modes(dp_dense, 6)
    values = np.linalg.eigvalsh(jamlab.hessian(dp_dense).toarray())
    assert modes.vectors.shape == (6, len(dp_dense.positions), 2)
    assert np.abs(modes.eigenvalues - values[:6]).max() < 1e-11 * values[-1]
    assert np.abs(modes.eigenvalues[:2]).max() < 1e-10 * values[-1] < modes.eigenvalues[2]


def test_counting_at_onset(onset, mechanisms):
    """2 N' coordinates, N_c = 2 N' - 1 contacts, one state of self stress: two translations remain."""
    c = jamlab.contacts(onset)
    assert c.rattlers.sum() == 1
    counted = 2 * c.n_backbone - c.n_contacts + 1 + 2 * c.rattlers.sum()
    assert counted == 2 + 2 * c.rattlers.sum()
    assert jamlab.count_zero_modes(onset, prestress=False) == counted == mechanisms(onset)


@pytest.mark.parametrize("removed", [1, 2, 3])
def test_mechanisms_of_a_broken_network(onset, removed, mechanisms):
    """Disks shrunk until they lose their contacts: every missing constraint is a mechanism, the rank says how many."""
    held = np.flatnonzero(~jamlab.contacts(onset).rattlers)[:removed]
    d = onset.diameters.copy()
    d[held] *= 0.5
    broken = onset.with_state(diameters=d)
    wanted = mechanisms(broken)
    assert wanted > mechanisms(onset)
    assert jamlab.count_zero_modes(broken, prestress=False) == wanted


@pytest.mark.parametrize("count", [0, -1, 65, 1000, 2.0, True, "x"])
def test_bad_count_is_refused(small, count):
    """Named; there are as many modes as coordinates."""
    with pytest.raises(jamlab.InputError, match=f"count = {count!r}"):
        jamlab.lowest_modes(small, count)


@pytest.mark.parametrize("missed", range(3, 8))
def test_a_mode_that_the_iteration_missed_is_noticed(monkeypatch, missed):
    """Though the next one, found instead, lies within a thousandth of the largest."""
    packing, found = jamlab.pack(128, 1e-3, 1), vibrations.eigsh

    def forgetful(matrix, k, **how):
        values, vectors = found(matrix, k=k + 1, **how)
        return np.delete(values, missed), np.delete(vectors, missed, axis=1)

    monkeypatch.setattr(vibrations, "eigsh", forgetful)
    with pytest.raises(jamlab.ConvergenceError):
        vibrations._find_lowest(jamlab.hessian(packing), jamlab.count_zero_modes(packing) + missed + 1)


@pytest.mark.parametrize("n", [1, 5])
def test_disks_that_do_not_touch_move_at_no_cost(n):
    apart = jamlab.Packing(
        "sp", [[20.0, 0], [3.0, 20.0]], 3 * np.arange(2 * n).reshape(n, 2), {"k": 1.0}, "k", np.ones(n)
    )
    assert jamlab.count_zero_modes(apart) == 2 * n
