"""jamlab beside other codes that move disks or measure them. pip install '.[peers]'; pytest -m benchmark -s.

One core, one run; ratios are what counts. A code that is not installed is a line that says so.
"""

import json

import pytest

from jamlab.studies.other_codes.analysis import compare_analysis
from jamlab.studies.other_codes.compare import compare, jolted_minimum, summary
from jamlab.studies.other_codes.page import comparison_tables

SIZES = (64, 128)


@pytest.mark.benchmark
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("n", SIZES)
def test_disks_in_other_codes(n):
    """Differences below 1e-12 at the same coordinates; who is faster says why."""
    rows = compare(n)
    analysis = compare_analysis(jolted_minimum(n, 1, 0.88)[1])
    for table in comparison_tables(rows, analysis, n, 0.88):
        print("\n" + table.heading)
        for line in [table.columns, *table.rows]:
            print("  ".join(f"{cell:>18.30s}" for cell in line))
    print(json.dumps(summary(rows, analysis)))
    for row in rows:
        if row.version is None:
            print(f"{row.name}: {row.note}")
            continue
        assert max(row.energy, row.forces, row.pressure, row.stress or 0.0) < 1e-12
        assert row.warm_ratio >= 1 or "faster" in row.note
    limits = {
        "energy": 1e-12,
        "pressure": 1e-12,
        "shear modulus": 1e-7,
        "contacts": 0,
        "|psi_6|": 1e-4,
    }  # freud: float32
    assert all(row.version is None or row.difference <= limits[row.quantity] for row in analysis)
