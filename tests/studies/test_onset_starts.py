"""Onsets by start: differences that are known, bounds of equivalence, and which onsets numbers of the papers take."""

import numpy as np
import pandas as pd
import pytest
from drawn_figures import drawn, tables
from paper_tables import onset_starts
from scipy.stats import norm

import jamlab
from jamlab.statistics.confidence import Interval
from studies.beyond import onset_handover
from studies.beyond.onset_handover import WAYS, Way
from studies.beyond.onset_starts import compared
from studies.ensembles import equivalence_bound
from studies.papers.boromand.conventions import onset_rows, onsets
from studies.reference_data import open_tables


def test_starts_from_disks_jam_as_much_higher_as_the_table_says():
    values = drawn("onset-starts").values
    for n in (16, 32, 64, 128, 256):
        for other, ours in (("disks", 0.0), ("from-disks", -0.002)):
            found = values[f"direct less {other}, N = {n}: mean"]
            assert float(found.value) == pytest.approx(ours, abs=1e-6)
        assert float(values[f"direct less from-disks, N = {n}: ratio of widths less 1"].value) == pytest.approx(
            0.0, abs=1e-9
        )
        assert float(values[f"direct, N = {n}: F/N"].value) == pytest.approx(n // 4 / n)
        assert float(values[f"direct, N = {n}: z without stops"].value) == pytest.approx(0.975 * 3.97)


def test_differences_are_paired_by_seed():
    """Onsets that scatter alike, one 0.001 higher and twice as far from the mean: no pairing would hide the 0.001."""
    common = np.random.default_rng(1).normal(0.82, 0.01, 400)
    one = np.stack([common, *np.zeros((3, 400))], axis=1)
    wide = np.stack([common.mean() + 2 * (common - common.mean()) + 0.001, *np.ones((3, 400))], axis=1)
    found = compared(np.stack([wide, one], axis=-1))
    assert found.value == pytest.approx([0.001, 1.0, 1.0, 1.0, 1.0])
    alike = compared(np.stack([one + 0.001, one], axis=-1))
    assert alike.high[0] - alike.low[0] < 1e-9


def test_the_bound_of_equivalence_is_that_of_two_one_sided_tests():
    """Both tests, of a difference below the bound and above its negative, just succeed at 5 %."""
    error, value = 2e-4, 5e-4
    ends = norm.ppf([0.025, 0.975], value, error)
    bound = equivalence_bound(Interval(np.array(value), *ends))
    assert max(norm.sf(bound, value, error), norm.cdf(-bound, value, error)) == pytest.approx(0.05)


def test_numbers_of_the_papers_take_onsets_of_one_start():
    given = tables()
    direct = onset_rows(given, "dp", "direct")
    assert set(direct["start"]) == {"direct"} and len(direct) == 150
    one, other = (onsets(given, "dp", 64, start=start).groups[0] for start in ("direct", "from-disks"))
    assert np.sort(one) == pytest.approx(np.sort(other)) and len(one) == 30
    assert "start" not in onset_rows(given, "sp", "direct")
    strong = onsets(given.strong, "dp", 64, "z_J", start="direct").groups[0]
    assert strong == pytest.approx(0.975 * onsets(given, "dp", 64, "z_J", start="direct").groups[0])


def test_onsets_of_a_campaign_say_how_they_started(tmp_path):
    sweep = 'model = "{}"\nn = 4\nseeds = 1\nonset = true\n{}'
    starts = {
        "one": sweep.format("dp", ""),
        "two": sweep.format("dp", 'start = "from-disks"'),
        "sp": sweep.format("sp", ""),
    }
    text = "\n".join(f'[[sweep]]\nname = "{name}"\n{body}' for name, body in starts.items())
    path = tmp_path / "c.toml"
    path.write_text(f'name = "c"\n{text}\n')
    jamlab.open_campaign(path).run(1)
    found = open_tables(path).onset_starts
    assert sorted(zip(found["model"], found["start"], strict=True)) == [
        ("dp", "direct"),
        ("dp", "from-disks"),
        ("sp", "from-disks"),
    ]
    phi = {row.start: row.phi_J for row in found[found["model"] == "dp"].itertuples()}
    assert phi == {start: jamlab.jam(4, "dp", 1, start=start).phi for start in ("direct", "from-disks")}


def test_a_handover_of_circumscribed_disks_in_usual_steps_is_that_of_jam():
    ours = onset_handover._onset(Way("dp", 0.0, 1e-2, ""), 2)["phi_J"]
    assert ours == jamlab.jam(32, "dp", 2, start="from-disks").phi


def test_rows_of_a_handover_are_made_again():
    rows = pd.read_csv(onset_handover.__file__.replace("beyond/onset_handover.py", "data/onset-handover.csv"))
    own = rows[(rows["way"] == "disks") & (rows["seed"] == 2)].iloc[0]
    assert onset_handover._onset(WAYS["disks"], 2)["phi_J"] == pytest.approx(own["phi_J"], abs=1e-6)


def test_the_table_of_starts_has_each_packing_once():
    assert not onset_starts().duplicated(["start", "model", "n", "seed"]).any()
    shipped = open_tables().onset_starts
    assert not shipped.duplicated(["start", "model", "n", "seed"]).any()
    assert set(shipped.loc[shipped["model"] == "dp", "start"]) == {"direct", "from-disks"}
