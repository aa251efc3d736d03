"""Reference data: written, read, drawn as they ship."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from drawn_figures import TABLES, drawn, saved

from jamlab.errors import InputError
from studies import pages
from studies.ensemble_tables import NAMES, EnsembleTables
from studies.papers.statements import explanations, measure
from studies.papers.verdicts import SUMMARY, Verdict
from studies.reference_data import read_folder, reference_tables, write_tables
from studies.registry import GROUPS, PAPERS
from studies.tables import DATA, AbsentTableError, read_manifest


def test_reference_tables_give_the_same_figures(tmp_path):
    back = read_folder(saved(tmp_path))
    assert set(back.made) == set(NAMES) and read_manifest(tmp_path)["states.parquet"]["commit"] == "old"
    for name in ("boromand-11", "boromand-8", "baumgarten-5"):
        for one, other in zip(drawn(name).claims, pages.draw(name, back).claims, strict=True):
            a, b = one.measured, other.measured
            assert (b.value, b.low, b.high) == pytest.approx((a.value, a.low, a.high), rel=1e-2, abs=1e-6, nan_ok=True)


def test_tables_that_a_campaign_lacks_are_left_out_and_named(tmp_path):
    def read(name):
        if name == "onset":
            return TABLES["onset"]()
        raise InputError(f"no table {name}")

    assert [path.name for path in write_tables(EnsembleTables(read), tmp_path, "one")] == ["onset.parquet"]
    back = read_folder(tmp_path)
    assert pages.draw("boromand-10", back).claims
    with pytest.raises(AbsentTableError):
        pages.draw("baumgarten-1", back)
    with pytest.raises(InputError):
        write_tables(EnsembleTables(lambda name: pd.DataFrame()), tmp_path, "one")


def test_the_readme_repeats_how_many_numbers_agree():
    """`python -m studies draw papers` writes the file; the slow test below draws it anew."""
    told = (DATA / SUMMARY).read_text().splitlines()[0]
    readme = Path(__file__).parents[2] / "README.md"
    assert told in " ".join(readme.read_text().split())


@pytest.mark.slow
def test_limits_repeat_where_the_models_part():
    part = measure("B5-z-parts", reference_tables())
    words = f"by 2 % from ρ = {part.value:.2f} and by 3 % from {float(part.variants['share = 0.03'].value):.2f}"
    limits = (Path(__file__).parents[2] / "docs" / "explanation" / "limits.md").read_text(encoding="utf-8")
    assert words in " ".join(limits.split())


@pytest.mark.slow
def test_every_figure_is_drawn_from_the_reference_data(tmp_path):
    """Drawn once more: the same numbers and verdicts, and no legend covers a point."""
    drawn, failures = pages.write_page(tmp_path, "papers", GROUPS["papers"], reference_tables())
    assert not failures and [d.name for d in drawn] == [study.name for study in PAPERS]
    claims = [c for d in drawn for c in d.claims]
    assert sum(c.measured.known for c in claims) > 120
    seen = (Verdict.DIFFERS, Verdict.TENSION, Verdict.SMALL)
    assert {c.statement.id for c in claims if c.verdict in seen and c.statement.counted} <= set(explanations())
    pages.write_verdicts(tmp_path, claims)
    assert (tmp_path / SUMMARY).read_text() == (DATA / SUMMARY).read_text()
    for study in PAPERS:
        again = pages.draw(study, reference_tables())
        pages.write_csv(tmp_path / "again.csv", again.table)
        assert (tmp_path / "again.csv").read_bytes() == (tmp_path / f"{study.name}.csv").read_bytes()
        assert (study.name, covered(again.figure)) == (study.name, 0)


def covered(figure):
    """How many points of curves, of lines between them and of bands lie under a legend or an inset."""
    figure.canvas.draw()
    count = 0
    for axes in figure.axes:
        legend = axes.get_legend()
        boxes = [legend.get_window_extent()] if legend else []
        boxes += [inset.get_tightbbox() for inset in axes.child_axes]
        paths = [(line.get_transform(), line.get_path(), line.get_linestyle() != "None") for line in axes.lines]
        paths += [(band.get_transform(), path, True) for band in axes.collections for path in band.get_paths()]
        for transform, path, joined in paths:
            points = transform.transform(path.vertices)
            points = points[np.isfinite(points).all(axis=1)]
            if joined and len(points) > 1:
                points = np.concatenate([points[:-1] + t * np.diff(points, axis=0) for t in np.linspace(0, 1, 20)])
            count += sum(box.contains(*point) and axes.bbox.contains(*point) for box in boxes for point in points)
    return count
