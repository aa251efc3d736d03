"""The table of ways is measured seed by seed."""

from dataclasses import replace

import pytest

import jamlab
from jamlab.estimates.ways import EnsembleWay, bring_on
from studies.estimate_tables import make_table

DISKS = EnsembleWay("disks", 8)
CARRIED = EnsembleWay("carried", 8, (12, 17))


def test_rows_of_the_table_of_ways_are_measured(tmp_path):
    few = make_table(tmp_path / "few.csv.xz", range(1, 3), groups=lambda seed: [(DISKS, CARRIED)], levels=(0.87,))
    assert few[CARRIED].seeds.tolist() == [1, 2] and (few[CARRIED].seconds > few[DISKS].seconds).all()
    p = bring_on(replace(DISKS, n=8), jamlab.jam(8, "sp", 1), 0.87)
    assert few[DISKS].values["z"][0, 0] == pytest.approx(jamlab.contacts(p).z, rel=1e-5)
