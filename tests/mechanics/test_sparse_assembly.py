"""Sums of small blocks into one sparse matrix, against plain loops."""

import numpy as np

from jamlab.mechanics.stiffness import assemble


def test_blocks_sum_as_in_plain_loops():
    """Groups of different width, a site twice in one term, terms between the same sites, sites without any term."""
    rng = np.random.default_rng(5)
    size = 9
    sites = [rng.integers(0, size - 1, (6, m)) for m in (2, 3, 5)]
    blocks = [rng.normal(size=(6, s.shape[1], 2, s.shape[1], 2)) for s in sites]
    blocks = [block + block.transpose(0, 3, 4, 1, 2) for block in blocks]
    dense = np.zeros((2 * size, 2 * size))
    for group, block in zip(sites, blocks, strict=True):
        for own, values in zip(group, block, strict=True):
            for a, i in enumerate(own):
                for b, j in enumerate(own):
                    dense[2 * i : 2 * i + 2, 2 * j : 2 * j + 2] += values[a, :, b]
    found = assemble(sites, blocks, size)
    assert found.has_canonical_format
    np.testing.assert_allclose(found.toarray(), dense, rtol=1e-13, atol=1e-14)
    assert not found.toarray()[-2:].any()
