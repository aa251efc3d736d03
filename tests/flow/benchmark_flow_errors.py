"""The table behind `choose_flow`, made anew for one packing, beside the one that is shipped: a minute or two."""

import numpy as np
import pytest

from jamlab.benchmarks.flow_errors import measure_errors
from jamlab.flow.flow_errors import read_errors

pytestmark = pytest.mark.benchmark
KEYS = ["kind", "part", "seed", "alpha", "drag", "amplitude"]


def test_the_shipped_table_is_what_the_code_gives(tmp_path):
    """Runs at small strains repeat; those that rearrange are chaotic, and agree in size. A second call has no work."""
    made = measure_errors(tmp_path / "errors.csv", seeds=(1,), many=(), checks=(), sliding=(), sliding_checks=())
    both = made.merge(read_errors(), on=KEYS, suffixes=("", "_shipped"))
    assert len(both) == len(made)
    small = both[both["amplitude"] < 0.1]
    assert np.allclose(small["error"], small["error_shipped"], rtol=0.2, atol=5e-3)
    assert np.median(np.abs(np.log(both["error"].clip(1e-3) / both["error_shipped"].clip(1e-3)))) < 0.2
    again = measure_errors(tmp_path / "errors.csv", seeds=(1,), many=(), checks=(), sliding=(), sliding_checks=())
    assert len(again) == len(made)
