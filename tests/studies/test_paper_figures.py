"""Figures of both papers from tables in which the papers' laws hold, their report and their command."""

import json
import re

import numpy as np
import pandas as pd
import pytest
from bare_pictures import artists
from commands import call_studies
from drawn_figures import FIGURES, PICTURES, PUBLISHED, TABLES, drawn, saved, tables
from matplotlib.axes import Axes
from paper_tables import onset, states

from jamlab.errors import InputError
from studies import pages
from studies.claims import SUMMARY
from studies.ensemble_tables import EnsembleTables
from studies.panels import drawing
from studies.registry import studies
from studies.study import Group, Study


def found(name, text):
    """The one claim of a figure whose quantity is the text, or begins with it."""
    claims = drawn(name).claims
    hits = [c for c in claims if c.quantity == text] or [c for c in claims if c.quantity.startswith(text)]
    assert len(hits) == 1, [c.quantity for c in drawn(name).claims]
    return hits[0]


@pytest.mark.parametrize(
    ("figure", "quantity", "value", "tolerance"),
    [
        ("boromand-4", "C of eq 11", 1.21, 1e-3),
        ("boromand-6", "alpha_0", 0.5, 0.01),
        ("boromand-6", "beta_0", 0.5, 0.01),
        ("boromand-8", "P_3 near rho_J, SP", 0.4, 1e-9),
        ("boromand-8", "P_5 near rho_J, DP", 0.2, 1e-9),
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
        ("baumgarten-1", "slope of G' - G_0, critical", 0.556, 0.005),  # of Re (1 + ix)^0.5 - 1, 30 < x < 1000
        ("baumgarten-1", "slope of G'', critical", 0.5, 0.02),
        ("baumgarten-3", "mu", 0.5, 0.02),
        ("baumgarten-3", "lambda", 1.0, 0.05),
        ("baumgarten-4", "largest |G''", 0.0, 1e-9),
        ("baumgarten-4", "exponent of eta_0 in p", 0.5, 0.01),
        ("baumgarten-4", "exponent of eta_0(beta)", 1.0, 0.01),
        ("baumgarten-5", "exponent of approach in p", 0.25, 0.01),
        ("baumgarten-5", "exponent of sliding in p", -0.25, 0.01),
        ("baumgarten-6", "lambda", 1.0, 0.02),
        ("baumgarten-6", "Delta: G' - G_0", 0.556, 0.005),
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
    both = pd.concat([states(z0=5.0, c=0.9), states("dp")])
    other = EnsembleTables({"states": both, "onset": onset()}.__getitem__)
    by_name = {c.quantity: c for c in pages.draw("tables", other).claims}
    assert by_name["z_0, SP(φ)"].value == pytest.approx(5.0, abs=0.1)
    assert by_name["z_0, SP(φ)"].verdict == "differs" and by_name["z_0, SP(φ)"].cause
    assert by_name["G_0, SP(φ)"].compared != "differs"
    drawing = pages.draw("boromand-4", other)
    c = drawing.claims[0]
    assert c.value == pytest.approx(0.9, abs=1e-3) and c.compared == "differs" and c.cause
    assert drawing.values["largest C at one dphi"].value == pytest.approx(0.9, abs=1e-3)


def test_the_loss_of_the_fluid_alone_is_no_critical_slope():
    """G'' of a fluid of viscosity 1 rises with omega; what it adds to G'' ~ omega^0.5 is taken off. G'' itself, which
    the paper collapses, stands in the family, as G' does beside G' - G_0."""
    table = TABLES["spectra"]()
    fluid = (table["law"] == "stokes") & (table["eta_f"] == 1)
    table.loc[fluid, "loss"] += table.loc[fluid, "omega"]
    drawing = pages.draw("baumgarten-6", EnsembleTables({"spectra": table}.get))
    (delta,) = (c for c in drawing.claims if c.quantity.startswith("Delta: G'' - eta_F omega"))
    assert delta.value == pytest.approx(0.5, abs=0.02) and delta.verdict != "differs"
    assert delta.family["of = G''"].value > 0.55 and delta.verdict == "undecided"


SLOW = ("beyond-droplet-spectra", "beyond-stiffening-disks")  # to draw


@pytest.mark.parametrize("name", [pytest.param(n, marks=pytest.mark.slow if n in SLOW else ()) for n in FIGURES])
def test_every_figure_keeps_what_it_draws(name):
    drawing = drawn(name)
    table = drawing.table
    assert list(table.columns) == ["panel", "series", "x", "y", "low", "high"]
    assert np.isfinite(table[["x", "y"]].to_numpy()).all() and len(table) > 10
    beside = name.startswith(("dynamics-", "beyond-")) and name not in PUBLISHED
    pictures = name in (*PICTURES, "micrograph-errors") or beside
    assert drawing.caption and bool(drawing.claims) is not pictures  # of which no paper has numbers
    panels = artists(drawing.figure, Axes)  # insets too
    for (panel, series), points in table.groupby(["panel", "series"]):
        (axes,) = (axes for axes in panels if axes.get_gid() == panel)
        drawn_points = {tuple(place) for line in axes.lines for place in line.get_xydata()}
        assert set(zip(points["x"], points["y"], strict=True)) <= drawn_points, (panel, series)
    for axes in drawing.figure.axes:
        assert (axes.get_xlabel() and axes.get_ylabel()) or name == "tables" or name in PICTURES


# files, report and command --------------------------------------------------------------------------------------------


def write(folder, *names, given=None):
    group = Group("Figures", lambda drawings: "Lead.", [studies()[name] for name in names])
    return pages.write_page(folder, "figures", group, given or tables())


def test_the_report_holds_pictures_and_marks_what_differs(tmp_path):
    names = ["baumgarten-5", "tables"]
    drawings, failures = write(tmp_path, *names)
    assert not failures and [d.name for d in drawings] == names
    for name in names:
        assert len(pd.read_csv(tmp_path / f"{name}.csv")) == len(drawn(name).table)
        assert (tmp_path / f"{name}.png").read_bytes()[:4] == b"\x89PNG"
        assert (tmp_path / f"{name}.pdf").read_bytes()[:5] == b"%PDF-"
    page = (tmp_path / "figures.html").read_text()
    assert page.count("data:image/png;base64,") == len(names)
    assert not re.search(r"(src|href)=\"(?!data:|#)", page)  # nothing from elsewhere
    claims = [c for d in drawings for c in d.claims]
    assert 0 < page.count('<tr data-mark="agrees"') == sum(c.verdict == "agrees" for c in claims) < len(claims)
    assert page.count("<tr data-mark=") == len(claims)
    assert page.index("data:image") < page.index("<tr data-mark=")  # pictures first


def test_figures_that_the_tables_do_not_give_are_told(tmp_path):
    def read(name):
        if name == "quasistatic":
            return TABLES[name]()
        raise InputError(f"no table {name}")

    some = EnsembleTables(read)
    drawings, failures = write(tmp_path, "baumgarten-5", "boromand-8", given=some)
    assert [d.name for d in drawings] == ["baumgarten-5"] and list(failures) == ["boromand-8"]
    assert "Not drawn" in (tmp_path / "figures.html").read_text()


def test_a_fault_of_a_figure_is_no_lack_of_data(tmp_path):
    """A column that the code names wrongly is no table that lacks it."""
    broken = Study("broken", "Broken", {}, lambda tables: tables.read("states")["no such column"])
    with pytest.raises(KeyError):
        pages.write_page(tmp_path, "page", Group("Title", lambda drawings: "", [broken]), tables())


def test_json_holds_the_numbers_of_figures_and_claims(tmp_path):
    names = ["baumgarten-4", "baumgarten-5"]
    words = ["draw", *names, "--from", saved(tmp_path / "reference"), "--out", tmp_path / "out", "--json"]
    content = json.loads(call_studies(tmp_path, *words).stdout)
    for name, numbers in content["values"].items():
        assert set(numbers) == set(drawn(name).numbers)
    slope = "exponent of the root mean square of approach in p"
    shown = content["values"]["baumgarten-5"][slope]["value"]
    assert shown == pytest.approx(drawn("baumgarten-5").numbers[slope]["value"], rel=1e-6)
    fields = {"figure", "quantity", "value", "low", "high", "below", "above", "family", "paper", "margin", "relation"}
    rows = content["rows"]
    assert all({*fields, "kind", "where", "verdict"} <= set(row) for row in rows)
    assert all(row["family"] or row["below"] == row["above"] == 0 for row in rows)
    assert [row["verdict"] for row in rows] == [c.verdict for name in names for c in drawn(name).claims]
    assert [row["kind"] for row in rows[:3]] == ["identity", "duplicate", "measured"]
    assert rows[0]["where"] == "[T] Imbalanced contact damping, eq 18"
    assert content["captions"] == {name: drawn(name).caption for name in names}
    assert pd.read_csv(tmp_path / "out" / pages.VERDICTS)["verdict"].tolist() == [row["verdict"] for row in rows]
    counted = sum(c.counted for name in names for c in drawn(name).claims)
    assert (tmp_path / "out" / SUMMARY).read_text().startswith(f"{counted} numbers of both papers: ")


@pytest.mark.parametrize(
    ("words", "named"), [(["boromand-12"], "boromand-12"), (["boromand-4", "--from", "nowhere"], "nowhere")]
)
def test_bad_calls_are_refused(tmp_path, words, named):
    done = call_studies(tmp_path, "draw", *words)
    assert done.exit_code == 1 and named in done.stderr and not list(tmp_path.iterdir())


def test_the_two_lengths_of_fig_7_are_two_measurements():
    """At the lowest frequency both laws give one motion: contact damping is measured at all, as in the paper."""
    lengths = [found("baumgarten-7", text).value for text in ("l/L, contact", "plateau l/L")]
    assert lengths[0] == pytest.approx(lengths[1], rel=0.05) and lengths[0] != lengths[1]


def test_mean_squares_of_slow_shear_stand_beside_the_medians():
    """G_0 = p^0.5 makes the root mean square of approach p^0.25; non-affine motion has none."""
    squares = "exponent of the root mean square of {} in p"
    values = drawn("baumgarten-5").values
    assert values[squares.format("approach")].value == pytest.approx(0.25, abs=5e-4)
    assert values[squares.format("sliding")].value == pytest.approx(-0.25, abs=0.01)
    assert squares.format("nonaffine") not in values


def test_means_beside_medians_are_of_one_size_at_a_time():
    """Two sizes of other exponents, at other pressures: the larger is the number, the smaller one of its choices."""
    rng = np.random.default_rng(5)

    def rows(n, pressures, power):
        who = {"ensemble": "fixed-box", "prestress": False, "n": n}
        for seed in range(1, 6):
            for p in pressures:
                f = (1 + 0.01 * rng.normal()) * p**power
                moved = {"approach": f, "sliding": 1 / f, "nonaffine": 1 / f, "sheared": 1 / f}
                means = {f"mean_{name}": value for name, value in list(moved.items())[:3]}
                yield {**who, "seed": seed, "pressure": p, "target_pressure": p, **moved, **means}

    table = pd.DataFrame([*rows(512, (1e-2, 1e-3, 1e-4), 0.1), *rows(16384, (1e-4, 1e-5, 1e-6), 0.3)])
    empty = TABLES["spectra"]().head(0)
    given = EnsembleTables(lambda name: table if name == "quasistatic" else empty)
    claims = {claim.quantity: claim for claim in pages.draw("baumgarten-5", given).claims}
    claim = claims["exponent of mean approach in p"]
    assert claim.value == pytest.approx(0.3, abs=0.01)
    assert claim.family["N = 512"].value == pytest.approx(0.1, abs=0.01)
    assert "N = 16384, 3 pressures down to 1e-06" in claim.how and claim.cause.endswith("0.30")
    assert claims["exponent of sliding without its affine part in p"].value == pytest.approx(-0.3, abs=0.01)


def test_a_curve_without_points_has_no_name_in_the_legend():
    out, (axes,) = drawing("boromand-6", 1, 1, 3.0, 3.0)
    out.curve(axes, "N = 16", [1.0], [np.nan])
    out.curve(axes, "N = 32", [1.0], [2.0])
    assert axes.get_legend_handles_labels()[1] == ["N = 32"]
