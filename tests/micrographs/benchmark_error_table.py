"""The table behind the figure `micrograph-errors`, made anew and held beside the one that is shipped.

JAMLAB_RESULTS names a folder for the new table and for its rows, so that a stopped run goes on. Run it after a change
of `jamlab/micrographs`, and ship what it writes. Its packings come from `jam`: once a seed gives another packing there,
the table is of droplets that are no longer those.
"""

import os
from pathlib import Path

import pandas as pd
import pytest
from rendered_pictures import error_table

import jamlab
from studies.tables import DATA, read_table

pytestmark = pytest.mark.benchmark
SEED = 2
RHO = (0.84, 0.90, 0.95)


def test_the_shipped_table_is_what_the_code_gives(tmp_path):
    packing, states = jamlab.jam(model="dp", n=64, seed=SEED), {}
    for rho in RHO:
        if rho > jamlab.packing_fraction(packing):
            *_, packing = jamlab.compress(packing, to=rho, step=0.02)
        states[rho] = packing
    path = Path(os.environ.get("JAMLAB_RESULTS", tmp_path)) / "micrograph_errors.csv"
    error_table(states).to_csv(path, index=False, float_format="%.4g")
    made, shipped = pd.read_csv(path), read_table(DATA, "micrograph-errors")
    print(made.groupby(["parameter", "quality"]).size())
    columns = ["parameter", "value", "state", "quality"]
    pd.testing.assert_frame_equal(made[columns], shipped[columns])
    numbers = ["count", "rho", "z", "shape"]
    assert (made[numbers] - shipped[numbers]).abs().max().max() < 1e-3  # a sweep repeats to rounding, not to the bit
