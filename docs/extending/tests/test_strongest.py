"""The observable on a packing whose forces are known, and in a campaign."""

from pathlib import Path

import numpy as np
import pytest
from jamlab_example.strongest import strongest

import jamlab

CAMPAIGN = """
name = "forces"

[[sweep]]
name = "dense"
model = "sp"
n = 16
seeds = 1
pressures = [1e-2]
observables = ["strongest"]
"""


def test_equal_forces_are_all_alike() -> None:
    square = np.stack(np.meshgrid(np.arange(4.0), np.arange(4.0)), axis=-1).reshape(-1, 2)
    lattice = jamlab.Packing("sp", np.diag([4.0, 4.0]), square, {"k": 1.0}, "k", diameters=np.full(16, 1.1))
    assert strongest(lattice) == {"strongest": pytest.approx(1.0), "strong": 0.0}


def test_a_campaign_has_its_columns(tmp_path: Path) -> None:
    (tmp_path / "forces.toml").write_text(CAMPAIGN, encoding="utf-8")
    campaign = jamlab.open_campaign(tmp_path / "forces.toml")
    campaign.run(workers=1)
    table = campaign.table("states")
    assert table["strongest"][0] > 1 and 0 <= table["strong"][0] < 1
