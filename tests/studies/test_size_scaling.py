"""Time against size: exponents of made-up costs."""

import pandas as pd

from studies.ensemble_tables import EnsembleTables
from studies.speed_accuracy.size_scaling import PARTS, STUDY


def test_the_power_of_made_up_costs_is_found():
    rows = [{"part": "disks: contacts", "n": n, "seconds": 2e-6 * n**1.5, "bytes": 10**8} for n in (64, 256, 1024)]
    (table,) = STUDY.draw(EnsembleTables(lambda name: pd.DataFrame(rows))).text
    assert table.rows[0][2] == "1.50" and {task.partition(", N")[0] for task in STUDY.tasks} == set(PARTS)
