"""Reference data: written, read, drawn as they ship."""

from pathlib import Path

import frozen_rule
import pandas as pd
import pytest
from bare_pictures import covers_points
from drawn_figures import TABLES, drawn, saved

from jamlab.errors import InputError
from studies import pages
from studies.ensemble_tables import NAMES, EnsembleTables
from studies.papers.headline import unexplained
from studies.papers.statements import explanations
from studies.papers.verdicts import SUMMARY, Verdict
from studies.reference_data import open_tables, write_tables
from studies.registry import GROUPS, PAPERS
from studies.tables import DATA, AbsentTableError, read_manifest, read_table


def test_reference_tables_give_the_same_figures(tmp_path):
    back = open_tables(saved(tmp_path))
    assert set(back.made) == set(NAMES) and read_manifest(tmp_path)["states.parquet"]["commit"] == "old"
    for name in ("boromand-11", "boromand-8", "baumgarten-5"):
        for one, other in zip(drawn(name).claims, pages.draw(name, back).claims, strict=True):
            a, b = one.measured, other.measured
            assert (b.value, b.low, b.high) == pytest.approx((a.value, a.low, a.high), rel=1e-2, abs=1e-6, nan_ok=True)


def test_tables_that_a_campaign_lacks_are_left_out(tmp_path):
    names = ["onset", "onset_starts"]
    onset = EnsembleTables({name: TABLES[name]() for name in names}.__getitem__)
    assert [path.stem for path in write_tables(onset, tmp_path, "one")] == names
    assert pages.draw("boromand-10", open_tables(tmp_path)).claims
    with pytest.raises(AbsentTableError):
        pages.draw("baumgarten-1", open_tables(tmp_path))
    with pytest.raises(InputError):
        write_tables(EnsembleTables(lambda name: pd.DataFrame()), tmp_path, "one")


def test_no_row_is_held_twice(tmp_path):
    """Neither in the tables that ship, nor in those that are written of sweeps that share packings."""
    shipped = [name for name in NAMES if f"{name}.parquet" in read_manifest(DATA)]
    assert not [name for name in shipped if open_tables().read(name).duplicated().any()]
    twice = EnsembleTables(lambda name: pd.concat([TABLES[name]()] * 2))
    (path,) = write_tables(twice, tmp_path, "one", ["flow"])
    assert len(pd.read_parquet(path)) == len(TABLES["flow"]().dropna(subset=["stress"]))


def test_rows_of_another_campaign_are_added_below_those_that_a_table_has(tmp_path):
    """Which keep their bits; rows that are there already are not added again."""
    whole = TABLES["correlation"]().drop_duplicates()
    seeds = whole["seed"].unique()
    some, rest = (
        EnsembleTables({"correlation": whole[whole["seed"].isin(part)]}.__getitem__) for part in (seeds[:2], seeds[1:])
    )
    write_tables(some, tmp_path, "one", ["correlation"])
    before = read_table(tmp_path, "correlation")
    write_tables(rest, tmp_path, "two", ["correlation"], add=True)
    after = read_table(tmp_path, "correlation")
    assert after.iloc[: len(before)].equals(before) and len(after) == len(whole)
    assert read_manifest(tmp_path)["correlation.parquet"]["commit"] == "one two"
    with pytest.raises(InputError, match="no column c:"):
        write_tables(
            EnsembleTables({"correlation": whole.drop(columns="c")}.__getitem__),
            tmp_path,
            "x",
            ["correlation"],
            add=True,
        )


def test_pages_repeat_how_many_numbers_agree():
    """`python -m studies draw papers` writes the file; the slow test below draws it anew."""
    first, short = (DATA / SUMMARY).read_text().splitlines()[:2]
    for page, line in (("README.md", short), ("docs/explanation/papers.md", first)):
        text = (Path(__file__).parents[2] / page).read_text(encoding="utf-8").replace("\n> ", " ")
        assert line in " ".join(text.split()), page


MOVED = {  # by the frozen rule, with the analyses of its day; with all; by the rule of today
    "B4-C": ("small difference", "small difference", "agrees"),
    "B4-rho-is-phi": ("compatible, weak", "compatible, weak", "no verdict (estimator fails a control)"),
    "B4-A-confluence-sp": ("not resolved", "not resolved", "agrees"),
    "B4-A-092-dp": (
        "compatible, weak",
        "compatible, weak",
        "compatible, weak (unprinted parameters)",
    ),
    "B4-A-099-dp": ("tension", "tension", "tension (unprinted parameters)"),
    "B4-omega": ("not resolved", "not resolved", "not resolved (paper inconsistent)"),
    "B5-z-parts": ("not resolved", "not resolved", "no verdict (threshold not printed)"),
    "B5-g-sizes-sp": ("differs", "not resolved", "not resolved (ensemble not printed)"),
    "B5-g-sizes-dp": ("tension", "compatible, weak", "compatible, weak"),
    "B6-beta0": ("not resolved", "not resolved", "not resolved (ensemble not printed)"),
    "B6-g-of-z-sp": ("compatible, weak", "not resolved", "not resolved (ensemble not printed)"),
    "B6-g-nearest-sp": ("not resolved", "not resolved", "compatible, weak"),
    "B6-g-nearest-dp": ("not resolved", "not resolved", "compatible, weak"),
    "B6-crossover-dp": ("not resolved", "not resolved", "no verdict (estimator fails a control)"),
    "B6-z-root-dp": ("not resolved", "not resolved", "no verdict (no power law)"),
    "B6-z-root-same": ("–", "–", "not resolved"),
    "B6-g-small-sp": ("compatible, weak", "not resolved", "not resolved (ensemble not printed)"),
    "B7-collapse-sp": ("not resolved", "not resolved", "not resolved (no power law)"),
    "B7-collapse-dp": ("not resolved", "not resolved", "not resolved (no power law)"),
    "B8-P3-parts": ("compatible, weak", "compatible, weak", "no verdict (estimator fails a control)"),
    "B8-A3-dense-dp": ("differs", "tension", "tension"),
    "B8-P4-for-P3": ("not resolved", "not resolved", "compatible, weak"),
    "B9-exponent-dp": ("differs", "differs", "differs (paper inconsistent)"),
    "B9-limit-dp": ("tension", "tension", "tension (paper inconsistent)"),
    "B11-overlap": ("compatible, weak", "compatible, weak", "compatible, weak (definition)"),
    "B11-energy": ("agrees", "agrees", "agrees (definition)"),
    "B11-C-onset": ("differs", "differs", "compatible, weak"),
    "B11-zeta-large": ("not resolved", "not resolved", "not resolved (no power law)"),
    "B11-omega-large-sp": ("not resolved", "not resolved", "not resolved (no power law)"),
    "B11-omega-large-dp": ("compatible, weak", "compatible, weak", "no verdict (estimator fails a control)"),
    "BT-G0-sp-phi": ("differs", "differs", "tension"),
    "BT-z0-sp-rho": ("compatible, weak", "compatible, weak", "compatible, weak (collinear coefficients)"),
    "BT-z1-sp-rho": ("not resolved", "not resolved", "not resolved (collinear coefficients)"),
    "BT-z-sp-rho": ("differs", "differs", "differs (paper inconsistent)"),
    "BT-G0-sp-rho": ("tension", "not resolved", "not resolved (collinear coefficients)"),
    "BT-G1-sp-rho": ("not resolved", "not resolved", "not resolved (collinear coefficients)"),
    "BT-G-sp-rho": ("–", "–", "compatible, weak"),
    "BT-z0-dp": (
        "tension (unprinted parameters)",
        "tension (unprinted parameters)",
        "tension (collinear coefficients)",
    ),
    "BT-z1-dp": (
        "not resolved (unprinted parameters)",
        "not resolved (unprinted parameters)",
        "not resolved (collinear coefficients)",
    ),
    "BT-z-dp-05": ("–", "–", "small difference"),
    "BT-z-dp-10": ("–", "–", "tension"),
    "BT-z-dp-15": ("–", "–", "differs (paper inconsistent)"),
    "BT-z-ratio": ("agrees (unprinted parameters)", "agrees (unprinted parameters)", "agrees"),
    "T3-quasistatic-end": ("tension", "tension", "not resolved"),
    "T3-Delta-loss-no-rotation": ("compatible, weak", "compatible, weak", "no verdict (estimator fails a control)"),
    "T5-rms-approach": ("–", "–", "agrees"),
    "T5-rms-sliding": ("–", "–", "agrees"),
    "T5-sheared": ("compatible, weak", "not resolved", "not resolved (corrections to scaling)"),
    "T6-Delta-loss": ("not resolved", "not resolved", "not resolved (corrections to scaling)"),
    "T8-crossover-stokes": ("tension", "tension", "compatible, weak"),
    "T8-a-same": ("tension", "tension", "tension (guess)"),
}


@pytest.mark.slow
def test_every_figure_is_drawn_from_the_reference_data(tmp_path):
    """Drawn once more: the same numbers and verdicts, and no legend covers a point."""
    drawn, failures = pages.write_page(tmp_path, "papers", GROUPS["papers"], open_tables())
    assert not failures and [d.name for d in drawn] == [study.name for study in PAPERS]
    claims = [c for d in drawn for c in d.claims]
    assert sum(c.measured.known for c in claims) > 120
    seen = (Verdict.DIFFERS, Verdict.TENSION, Verdict.SMALL)
    assert {c.statement.id for c in claims if c.verdict in seen and c.statement.counted} <= set(explanations())
    assert unexplained(claims) == []  # a line of reasons.md for all that differs or is in tension
    pages.write_verdicts(tmp_path, claims)
    assert (tmp_path / SUMMARY).read_text() == (DATA / SUMMARY).read_text()
    assert frozen_rule.moved(frozen_rule.side_by_side(claims, open_tables())) == MOVED
    for study in PAPERS:
        again = pages.draw(study, open_tables())
        pages.write_csv(tmp_path / "again.csv", again.table)
        assert (tmp_path / "again.csv").read_bytes() == (tmp_path / f"{study.name}.csv").read_bytes()
        assert not covers_points(again.figure), study.name
