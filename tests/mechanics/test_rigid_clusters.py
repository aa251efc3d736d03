"""Rigid clusters of disks by the pebble game, beside the rank of the matrix of bonds and the shear modulus."""

from itertools import combinations

import numpy as np
import pytest

import jamlab
from jamlab.mechanics.rigid_clusters import _clusters, _Game


def by_rank(n, pairs, x):
    """Rank of the bonds, and (n, n) whether the distance of two points is fixed, by singular values."""
    rows = np.zeros((len(pairs), n, 2))
    for row, (i, j) in zip(rows, pairs, strict=True):
        row[i], row[j] = x[i] - x[j], x[j] - x[i]
    _, values, modes = np.linalg.svd(rows.reshape(len(pairs), -1))
    rank = int((values > 1e-9).sum())
    free = modes[rank:].reshape(-1, n, 2)
    stretch = np.einsum("kijc,ijc->kij", free[:, :, None] - free[:, None], x[:, None] - x)
    return rank, np.abs(stretch).max(axis=0, initial=0) < 1e-9


def test_clusters_are_those_of_singular_values():
    rng = np.random.default_rng(0)
    for _ in range(60):
        n = int(rng.integers(4, 14))
        every = np.array(list(combinations(range(n), 2)))
        count = int(rng.integers(1, min(len(every), 2 * n + 2)))
        pairs = every[np.sort(rng.choice(len(every), count, replace=False))]
        game = _Game(n)
        held = sum(game.add(i, j) for i, j in pairs.tolist())
        bonds = _clusters(game, pairs)
        rank, fixed = by_rank(n, pairs, rng.random((n, 2)))
        assert held == rank
        for k, (i, j) in enumerate(pairs):
            together = fixed[i][pairs].all(axis=1) & fixed[j][pairs].all(axis=1)
            np.testing.assert_array_equal(bonds == bonds[k], together)


def test_rigidity_percolates_where_the_modulus_sets_in():
    below, above = (jamlab.pack(256, phi=phi, seed=1, law={"stickiness": 0.1}) for phi in (0.5, 0.72))
    small, large = map(jamlab.rigid_clusters, (below, above))
    assert small.sizes[0] < 0.3 * 256 and abs(jamlab.shear_modulus(below, direction="simple")) < 1e-6
    assert large.sizes[0] > 0.9 * 256 and jamlab.shear_modulus(above, direction="simple") > 1e-2
    assert (np.diff(small.sizes) <= 0).all() and len(small.sizes) == small.bonds.max() + 1
    counted = jamlab.maxwell_count(above)
    assert large.redundant == pytest.approx(counted.self_stress_states, abs=2)  # three motions of the whole for two
    with pytest.raises(jamlab.InputError) as caught:
        jamlab.rigid_clusters(jamlab.jam(6, "dp", 1))
    assert "dp" in str(caught.value)


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_a_cluster_that_spans_the_box_has_one_redundant_contact_more_than_states_of_self_stress(seed):
    """The box holds it from turning, which the count in the open plane takes for free; rattlers without contacts."""
    p = jamlab.remove_rattlers(jamlab.pack(24, 1e-2, seed))
    clusters = jamlab.rigid_clusters(p)
    assert clusters.sizes.tolist() == [p.n]
    assert clusters.redundant == jamlab.maxwell_count(p).self_stress_states + 1
