"""The table behind the figure `dynamics-flow-curves`, made anew for some packings, beside the one that is shipped.

JAMLAB_RESULTS names a folder for the new table, JAMLAB_SEEDS the number of packings: half an hour of CPU for six.
"""

import os
from pathlib import Path

import numpy as np
import pytest

from jamlab.figures.papers.dynamics import read_flow_table
from jamlab.flow.flow_ensemble import flow_table

pytestmark = pytest.mark.benchmark
KEYS = ["seed", "phi", "rate"]


def test_the_shipped_table_is_what_the_code_gives(tmp_path):
    """Flow is chaotic: means agree within their errors, not to the digit."""
    shipped = read_flow_table()
    seeds = list(range(1, 1 + int(os.environ.get("JAMLAB_SEEDS", "1"))))
    fractions, rates = sorted(shipped["phi"].unique()), sorted(shipped["rate"].unique(), reverse=True)
    made = flow_table(int(shipped["n"].iloc[0]), seeds, fractions, rates, strain=2.0)
    path = Path(os.environ.get("JAMLAB_RESULTS", tmp_path)) / "dynamics_flow.csv"
    made.to_csv(path, index=False, float_format="%.5g")
    both = made.merge(shipped, on=KEYS, suffixes=("", "_shipped"))
    assert len(both) >= 0.9 * len(fractions) * len(rates)
    apart = (both["stress"] - both["stress_shipped"]) / np.hypot(both["stress_error"], both["stress_error_shipped"])
    print(both[[*KEYS, "stress", "stress_shipped", "seconds"]].assign(apart=apart).to_string())
    assert np.sqrt(np.mean(apart**2)) < 3
