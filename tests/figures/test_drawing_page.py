"""The page on drawing results: its script, with smaller packings, draws all six panels."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from campaigns import written
from matplotlib import pyplot

import jamlab

PAGE = Path(__file__).parents[2] / "docs" / "how_to" / "draw_results.md"


@pytest.fixture
def script():
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    (found,) = (block for block in blocks if "pyplot" in block)
    return found


def test_script_draws_six_panels(script, tmp_path, monkeypatch):
    assert len([line for line in script.splitlines() if line.strip()]) + 2 < 15  # with numpy and jamlab, as above it
    monkeypatch.chdir(tmp_path)
    written(tmp_path / "campaign.toml")
    states = {"model": "sp", "n": 8, "seed": [1, 1, 2, 2], "z": [4.0, 4.4, 4.2, 4.6], "d_rho": [0.01, 0.04] * 2}
    monkeypatch.setattr(jamlab.Campaign, "_rows", lambda *_: pd.DataFrame(states))  # as if it had run
    names = {"np": np, "jamlab": jamlab}
    small = {"n=64": "n=32", 'figsize=(17, 11), layout="constrained"': "figsize=(6, 4)"}
    for large, quick in small.items():
        assert large in script
        script = script.replace(large, quick)
    exec(script, names)
    panels = list(names["axes"].flat)
    assert all(panel.has_data() for panel in panels)
    assert (tmp_path / "six.png").read_bytes()[:4] == b"\x89PNG"
    pyplot.close(names["figure"])
