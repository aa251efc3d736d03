"""Time and memory against size: exponents of made-up costs, and one part measured."""

import pandas as pd
import pytest

from studies.ensemble_tables import EnsembleTables
from studies.speed_accuracy.size_scaling import PARTS, STUDY, measure_part


def test_power_and_memory_of_a_million_disks_follow_from_smaller_ones():
    sizes = (64, 256, 1024)
    rows = [{"part": "disks: contacts", "n": n, "seconds": 2e-6 * n**1.5, "bytes": 10**8 + 1000 * n} for n in sizes]
    (table,) = STUDY.draw(EnsembleTables(lambda name: pd.DataFrame(rows))).text
    assert table.rows[0][2:] == ["1.50", "1e+06", "2e+03 s", "1.1 GB"]
    assert {task.partition(", N")[0] for task in STUDY.tasks} == set(PARTS)


@pytest.mark.slow
def test_a_part_is_measured_in_a_process_of_its_own():
    (found,) = measure_part("droplets: 10 forces", 32)
    assert found["n"] == 32 and 0 < found["seconds"] < 1 and 2e7 < found["bytes"] < 2e9
