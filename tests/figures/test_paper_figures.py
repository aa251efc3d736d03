"""Figures of both papers from tables in which the papers' laws hold, and from tables in which they do not."""

import gzip
import json
import re
from functools import cache
from importlib import resources
from pathlib import Path

import flow_tables
import numpy as np
import pandas as pd
import paper_tables
import pytest
from commands import call
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jamlab.errors import InputError, StorageError
from jamlab.figures.papers import conventions, gallery
from jamlab.figures.papers.claims import Claim, Verdict, claim
from jamlab.figures.papers.ensembles import add_distances, ensemble, from_onset, interpolate, log_places, select_usual
from jamlab.figures.papers.summary import SUMMARY, first_line
from jamlab.figures.papers.tables import (
    NAMES,
    EnsembleTables,
    combine,
    count_voids,
    read_folder,
    reference_tables,
    save,
)
from jamlab.statistics.bootstrap import Interval
from jamlab.statistics.published_numbers import Published

TABLES, states = paper_tables.TABLES | flow_tables.TABLES, paper_tables.states
REFERENCE = Path(str(resources.files("jamlab.figures.papers").joinpath("reference")))
PICTURES = [name for name in gallery.FIGURES if gallery.FIGURES[name].__module__.endswith("_pictures")]
PUBLISHED = [f"dynamics-{name}" for name in ("flow-curves", "collapse", "amplitudes")]  # figures of flow with a verdict


@cache
def tables():
    made = {name: make() for name, make in TABLES.items()}

    def read(name):
        if name not in made:
            raise InputError(f"no table {name}")
        return made[name]

    return EnsembleTables(read, {"campaign": "made up"})


@cache
def drawn(name):
    return gallery.draw(name, tables())


def found(name, text):
    """The one claim of a figure whose quantity begins with the text."""
    hits = [c for c in drawn(name).claims if c.quantity.startswith(text)]
    assert len(hits) == 1, [c.quantity for c in drawn(name).claims]
    return hits[0]


# what the figures measure ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("figure", "quantity", "value", "tolerance"),
    [
        ("boromand-4", "C of eq 11", 1.21, 1e-3),
        ("boromand-6", "alpha_0", 0.5, 0.01),
        ("boromand-6", "beta_0", 0.5, 0.01),
        ("boromand-8", "P_3 at onset, SP", 0.4, 1e-9),
        ("boromand-8", "P_5 at onset, DP", 0.2, 1e-9),
        ("boromand-8", "P_3 for rho > 0.97", 1.0, 1e-9),
        ("boromand-8", "A of 3-sided voids, rho > 0.97", 4.87, 1e-9),
        ("boromand-10", "theta: sigma ~ N^-theta, SP", 0.55, 1e-6),
        ("boromand-10", "onset in the large-N limit, DP", 0.842, 1e-6),
        ("boromand-11", "omega: drho ~ (A - 1)^omega, small A, SP", 1 / 1.5, 0.01),
        ("boromand-11", "omega: drho ~ (A - 1)^omega, small A, DP", 1.0, 0.02),
        ("tables", "z_0, SP(φ)", 3.7, 0.05),
        ("tables", "G_0, SP(φ)", 0.42, 0.005),
        ("tables", "z_0, DP(ρ)", 3.3, 0.05),
        ("tables", "z_1, DP(ρ)", 7.1, 0.1),
        ("tables", "G_1, DP(ρ)", 1.7, 0.02),
        ("baumgarten-1", "slope of G'', slow", 1.0, 0.01),
        ("baumgarten-1", "slope of G', critical", 0.5, 0.02),
        ("baumgarten-3", "mu", 0.5, 0.02),
        ("baumgarten-3", "lambda", 1.0, 0.05),
        ("baumgarten-4", "largest |G''", 0.0, 1e-9),
        ("baumgarten-4", "exponent of eta_0 in p", 0.5, 0.01),
        ("baumgarten-4", "exponent of eta_0(beta)", 1.0, 0.01),
        ("baumgarten-5", "exponent of approach", 0.25, 0.01),
        ("baumgarten-5", "exponent of sliding", -0.25, 0.01),
        ("baumgarten-6", "lambda", 1.0, 0.02),
        ("baumgarten-6", "Delta", 0.5, 0.02),
        ("baumgarten-6", "d eta_0 / d eta_F", 1e-9, 1e-12),
        ("baumgarten-7", "l/L, contact", 0.25, 0.01),
        ("baumgarten-7", "exponent of -ln p", 0.65, 0.02),
    ],
)
def test_figures_measure_what_the_tables_hold(figure, quantity, value, tolerance):
    c = found(figure, quantity)
    assert c.value == pytest.approx(value, abs=tolerance)
    assert c.low - 1e-12 <= c.value <= c.high + 1e-12


def test_a_table_that_differs_is_told_from_the_paper():
    other = EnsembleTables(lambda name: pd.concat([states(z0=5.0, c=0.9), states("dp")]) if name == "states" else None)
    by_name = {c.quantity: c for c in gallery.draw("tables", other).claims}
    assert by_name["z_0, SP(φ)"].value == pytest.approx(5.0, abs=0.1)
    assert by_name["z_0, SP(φ)"].verdict == "differs" and "5" in by_name["z_0, SP(φ)"].cause
    assert by_name["G_0, SP(φ)"].agrees
    c = gallery.draw("boromand-4", other).claims[0]
    assert c.value == pytest.approx(0.9, abs=1e-3) and c.text.startswith("differs: C at one dphi")


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.slow if n == "micrograph-errors" else ()) for n in gallery.FIGURES]
)
def test_every_figure_keeps_what_it_draws(name):
    drawing = drawn(name)
    table = drawing.table
    assert list(table.columns) == ["panel", "series", "x", "y", "low", "high"]
    assert np.isfinite(table[["x", "y"]].to_numpy()).all() and len(table) > 10
    pictures = name in (*PICTURES, "micrograph-errors") or (name.startswith("dynamics-") and name not in PUBLISHED)
    assert drawing.caption and bool(drawing.claims) is not pictures  # of which no paper has numbers
    for (panel, series), points in table.groupby(["panel", "series"]):
        (axes,) = (axes for axes in drawing.figure.findobj(Axes) if axes.get_gid() == panel)  # insets too
        drawn_points = {tuple(place) for line in axes.lines for place in line.get_xydata()}
        assert set(zip(points["x"], points["y"], strict=True)) <= drawn_points, (panel, series)
    for axes in drawing.figure.axes:
        assert (axes.get_xlabel() and axes.get_ylabel()) or name == "tables" or name in PICTURES


# verdicts -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("low", "high", "relation", "verdict"),
    [
        (0.9, 1.1, "=", "agrees"),
        (1.04, 1.1, "=", "agrees"),  # within the paper's margin
        (1.06, 1.1, "=", "differs"),
        (0.8, 0.94, "=", "differs"),
        (0.7, 1.3, "=", "undecided"),  # would have met 0.8 as well
        (1.06, 2.0, "=", "differs"),  # wide, and yet elsewhere
        (1.2, 1.3, ">", "agrees"),
        (0.9, 1.3, ">", "undecided"),
        (0.7, 0.9, ">", "differs"),
        (0.7, 0.9, "<", "agrees"),
        (1.2, 1.3, "<", "differs"),
    ],
)
def test_verdicts(low, high, relation, verdict):
    c = Claim("f", "q", 0.5 * (low + high), low, high, 1.0, 0.05, relation)
    assert c.verdict == verdict and c.agrees is (verdict == "agrees")


@pytest.mark.parametrize(
    ("low", "high", "paper", "scale", "undecided"),
    [
        (-0.56, 0.66, 0.55, 0.0, True),
        (0.35, 0.62, 0.55, 0.0, False),  # 0.55 is told from 0.27
        (0.3, 0.8, 0.55, 0.0, True),
        (-1.2, -0.4, -0.5, 0.0, True),
        (0.83, 0.86, 0.842, 0.01, True),  # packing fractions: against the distance to onset
        (0.8405, 0.8445, 0.842, 0.01, False),
        (-0.04, 0.04, 0.0, 0.0, False),  # zero has no scale: the margin alone decides
        (-0.1, 0.1, 0.0, 0.0, True),
    ],
)
def test_an_interval_that_could_not_have_disagreed_decides_nothing(low, high, paper, scale, undecided):
    c = Claim("f", "q", 0.5 * (low + high), low, high, paper, 0.05 if paper == 0 else 0.005, scale=scale)
    assert c.verdict == (Verdict.UNDECIDED if undecided else Verdict.AGREES)


def test_what_is_no_test_is_no_agreement():
    """Neither a number that its paper contradicts nor one that parameters were chosen for."""
    found = Interval(np.array(1.0), np.array(0.99), np.array(1.01))
    one = Published(1.0, 0.05)
    assert claim("f", "q", found, one).text == "agrees"
    assert claim("f", "q", found, one, contradiction="1 and 2", shown_by="g").text == "paper inconsistent: 1 and 2 (g)"
    assert claim("f", "q", found, one, calibrated="gamma").text == "calibrated: meets it; gamma"
    other = Published(2.0, 0.05)
    assert claim("f", "q", found, other, cause="N", shown_by="g").text == "differs: N (g)"
    assert claim("f", "q", found, other).text == "differs: no cause has been measured in these data"


def test_a_value_without_interval_is_not_measured_rather_than_right():
    one = Published(1.0)
    c = claim("f", "q", Interval(np.array(1.0), np.array(np.nan), np.array(np.nan)), one, how="one packing")
    assert not c.agrees and c.text == "not measured: no interval from fewer than five packings"
    assert claim("f", "q", None, one, how="no packing").text == "not measured: no packing"
    assert claim("f", "q", None, one).text == "not measured: too few data"


def test_contradictions_are_those_of_the_papers_own_numbers():
    """Each by hand: 3.7 sqrt(0.129) = 1.33; 7.1 * 0.045 + 3.3 sqrt(0.045) - 4 * 0.04 - 2.6 sqrt(0.04) = 0.34; ..."""
    assert "1.33" in conventions.contradiction_of_disks() and "1.22" in conventions.contradiction_of_disks()
    assert "0.34" in conventions.contradiction_of_models()
    assert "0.66" in conventions.contradiction_of_single_exponent("d_z")
    assert "0.92" in conventions.contradiction_of_single_exponent("g")
    assert "3.992" in conventions.contradiction_of_counting(256)
    assert "3.82" in conventions.contradiction_of_voids() and "4.20" in conventions.contradiction_of_voids()


# ensembles ------------------------------------------------------------------------------------------------------------


def test_distances_are_those_to_the_onset_of_each_packing():
    d = add_distances(states())
    first = d[d["state"] == 0]
    assert (first[["d_rho", "d_phi", "d_z", "lost"]].abs().to_numpy() < 1e-12).all()
    # areas: all of the loss of rho against phi goes into the particles
    last = d[d["state"] == 30].iloc[0]
    assert last["lost"] == pytest.approx(1 - (last["rho"] / last["phi"]) / 1.0, abs=1e-12)
    assert add_distances(d) is d


def test_states_without_a_minimum_or_a_backbone_are_left_out():
    s = states()
    s.loc[5, "converged"] = False
    s.loc[7, "z"] = np.nan
    assert len(add_distances(s)) == len(s) - 2


def test_only_the_usual_protocol_is_drawn():
    s = states()
    other = s[s["seed"] == 1].assign(units="k", ensemble="shear-stabilized")
    assert len(select_usual(pd.concat([s, other]))) == len(s)


def test_places_that_few_packings_reach_are_left_out():
    d = add_distances(states(sizes=(32,)))
    full = ensemble(d, "sp", 32, "d_phi", "z", from_onset())
    cut = ensemble(d[(d["d_phi"] < 0.1) | (d["seed"] <= 2)], "sp", 32, "d_phi", "z", from_onset())
    assert full.y.shape[0] == cut.y.shape[0] == 5
    assert cut.mean[0].max() < 0.1 < full.mean[0].max()
    assert ensemble(d, "dp", 32, "d_phi", "z", log_places(1e-6, 1)).y.shape == (1, 1)


def test_every_packing_is_interpolated_at_the_same_places():
    """Bins averaged states at different distances; PCHIP in the root meets roots and lines alike."""
    x = np.array([0.0, 0.01, 0.02, 0.04, 0.08])
    places = np.array([0.005, 0.015, 0.03, 0.06, 0.1])
    for law in (lambda v: 3.7 * v**0.5, lambda v: 2.0 * v, lambda v: 3.7 * v**0.5 + 4.0 * v):
        found = interpolate(x, law(x), places)
        assert found[1:4] == pytest.approx(law(places[1:4]), rel=2e-3)
        assert np.isnan(found[[0, 4]]).all()  # nothing is known between onset and the first state, nor beyond the last


def test_voids_are_counted_once():
    raw = TABLES["voids"]()
    counted = count_voids(raw)
    assert counted["voids"].sum() == len(raw)
    assert counted["shape"].sum() == pytest.approx(raw["shape"].sum())
    assert counted[counted["onset"]]["voids"].sum() == (raw["state"] == 0).sum()


# reference data -------------------------------------------------------------------------------------------------------


def test_reference_tables_give_the_same_figures(tmp_path):
    written = save(tables(), tmp_path / "reference", {"commit": "abc"})
    assert set(written) == set(NAMES)
    back = read_folder(tmp_path / "reference")
    assert back.facts == {"commit": "abc"}
    for name in ("boromand-11", "boromand-8", "baumgarten-5"):
        for a, b in zip(drawn(name).claims, gallery.draw(name, back).claims, strict=True):
            assert (b.value, b.low, b.high) == pytest.approx((a.value, a.low, a.high), rel=1e-2, nan_ok=True)


def test_new_packings_join_those_that_are_there(tmp_path):
    """Seeds 4 to 8 of a new campaign replace 4 and 5 of the old one and leave 1 to 3; both origins are on record."""
    save(tables(), tmp_path, {"commit": "old"})
    new = EnsembleTables(
        lambda name: TABLES[name]().assign(seed=lambda t: t["seed"] + 3) if name == "spectra" else pd.DataFrame(),
        {"commit": "new"},
    )
    old = read_folder(tmp_path)
    both = combine(new, old)
    assert both.facts["commit"] == "new"
    assert sorted(both.spectra["seed"].unique()) == list(range(1, 9))
    keys = ["n", "seed", "target_pressure", "law", "beta", "eta_f", "prestress", "omega"]
    assert not both.spectra.duplicated(keys).any()
    fourth = both.spectra[(both.spectra["seed"] == 4) & (both.spectra["n"] == 256)]
    assert fourth["g0"].max() == pytest.approx(TABLES["spectra"]().query("seed == 1 and n == 256")["g0"].max())
    assert len(both.states) == len(old.states)


def test_reference_tables_are_written_alike_every_time(tmp_path):
    for folder in ("a", "b"):
        save(tables(), tmp_path / folder, {})
    for path in (tmp_path / "a").iterdir():
        assert path.read_bytes() == (tmp_path / "b" / path.name).read_bytes()


def test_tables_that_a_campaign_lacks_are_left_out_and_named(tmp_path):
    def read(name):
        if name == "onset":
            return TABLES["onset"]()
        raise InputError(f"no table {name}")

    assert set(save(EnsembleTables(read), tmp_path, {})) == {"onset"}
    back = read_folder(tmp_path)
    assert gallery.draw("boromand-10", back).claims
    with pytest.raises(StorageError, match=r"spectra.*cannot be read"):
        gallery.draw("baumgarten-1", back)
    with pytest.raises(InputError, match="no table has rows"):
        save(EnsembleTables(lambda name: pd.DataFrame()), tmp_path, {})


def test_damaged_reference_tables_are_refused(tmp_path):
    with pytest.raises(StorageError, match=r"reference\.json"):
        read_folder(tmp_path)
    save(tables(), tmp_path, {})
    (tmp_path / "onset.csv.gz").write_bytes(b"no gzip")
    with pytest.raises(StorageError, match="onset"):
        gallery.draw("boromand-10", read_folder(tmp_path))
    (tmp_path / "onset.csv.gz").write_bytes(gzip.compress(b"model,n\nsp,32\n"))
    with pytest.raises(InputError, match="column"):
        gallery.draw("boromand-10", read_folder(tmp_path))


def test_the_reference_data_are_packed_whole_and_small():
    folder = REFERENCE
    rows = json.loads((folder / "reference.json").read_text())["rows"]
    for name, count in rows.items():
        assert gzip.open(folder / f"{name}.csv.gz").read().count(b"\n") == 1 + count > 1
    assert set(rows) == {"states", "onset", "void_counts", "spectra", "quasistatic", "correlation"}
    assert sum(path.stat().st_size for path in folder.iterdir()) < 6e6


def test_the_summary_counts_numbers_of_the_papers_alone():
    theirs, beside = drawn("boromand-6").claims, drawn("dynamics-flow-curves").claims
    assert beside and first_line([*theirs, *beside]) == first_line(theirs)
    assert first_line(theirs).startswith(f"{len(theirs)} numbers of both papers: ")


def test_the_readme_repeats_how_many_numbers_agree():
    """`jamlab figure all` writes the file; the slow test below draws it anew."""
    told = (REFERENCE / SUMMARY).read_text().splitlines()[0]
    readme = Path(__file__).parents[2] / "README.md"
    assert told in " ".join(readme.read_text().split())


@pytest.mark.slow
def test_every_figure_is_drawn_from_the_reference_data(tmp_path):
    """Two processes write, this one draws once more: pictures are the same to the last byte."""
    drawn, failures = gallery.write_all(list(gallery.FIGURES), reference_tables(), tmp_path / "two", processes=2)
    assert not failures and [d.name for d in drawn] == list(gallery.FIGURES)
    measured = [c for d in drawn for c in d.claims if c.measured]
    assert len(measured) > 60
    differing = [c for d in drawn for c in d.claims if c.verdict is Verdict.DIFFERS]
    assert [c.line for c in differing if not (c.cause and c.shown_by)] == []  # a difference has a measured cause
    assert (tmp_path / "two" / SUMMARY).read_text() == (REFERENCE / SUMMARY).read_text()
    for name in gallery.FIGURES:
        drawing = gallery.draw(name, reference_tables())
        for path in gallery.write(drawing, tmp_path)[0]:
            assert path.read_bytes() == (tmp_path / "two" / path.name).read_bytes()
        assert (name, covered(drawing.figure)) == (name, 0)


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


def test_what_a_legend_covers_is_counted():
    figure = Figure()
    axes = figure.subplots()
    axes.plot([0, 1], [0, 1], label="a line")
    axes.legend(loc="center")
    assert covered(figure) > 0
    axes.legend(loc="upper left")
    assert covered(figure) == 0


# files, report and command --------------------------------------------------------------------------------------------


def test_the_report_holds_pictures_and_marks_what_differs(tmp_path):
    names = ["baumgarten-5", "tables"]
    drawings, failures = gallery.write_all(names, tables(), tmp_path)
    assert not failures
    for name in names:
        assert drawings[names.index(name)].png == (tmp_path / f"{name}.png").read_bytes()
        assert len(pd.read_csv(tmp_path / f"{name}.csv")) == len(drawn(name).table)
        assert (tmp_path / f"{name}.png").read_bytes()[:4] == b"\x89PNG"
        assert (tmp_path / f"{name}.pdf").read_bytes()[:5] == b"%PDF-"
    page = (tmp_path / gallery.PAGE).read_text()
    assert page.count("data:image/png;base64,") == len(names)
    assert not re.search(r"(src|href)=\"(?!data:|#)", page)  # nothing from elsewhere
    claims = [c for d in drawings for c in d.claims]
    assert 0 < page.count('<tr data-mark="agrees"') == sum(c.agrees for c in claims) < len(claims)
    assert page.count("<tr data-mark=") == len(claims)
    assert page.index("data:image") < page.index("<tr data-mark=")  # pictures first
    verdicts = pd.read_csv(tmp_path / gallery.VERDICTS)
    assert verdicts["verdict"].tolist() == [c.verdict for c in claims]
    assert (tmp_path / SUMMARY).read_text().startswith(f"{len(claims)} numbers of both papers: agrees ")


def test_figures_that_the_tables_do_not_give_are_told(tmp_path):
    empty = pd.DataFrame({"sliding": []})
    some = EnsembleTables(lambda name: TABLES[name]() if name == "quasistatic" else empty)
    drawings, failures = gallery.write_all(["baumgarten-5", "boromand-8"], some, tmp_path)
    assert [d.name for d in drawings] == ["baumgarten-5"] and [f.name for f in failures] == ["boromand-8"]
    assert "Not drawn" in (tmp_path / gallery.PAGE).read_text()
    with pytest.raises(InputError, match="no figure could be drawn"):
        gallery.write_all(["boromand-8"], some, tmp_path)


def test_command(tmp_path):
    save(tables(), tmp_path / "reference", {})
    words = ["figure", "baumgarten-5", "--from", str(tmp_path / "reference"), "--out", str(tmp_path / "out")]
    shown = call(tmp_path, *words)
    assert shown.exit_code == 0
    assert re.search(
        r"baumgarten-5: exponent of approach in p = 0\.2\d+ \[0\.2\d+, 0\.2\d+\], paper 0\.25", shown.stdout
    )
    assert {p.suffix for p in (tmp_path / "out").iterdir()} == {".png", ".pdf", ".csv"}
    content = json.loads(call(tmp_path, *words, "--json").stdout)
    assert [c["verdict"] for c in content["claims"]] == ["agrees"] * 3
    assert "boromand-11" in call(tmp_path, "figure", "list").stdout
    assert set(json.loads(call(tmp_path, "figure", "list", "--json").stdout)) == set(gallery.FIGURES)


@pytest.mark.parametrize(
    ("words", "named"), [(["boromand-12"], "boromand-12"), (["boromand-4", "--from", "nowhere"], "nowhere")]
)
def test_bad_calls_are_refused(tmp_path, words, named):
    done = call(tmp_path, "figure", *words)
    assert done.exit_code == 1 and named in done.stderr and not list(tmp_path.iterdir())
