"""jamlab beside jax-md, OpenMM, ASE and LAMMPS' own styles. pip install '.[peers]'; pytest -m benchmark -s.

One core, one run; ratios are what counts. A code that is not installed is a line that says so.
"""

import json

import pytest

from jamlab.benchmarks.other_codes.compare import compare, summary
from jamlab.benchmarks.other_codes.page import comparison_tables

SIZES = (64, 128)


@pytest.mark.benchmark
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("n", SIZES)
def test_disks_in_other_codes(n):
    """Differences below 1e-12 at the same coordinates; who is faster says why."""
    rows = compare(n)
    for table in comparison_tables(rows, n, 0.88):
        print("\n" + table.heading)
        for line in [table.columns, *table.rows]:
            print("  ".join(f"{cell:>18.30s}" for cell in line))
    print(json.dumps(summary(rows)))
    for row in rows:
        if row.version is None:
            print(f"{row.name}: {row.note}")
            continue
        assert max(row.energy, row.forces, row.pressure, row.stress or 0.0) < 1e-12
        assert row.warm_ratio >= 1 or "faster" in row.note
